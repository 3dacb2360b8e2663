#include "sextant/noise/draws.h"

#include <algorithm>
#include <string>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/simd.h"

namespace sextant {
namespace {

/// A pixel outside every image, whose draw is used for the whole frame.
constexpr int whole_frame = -1;

PhiloxWords counter(NoiseChannel channel, int frame, int x, int y) {
  return {static_cast<uint32_t>(x), static_cast<uint32_t>(y), static_cast<uint32_t>(frame),
          static_cast<uint32_t>(channel)};
}

SEXTANT_SIMD void fill_uniforms(PhiloxKey key, uint32_t frame, uint32_t channel, const int* x, const int* y,
                                size_t n, double* first, double* second) {
  for (size_t i = 0; i < n; ++i) {
    const PhiloxWords w =
        philox4x32(key, {static_cast<uint32_t>(x[i]), static_cast<uint32_t>(y[i]), frame, channel});
    first[i] = unit_interval(w[0], w[1]);
    second[i] = unit_interval(w[2], w[3]);
  }
}

SEXTANT_SIMD void uniforms_to_normals(size_t n, double* first, double* second) {
  for (size_t i = 0; i < n; ++i) {
    const internal::NormalPair normal = internal::box_muller(first[i], second[i]);
    first[i] = normal.first;
    second[i] = normal.second;
  }
}

PhiloxKey key_of(uint64_t seed, std::string_view dataset, std::string_view sequence) {
  // Lengths precede the names, so that different triples always have different texts.
  const std::string digest = sha256(fmt::format("sextant noise 1\nseed {}\ndataset {} {}\nsequence {} {}\n",
                                                seed, dataset.size(), dataset, sequence.size(), sequence));
  const auto word = [&digest](size_t at) {
    return static_cast<uint32_t>(std::stoul(digest.substr(at, 8), nullptr, 16));
  };
  return {word(0), word(8)};
}

}  // namespace

Draws::Draws(uint64_t seed, std::string_view dataset, std::string_view sequence)
    : key_(key_of(seed, dataset, sequence)) {}

std::array<double, 2> Draws::uniforms(NoiseChannel channel, int frame, int x, int y) const {
  const PhiloxWords w = philox4x32(key_, counter(channel, frame, x, y));
  return {unit_interval(w[0], w[1]), unit_interval(w[2], w[3])};
}

std::array<double, 2> Draws::normals(NoiseChannel channel, int frame, int x, int y,
                                     Correlation correlation) const {
  const bool shared = correlation == Correlation::shared_per_frame;
  const std::array<double, 2> u =
      uniforms(channel, frame, shared ? whole_frame : x, shared ? whole_frame : y);
  const internal::NormalPair normal = internal::box_muller(u[0], u[1]);
  return {normal.first, normal.second};
}

void Draws::uniforms(NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
                     std::span<double> second) const {
  SEXTANT_CHECK(pixels.y.size() == pixels.size() && first.size() == pixels.size() &&
                second.size() == pixels.size());
  fill_uniforms(key_, static_cast<uint32_t>(pixels.frame), static_cast<uint32_t>(channel), pixels.x.data(),
                pixels.y.data(), pixels.size(), first.data(), second.data());
}

void Draws::normals(NoiseChannel channel, const PixelBatch& pixels, Correlation correlation,
                    std::span<double> first, std::span<double> second) const {
  if (correlation == Correlation::shared_per_frame) {
    SEXTANT_CHECK(first.size() == pixels.size() && second.size() == pixels.size());
    const std::array<double, 2> shared =
        normals(channel, pixels.frame, whole_frame, whole_frame, correlation);
    std::fill(first.begin(), first.end(), shared[0]);
    std::fill(second.begin(), second.end(), shared[1]);
    return;
  }
  // In blocks that fit into the first-level cache between the two passes.
  constexpr size_t block = 512;
  for (size_t begin = 0; begin < pixels.size(); begin += block) {
    const size_t n = std::min(block, pixels.size() - begin);
    uniforms(channel, {pixels.frame, pixels.x.subspan(begin, n), pixels.y.subspan(begin, n)},
             first.subspan(begin, n), second.subspan(begin, n));
    uniforms_to_normals(n, first.data() + begin, second.data() + begin);
  }
}

}  // namespace sextant
