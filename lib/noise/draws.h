#pragma once

// Random numbers of the noise models. A draw is a pure function of
//
//   (seed, dataset, sequence)      the key: the first 64 bits of the SHA-256 of their canonical text
//   (frame, channel, pixel x, y)   the counter of Philox 4x32-10
//
// so it depends neither on threads, order or shards, nor on which other pixels are asked for; all estimators
// see the same noise. Each call gives two numbers; a channel that needs one uses the first.
//
// Normals: Box-Muller on uniforms of 53 bits in (0, 1], so |n| <= sqrt(106 ln 2) = 8.57. The bits do not
// depend on the machine, nor on whether one pixel or a batch is asked for.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "sextant/base/names.h"
#include "sextant/base/philox.h"

namespace sextant {

/// What is drawn. The numbers enter the counter: never renumber.
enum class NoiseChannel : uint32_t {
  depth = 0,
  flow = 1,                     ///< first: x axis, second: y axis
  outlier = 2,                  ///< first: is it one?
  outlier_offset = 3,           ///< where to
  backward_flow = 4,            ///< to the previous frame
  backward_outlier = 5,         ///< as above
  backward_outlier_offset = 6,  ///< as above
};

/// How the normals of the pixels of one frame and channel relate.
enum class Correlation {
  independent,       ///< one draw a pixel
  shared_per_frame,  ///< one draw for all pixels: what the published code of the paper does
};

constexpr Names<2> names_of(Correlation) { return {"independent", "shared_per_frame"}; }

/// Pixels of one frame: column x and row y, arrays of one length.
struct PixelBatch {
  int frame = 0;
  std::span<const int> x;
  std::span<const int> y;
  size_t size() const { return x.size(); }
};

class Draws {
 public:
  Draws(uint64_t seed, std::string_view dataset, std::string_view sequence);

  /// Two numbers in (0, 1].
  std::array<double, 2> uniforms(NoiseChannel channel, int frame, int x, int y) const;
  /// Two independent standard normals.
  std::array<double, 2> normals(NoiseChannel channel, int frame, int x, int y,
                                Correlation correlation = Correlation::independent) const;

  /// The same for many pixels at once; `first` and `second` have the length of `pixels`.
  void uniforms(NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
                std::span<double> second) const;
  void normals(NoiseChannel channel, const PixelBatch& pixels, Correlation correlation,
               std::span<double> first, std::span<double> second) const;

  PhiloxKey key() const { return key_; }

 private:
  PhiloxKey key_;
};

}  // namespace sextant
