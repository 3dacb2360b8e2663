#pragma once

// Verification of the applied noise: the statistics of the actual errors (corrupted minus clean values) next
// to the requested ones. Accumulators are merged in the fixed order of frame pairs, which gives the same bits
// for any number of threads.
//
//   depth       (z' - z) / sigma(z) over the depths that stay valid: mean 0, sigma 1. A large share of
//               invalidated depths truncates the lower tail and biases both; quantisation adds its own error.
//   flow        phi' - phi per body and axis over the pixels that are not outliers: mean, sigma, mean |.|
//               (EPE of one axis), and the 2-D EPE
//   neighbours  correlation sum(a b) / sqrt(sum(a^2) sum(b^2)) of the draws of every 4th pixel and its right
//               neighbour (the expectation of a draw is 0): about 0 for independent, exactly 1 for
//               shared_per_frame, about rho(1 px) for a spatial correlation

#include <cstdint>
#include <map>
#include <optional>

#include "sextant/base/options.h"
#include "sextant/noise/noise_model.h"

namespace sextant {

/// Moments of one quantity.
struct MomentSums {
  SEXTANT_OPTIONS((uint64_t, n, 0, "count", "numbers"), (double, sum, 0, "", "sum of the values"),
                  (double, sum_squares, 0, "", "sum of their squares"),
                  (double, sum_abs, 0, "", "sum of their magnitudes"))
  void add(double value);
  void merge(const MomentSums& other);
  std::optional<double> mean() const;
  std::optional<double> mean_abs() const;
  /// Returns the standard deviation (denominator n - 1); nullopt for n < 2.
  std::optional<double> sigma() const;
};

/// Moments of pairs of standard normals.
struct NeighbourSums {
  SEXTANT_OPTIONS((uint64_t, n, 0, "count", "pairs"), (double, ab, 0, "", "sum of products"),
                  (double, aa, 0, "", "sum of squares of the first"),
                  (double, bb, 0, "", "sum of squares of the second"))
  void add(double a, double b);
  void merge(const NeighbourSums& other);
  std::optional<double> correlation() const;
};

struct DepthVerification {
  SEXTANT_OPTIONS((MomentSums, normalised, {}, "", "error divided by its standard deviation"),
                  (uint64_t, n_valid, 0, "count", "valid before the noise was applied"),
                  (uint64_t, n_invalidated, 0, "count", "of those, invalid afterwards"))
  std::optional<double> share_invalidated() const;  ///< nullopt without valid depths
};

struct FlowVerification {
  FlowSigma requested;
  MomentSums x;
  MomentSums y;
  double sum_epe = 0;
  uint64_t n_outliers = 0;
  template <typename V>
  void visit(V& v) {
    v("requested_x_px", requested.x_px, "px", "requested standard deviation");
    v("requested_y_px", requested.y_px, "px", "requested standard deviation");
    v("x", x, "px", "horizontal error");
    v("y", y, "px", "vertical error");
    v("sum_epe", sum_epe, "px", "sum of the lengths");
    v("n_outliers", n_outliers, "count", "outliers, left out of the sums");
  }
  uint64_t n() const { return x.n + n_outliers; }
  std::optional<double> epe_px() const;
  std::optional<double> outlier_share() const;
};

/// Returns the mean length of a Gaussian vector with these sigmas:
/// sqrt(2/pi) sigma_max E(1 - (sigma_min/sigma_max)^2), with E(m) the complete elliptic integral of the
/// second kind of parameter m; sqrt(pi/2) sigma for equal sigmas.
double expected_epe_px(const FlowSigma& sigma);

class NoiseVerification {
 public:
  DepthVerification depth;
  std::map<int, FlowVerification> flow;  ///< by body: instance id, 0 = background
  NeighbourSums depth_neighbours;
  NeighbourSums flow_neighbours;  ///< on the x axis

  /// Adds the sums of a later part. Parts must be merged in a fixed order, so that the result has the same
  /// bits in every run.
  void merge(const NoiseVerification& later);
  /// Returns the requested noise (`requested`, and the sigmas derived from the options) and the achieved
  /// statistics; statistics without enough values are left out.
  Json json(const Json& requested) const;
  /// sums() converts all sums to JSON, and from_sums() restores them bit for bit. from_sums() throws Error
  /// that begins with `where`.
  Json sums() const;
  static NoiseVerification from_sums(const Json& json, const std::string& where);
};

}  // namespace sextant
