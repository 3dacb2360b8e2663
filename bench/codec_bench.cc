// Throughput of the file decoders, in bytes of file per second. PNG: ours against that of OpenCV and, if
// libspng-dev is installed, of libspng. The images are those of frame 0 of kitti_03_demo if SEXTANT_DATA is
// set, otherwise synthetic ones of the same size. Poses: 20,000 frames as text and as XML; if libpugixml-dev
// is installed, also the XML parser of pugixml.

#include <benchmark/benchmark.h>
#ifdef SEXTANT_LIBSPNG
#include <spng.h>
#endif
#ifdef SEXTANT_PUGIXML
#include <pugixml.hpp>
#endif

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace {

using namespace sextant;

constexpr int image_width = 1242;
constexpr int image_height = 375;

Image<uint16_t> synthetic_disparity() {
  std::mt19937 rng(1);
  return image_of(image_width, image_height,
                  [&](int x, int y) { return static_cast<uint16_t>(40 * y + x / 8 + rng() % 32); });
}

Image<Rgb> synthetic_colour() {
  std::mt19937 rng(2);
  const auto noisy = [&](double level) {
    return static_cast<uint8_t>(level + static_cast<double>(rng() % 16));
  };
  return image_of(image_width, image_height, [&](int x, int y) {
    const double wave = 110 + 90 * std::sin(0.02 * x) * std::cos(0.03 * y);
    return Rgb{noisy(wave), noisy(0.8 * wave), noisy(0.6 * wave + 20)};
  });
}

Image<Flow> synthetic_flow() {
  std::mt19937 rng(3);
  const auto noise = [&] { return 0.01f * static_cast<float>(rng() % 100); };
  return image_of(image_width, image_height, [&](int x, int y) {
    return Flow{0.02f * static_cast<float>(x - 600) + noise(), 0.03f * static_cast<float>(y) + noise()};
  });
}

Image<uint16_t> synthetic_mask() {
  Image<uint16_t> mask(image_width, image_height);
  for (int y = 200; y < 300; ++y) {
    for (int x = 400; x < 600; ++x) mask(x, y) = x < 500 ? 3 : 12;
  }
  return mask;
}

std::string real_or(const char* path, std::string synthetic) {
  const char* data = std::getenv("SEXTANT_DATA");
  if (data == nullptr) return synthetic;
  return read_file(std::filesystem::path(data) / "kitti_03_demo" / path);
}

const std::string& depth_png() {
  static const std::string bytes = real_or("depth/000000.png", encode_png(synthetic_disparity()));
  return bytes;
}

const std::string& colour_png() {
  static const std::string bytes = real_or("image_0/000000.png", encode_png(synthetic_colour()));
  return bytes;
}

const std::string& flow_png() {
  static const std::string bytes = encode_png(kitti_from_flow(synthetic_flow()));
  return bytes;
}

template <typename Decode>
void run(benchmark::State& state, const std::string& bytes, Decode decode) {
  for (auto _ : state) benchmark::DoNotOptimize(decode(bytes));
  state.SetBytesProcessed(state.iterations() * static_cast<int64_t>(bytes.size()));
}

#ifdef SEXTANT_LIBSPNG
std::vector<char> libspng(const std::string& bytes) {
  const std::unique_ptr<spng_ctx, void (*)(spng_ctx*)> context(spng_ctx_new(0), spng_ctx_free);
  size_t size = 0;
  spng_set_png_buffer(context.get(), bytes.data(), bytes.size());
  spng_decoded_image_size(context.get(), SPNG_FMT_PNG, &size);
  std::vector<char> pixels(size);
  if (spng_decode_image(context.get(), pixels.data(), size, SPNG_FMT_PNG, 0) != 0) fail("libspng: no PNG");
  return pixels;
}
void png16_libspng(benchmark::State& state) { run(state, depth_png(), libspng); }
void png_rgb16_libspng(benchmark::State& state) { run(state, flow_png(), libspng); }
void png_rgb_libspng(benchmark::State& state) { run(state, colour_png(), libspng); }
BENCHMARK(png16_libspng)->Unit(benchmark::kMillisecond);
BENCHMARK(png_rgb16_libspng)->Unit(benchmark::kMillisecond);
BENCHMARK(png_rgb_libspng)->Unit(benchmark::kMillisecond);
#endif

constexpr int n_poses = 20'000;

std::string poses_tum() {
  std::string text;
  for (int i = 0; i < n_poses; ++i)
    text += fmt::format("{:.6f} {:.9f} -0.123456789 {:.9f} 0 0 0 1\n", 0.1 * i, 1e-3 * i, 1e-2 * i);
  return text;
}

std::string poses_xml() {
  const auto pose = [](const char* name, double x) {
    std::string text = fmt::format("<{}>\n<R_>\n", name);
    for (int i = 0; i < 9; ++i)
      text += fmt::format("<rot{0}{1}>{2:.17e}</rot{0}{1}>\n", i / 3 + 1, i % 3 + 1, i % 4 == 0 ? 1.0 : 0.0);
    return text +
           fmt::format(
               "</R_>\n<t_>\n<data>\n<item>{:.17e}</item>\n<item>0</item>\n<item>0</item>\n</data>\n</t_>\n"
               "</{}>\n",
               x, name);
  };
  std::string text = "<?xml version=\"1.0\"?>\n<boost_serialization>\n<val>\n";
  for (int i = 0; i < n_poses; ++i)
    text += fmt::format("<item>\n{}{}<frame_id>{}</frame_id>\n</item>\n", pose("pose", 0.1 * i),
                        pose("gt_pose", 0.1 * i), i);
  return text + "</val>\n</boost_serialization>\n";
}

void poses(benchmark::State& state, const std::string& bytes, const char* format) {
  run(state, bytes, [&](const std::string& b) { return decode_trajectory(b, format); });
}
void poses_as_text(benchmark::State& state) { poses(state, poses_tum(), "tum"); }
void poses_as_xml(benchmark::State& state) { poses(state, poses_xml(), "vdo_xml"); }
BENCHMARK(poses_as_text)->Unit(benchmark::kMillisecond);
BENCHMARK(poses_as_xml)->Unit(benchmark::kMillisecond);

#ifdef SEXTANT_PUGIXML
/// Parses the document alone, without converting its numbers.
void xml_pugixml(benchmark::State& state) {
  run(state, poses_xml(), [](const std::string& b) {
    pugi::xml_document document;
    const unsigned flags = pugi::parse_minimal | pugi::parse_embed_pcdata;
    if (!document.load_buffer(b.data(), b.size(), flags, pugi::encoding_utf8)) fail("pugixml: no XML");
    return document.first_child().hash_value();
  });
}
BENCHMARK(xml_pugixml)->Unit(benchmark::kMillisecond);
#endif

cv::Mat opencv(const std::string& bytes, int flags) {
  const cv::Mat view(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  return cv::imdecode(view, flags);
}

void png16(benchmark::State& state) {
  run(state, depth_png(), [](const std::string& b) { return decode_png16(b, "depth"); });
}
void png16_opencv(benchmark::State& state) {
  run(state, depth_png(), [](const std::string& b) { return opencv(b, cv::IMREAD_UNCHANGED); });
}
void png_rgb16(benchmark::State& state) {
  run(state, flow_png(), [](const std::string& b) { return decode_png_rgb16(b, "flow"); });
}
void png_rgb16_opencv(benchmark::State& state) {
  run(state, flow_png(), [](const std::string& b) { return opencv(b, cv::IMREAD_UNCHANGED); });
}
void png_rgb(benchmark::State& state) {
  run(state, colour_png(), [](const std::string& b) { return decode_png_rgb(b, "image"); });
}
void png_rgb_opencv(benchmark::State& state) {
  run(state, colour_png(), [](const std::string& b) { return opencv(b, cv::IMREAD_COLOR); });
}
void png_gray_of_colour(benchmark::State& state) {
  run(state, colour_png(), [](const std::string& b) { return decode_png_gray(b, "image"); });
}
void flo(benchmark::State& state) {
  const std::string bytes = real_or("flow/000000.flo", encode_flo(synthetic_flow()));
  run(state, bytes, [](const std::string& b) { return decode_flo(b, "flow"); });
}
void mask_text(benchmark::State& state) {
  const std::string bytes = real_or("semantic/000000.txt", encode_mask_text(synthetic_mask()));
  run(state, bytes, [](const std::string& b) { return decode_mask_text(b, "mask"); });
}
void depth_from_disparity(benchmark::State& state) {
  const Image<uint16_t> disparity = decode_png16(depth_png(), "depth");
  for (auto _ : state) benchmark::DoNotOptimize(depth_from_disparity256(disparity, 387.5744));
  state.SetBytesProcessed(state.iterations() * static_cast<int64_t>(2 * disparity.size()));
}

BENCHMARK(png16)->Unit(benchmark::kMillisecond);
BENCHMARK(png16_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(png_rgb16)->Unit(benchmark::kMillisecond);
BENCHMARK(png_rgb16_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(png_rgb)->Unit(benchmark::kMillisecond);
BENCHMARK(png_rgb_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(png_gray_of_colour)->Unit(benchmark::kMillisecond);
BENCHMARK(flo)->Unit(benchmark::kMillisecond);
BENCHMARK(mask_text)->Unit(benchmark::kMillisecond);
BENCHMARK(depth_from_disparity)->Unit(benchmark::kMillisecond);

}  // namespace
