#pragma once

// Random numbers of the noise models. A draw is a pure function of
//
//   (seed, dataset, sequence)      the key: the first 64 bits of the SHA-256 of their canonical text
//   (frame, channel, pixel x, y)   the counter of Philox 4x32-10
//
// so it does not depend on threads, order or shards, nor on which other pixels are requested, and all
// estimators get the same noise. Each draw gives two numbers; a channel that needs only one uses the first.
//
// Normals: Box-Muller on uniforms of 53 bits in (0, 1], so |n| <= sqrt(106 ln 2) = 8.57. The bits do not
// depend on the machine, nor on whether a single pixel or a batch is requested.

#include <array>
#include <bit>
#include <cstdint>
#include <numbers>
#include <span>
#include <string_view>

#include "sextant/base/json.h"
#include "sextant/base/names.h"
#include "sextant/base/philox.h"
#include "sextant/base/simd.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Purpose of a draw. The values are part of the Philox counter: never renumber them.
enum class NoiseChannel : uint32_t {
  depth = 0,
  flow = 1,                     ///< first: x axis, second: y axis
  outlier = 2,                  ///< first: decides whether the flow is an outlier
  outlier_offset = 3,           ///< offset of the outlier
  backward_flow = 4,            ///< flow to the previous frame
  backward_outlier = 5,         ///< as `outlier`
  backward_outlier_offset = 6,  ///< as `outlier_offset`
};

/// Relation between the normals of the pixels of one frame and channel.
enum class Correlation {
  independent,       ///< one draw per pixel
  shared_per_frame,  ///< one draw for all pixels, as in the paper's published code
};

constexpr Names<2> names_of(Correlation) { return {"independent", "shared_per_frame"}; }

/// Pixels of one frame: columns x and rows y, arrays of equal length.
struct PixelBatch {
  int frame = 0;
  std::span<const int> x;
  std::span<const int> y;
  size_t size() const { return x.size(); }
};

class Draws {
 public:
  Draws(uint64_t seed, std::string_view dataset, std::string_view sequence);

  /// Returns two uniform numbers in (0, 1].
  std::array<double, 2> uniforms(NoiseChannel channel, int frame, int x, int y) const;
  /// Returns two independent standard normals.
  std::array<double, 2> normals(NoiseChannel channel, int frame, int x, int y,
                                Correlation correlation = Correlation::independent) const;

  /// Overload for many pixels; `first` and `second` have the length of `pixels`.
  void uniforms(NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
                std::span<double> second) const;
  void normals(NoiseChannel channel, const PixelBatch& pixels, Correlation correlation,
               std::span<double> first, std::span<double> second) const;

  PhiloxKey key() const { return key_; }

 private:
  PhiloxKey key_;
};

namespace internal {

// Box-Muller transform (1958): two uniform numbers in (0, 1] to two independent standard normals,
//
//   n1 = sqrt(-2 ln u1) cos(2 pi u2),   n2 = sqrt(-2 ln u1) sin(2 pi u2)
//
// Logarithm, sine and cosine are evaluated here with + - * / and sqrt only, instead of by the math library:
// the bits are equal on every machine (libraries select code by processor), and loops over arrays vectorise.
// Errors are a few units in the last place (draws_test.cc).

/// Returns ln x of a positive normal number: x = 2^k m with m in [sqrt(1/2), sqrt(2)), ln m = 2
/// artanh((m-1)/(m+1)).
SEXTANT_INLINED double natural_log(double x) {
  constexpr uint64_t one = 0x3ff0000000000000U;
  constexpr uint64_t sqrt_half = 0x3fe6a09e667f3bcdU;
  const uint64_t shifted = std::bit_cast<uint64_t>(x) + (one - sqrt_half);
  const auto m = std::bit_cast<double>((shifted & 0x000fffffffffffffU) + sqrt_half);
  // The exponent as a double, through the bits of 2^52 + exponent.
  const double k = std::bit_cast<double>((shifted >> 52) | 0x4330000000000000U) - (0x1p52 + 1023);
  const double f = m - 1;
  const double s = f / (2 + f);
  const double z = s * s;
  // artanh(s)/s - 1 by its power series; |s| < 0.1716, the next term is below 1e-18.
  double p = 1.0 / 23;
  p = p * z + 1.0 / 21;
  p = p * z + 1.0 / 19;
  p = p * z + 1.0 / 17;
  p = p * z + 1.0 / 15;
  p = p * z + 1.0 / 13;
  p = p * z + 1.0 / 11;
  p = p * z + 1.0 / 9;
  p = p * z + 1.0 / 7;
  p = p * z + 1.0 / 5;
  p = p * z + 1.0 / 3;
  return k * std::numbers::ln2 + (2 * s + 2 * s * (z * p));
}

struct SineCosine {
  double sine = 0;
  double cosine = 0;
};

/// Returns sin and cos of 2 pi u, u in [0, 1]: exact reduction to an eighth of a turn, then power series.
SEXTANT_INLINED SineCosine sine_cosine_turns(double u) {
  constexpr double round = 0x1.8p52;  // adding it rounds to an integer, stored in the lowest bits
  const double rounded = 4 * u + round;
  const auto quarter = std::bit_cast<uint64_t>(rounded);
  const double x = (u - (rounded - round) * 0.25) * (2 * std::numbers::pi);  // |x| <= pi / 4
  const double z = x * x;
  double s = 1.0 / 355687428096000.0;  // 1 / 17!
  s = s * z - 1.0 / 1307674368000.0;
  s = s * z + 1.0 / 6227020800.0;
  s = s * z - 1.0 / 39916800.0;
  s = s * z + 1.0 / 362880.0;
  s = s * z - 1.0 / 5040.0;
  s = s * z + 1.0 / 120.0;
  s = s * z - 1.0 / 6.0;
  s = x + x * (z * s);
  double c = -1.0 / 6402373705728000.0;  // 1 / 18!
  c = c * z + 1.0 / 20922789888000.0;
  c = c * z - 1.0 / 87178291200.0;
  c = c * z + 1.0 / 479001600.0;
  c = c * z - 1.0 / 3628800.0;
  c = c * z + 1.0 / 40320.0;
  c = c * z - 1.0 / 720.0;
  c = c * z + 1.0 / 24.0;
  c = 1 + (z * (z * c) - 0.5 * z);
  // A quarter turn swaps sine and cosine; the quadrant determines the sign bits. Written with bit operations
  // to avoid branches.
  const uint64_t swap = 0 - (quarter & 1U);
  const auto s_bits = std::bit_cast<uint64_t>(s);
  const auto c_bits = std::bit_cast<uint64_t>(c);
  const uint64_t sine = (s_bits & ~swap) | (c_bits & swap);
  const uint64_t cosine = (c_bits & ~swap) | (s_bits & swap);
  return {std::bit_cast<double>(sine ^ ((quarter & 2U) << 62)),
          std::bit_cast<double>(cosine ^ (((quarter + 1) & 2U) << 62))};
}

struct NormalPair {
  double first = 0;
  double second = 0;
};

SEXTANT_INLINED NormalPair box_muller(double u1, double u2) {
  const double radius = __builtin_sqrt(-2 * natural_log(u1));
  const SineCosine angle = sine_cosine_turns(u2);
  return {radius * angle.cosine, radius * angle.sine};
}

}  // namespace internal

// ---- Relation between the normals of the pixels of one frame and channel: independent, one draw for all
// pixels, or a stationary Gaussian field with a given correlation (problem.h):
//
//   "independent"   "shared_per_frame"   {"model": "spatial", "lengths_px": [5, 40], "shares": [0.4, 0.5]}
//
// A field is the sum of one component per length and of an independent rest. A component of length L is white
// noise on the nodes of a lattice, with one draw per node, smoothed by a Gaussian kernel:
//
//   n(p) = sum_q w(p - q) n_q / sqrt(sum_q w(p - q)^2),   w(d) = exp(-|d|^2 / L^2).
//
// It has exactly unit variance at every pixel and correlation exp(-r^2 / (2 L^2)); with this dense sampling
// (spacing floor(L / 1.5) px, at least 1 px), sum_q w(p - q) w(p' - q) varies with the phase of the lattice
// by less than 1e-4. The kernel is separable and truncated at 2.5 L. A draw therefore remains a pure function
// of (seed, dataset, sequence, frame, channel, pixel), and needs few nodes.

class NoiseCorrelation {
 public:
  NoiseCorrelation(Correlation of_pixels = Correlation::independent) : of_pixels_(of_pixels) {}
  /// Throws Error unless there are 1 to 100 components, every length is in 1..1000 px, every share is
  /// positive, and the shares add up to at most 1.
  explicit NoiseCorrelation(const SpatialCorrelation& spatial);
  /// Reads a name or an object as above. Throws Error that begins with `where`.
  static NoiseCorrelation read(const Json& json, const std::string& where);

  Json json() const;
  /// Returns a text for records: "" for independent, " (shared per frame)", " (spatial 5, 40 px)".
  std::string name() const;
  bool independent() const { return of_pixels_ == Correlation::independent && fields_.empty(); }
  const SpatialCorrelation& spatial() const { return spatial_; }

  /// Computes two independent standard normals for every pixel; `first` and `second` have the length of
  /// `pixels`.
  void normals(const Draws& draws, NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
               std::span<double> second) const;

 private:
  /// One component: values of the kernel at the nodes around a pixel, for each position of the pixel between
  /// two nodes.
  struct Field {
    int spacing_px;
    int reach;                    ///< number of nodes on either side of a pixel
    std::vector<double> weights;  ///< 2 reach for each of `spacing_px` positions; their squares add up to 1
    double amplitude;             ///< sqrt(share)
    explicit Field(const SpatialCorrelation::Part& part);
    void add(const Draws& draws, NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
             std::span<double> second) const;
  };

  Correlation of_pixels_ = Correlation::independent;
  SpatialCorrelation spatial_;
  std::vector<Field> fields_;
};

}  // namespace sextant
