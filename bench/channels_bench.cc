// Time of the computed channels (SGBM, DIS) and of MOTS masks, on one thread: on real images and labels if
// SEXTANT_DATA is set, otherwise on synthetic ones of the same size.

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "sextant/base/files.h"
#include "sextant/datasets/channels/computed_channels.h"
#include "sextant/datasets/codec/mots.h"
#include "sextant/datasets/codec/png.h"

namespace {

using namespace sextant;

constexpr int image_width = 1242;
constexpr int image_height = 375;

// A random texture, `shift` px farther left.
Image<uint8_t> synthetic_image(int shift) {
  std::mt19937 rng(1);
  const auto wide = image_of(image_width + 64, image_height, [&](int x, int y) {
    const double wave = 120 + 60 * std::sin(0.13 * x) * std::cos(0.21 * y);
    return static_cast<uint8_t>(wave + static_cast<double>(rng() % 64));
  });
  Image<uint8_t> image(image_width, image_height);
  for (int y = 0; y < image_height; ++y) std::copy_n(wide.row(y) + shift, image_width, image.row(y));
  return image;
}

Image<uint8_t> real_or(const char* path, int shift) {
  const char* data = std::getenv("SEXTANT_DATA");
  if (data == nullptr) return synthetic_image(shift);
  const std::filesystem::path file = std::filesystem::path(data) / "kitti_sceneflow_2015" / path;
  return decode_png_gray(read_file(file), file.string());
}

// Frame 0 of KITTI tracking 0001 has 8 objects; the synthetic one 10 ellipses.
const std::string& mots_rows() {
  static const std::string text = [] {
    if (const char* data = std::getenv("SEXTANT_DATA"); data != nullptr) {
      return read_file(std::filesystem::path(data) / "kitti_tracking/training/instances_txt/0001.txt");
    }
    const auto mask = image_of(image_width, image_height, [](int x, int y) {
      const double dx = (x % 124 - 62) / 55.0, dy = (y - 190) / 90.0;
      return static_cast<uint16_t>(dx * dx + dy * dy < 1 && x / 124 < 10 ? x / 124 + 1 : 0);
    });
    return encode_mots_text({{0, mask}}, {});
  }();
  return text;
}

void sgbm(benchmark::State& state) {
  const auto left = real_or("image_2/000002_10.png", 0), right = real_or("image_3/000002_10.png", 20);
  for (auto _ : state) benchmark::DoNotOptimize(sgbm_disparity(left, right));
}
void dis(benchmark::State& state) {
  const auto prev = real_or("image_2/000002_10.png", 0), curr = real_or("image_2/000002_11.png", 5);
  for (auto _ : state) benchmark::DoNotOptimize(dis_flow(prev, curr));
}
void mots_mask(benchmark::State& state) {
  const MotsText mots(mots_rows(), "m.txt");
  state.counters["objects"] = static_cast<double>(mots.rows(0).size());
  for (auto _ : state) benchmark::DoNotOptimize(mots.mask(0, image_width, image_height));
}
void mots_parse(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(MotsText(mots_rows(), "m.txt"));
  state.SetBytesProcessed(state.iterations() * static_cast<int64_t>(mots_rows().size()));
}
void mots_encode(benchmark::State& state) {
  const Image<uint16_t> mask = MotsText(mots_rows(), "m.txt").mask(0, image_width, image_height);
  for (auto _ : state) benchmark::DoNotOptimize(encode_mots_text({{0, mask}}, {}));
}

BENCHMARK(sgbm)->Unit(benchmark::kMillisecond);
BENCHMARK(dis)->Unit(benchmark::kMillisecond);
BENCHMARK(mots_mask)->Unit(benchmark::kMillisecond);
BENCHMARK(mots_parse)->Unit(benchmark::kMillisecond);
BENCHMARK(mots_encode)->Unit(benchmark::kMillisecond);

}  // namespace
