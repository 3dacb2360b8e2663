#pragma once

// Covariance of a motion from measurements with errors that are correlated over the image (docs/method.md).
//
// To first order the error of the optimum is A^-1 sum_i s_i, s_i = sum_c G_ic^T n_c(p_i). A is the curvature
// of the cost, n_c the error of channel c (flow u, flow v, previous and current disparity) at the pixel, in
// standard deviations, and G_ic the (weighted) derivative of the residual with respect to the motion after
// the depth of the point has been eliminated. If the errors of a channel are correlated with
// rho(|p - p'|) = sum_k share_k exp(-r^2 / (2 L_k^2)), the sum has the covariance
//
//   M = sum_c sum_ij rho(|p_i - p_j|) G_ic^T G_jc,     cov = A^-1 M A^-1.
//
// (Conley 1999, with modelled instead of observed products of scores, since observed products at the fitted
// motion are biased low). All errors of a channel have the same variance; M is stored by channel and
// multiplied by the variances at the end. If the points extend over at most 20 cells of side 0.65 L_k, the
// sum is evaluated over all pairs of cell corners, with a separable kernel: first along rows, then along
// columns. Otherwise sums over pairs become sums over the nodes of a lattice, as in noise/draws.h:
// M_k = sum_q V_q^T V_q, V_q = sum_i w_q(p_i) G_i, where w are quadratic B-splines of spacing 1.375 L_k with
// unit norm and the integral of the Gaussian. This costs a few operations per point, in single precision, and
// M is positive semi-definite to rounding for any set of points.
//
// The disparities of a stereo matcher or network may have a common offset, which is correlated over any
// distance. It is estimated as one additional unknown; the excess of its square over the variance of the
// estimate is added to the covariance as a common-mode error.

#include <algorithm>
#include <limits>
#include <vector>

#include "sextant/geometry/lanes.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Score of one point. Lanes: the four channels; 0 if the point has no such measurement.
struct alignas(lane_bytes) ErrorScore {
  static constexpr int n_unknowns = 7;  ///< left twist (m, rad); common offset of the disparities (px)
  double u = 0, v = 0;                  ///< previous pixel
  Lanes derivative[n_unknowns] = {};    ///< derivatives of the residuals
  Lanes by_depth = {};  ///< derivative with respect to the point's own depth, normalised; 0: no depth
  Lanes measured = {};  ///< 1 for each measured channel
  Lanes residual = {};

  /// Eliminates the depth from derivatives and residual.
  SEXTANT_INLINED void eliminate_depth() {
    for (Lanes& row : derivative) eliminate_depth(row);
    eliminate_depth(residual);
  }

 private:
  SEXTANT_INLINED void eliminate_depth(Lanes& row) const {
    const Lanes products = by_depth * row;
    row -= by_depth * sum_of_lanes(&products);
  }
};

using ScoreMatrix = Eigen::Matrix<double, ErrorScore::n_unknowns, ErrorScore::n_unknowns>;
using ScoreVector = Eigen::Matrix<double, ErrorScore::n_unknowns, 1>;

/// M by channel, for errors of variance 1: upper triangle, row by row.
struct ChannelScores {
  static constexpr int size = ErrorScore::n_unknowns * (ErrorScore::n_unknowns + 1) / 2;
  double values[size * n_lanes] = {};

  void add(double share, const ChannelScores& other);
  /// Returns M for errors with these variances.
  ScoreMatrix times(const Lanes& variances) const;
};

/// Returns M for errors with this correlation.
ChannelScores correlated_scores(const std::vector<ErrorScore>& points,
                                const std::vector<SpatialCorrelation::Part>& parts);
/// Returns M for errors that are independent between points.
ChannelScores independent_scores(const std::vector<ErrorScore>& points);

// The smallest axis-parallel rectangle around points, px. Points: a range of elements with members u and v.

struct PixelExtent {
  double min_u = std::numeric_limits<double>::infinity(), min_v = min_u;
  double max_u = -min_u, max_v = -min_u;

  PixelExtent() = default;
  template <typename Points>
  explicit PixelExtent(const Points& points) {
    for (const auto& p : points) add(p.u, p.v);
  }
  void add(double u, double v) {
    min_u = std::min(min_u, u), max_u = std::max(max_u, u);
    min_v = std::min(min_v, v), max_v = std::max(max_v, v);
  }
  double width() const { return max_u - min_u; }
  double height() const { return max_v - min_v; }
  /// Returns false for an empty set, and if the points are too far apart to lie in one image.
  bool is_of_an_image() const {
    constexpr double widest_image = 1e6;
    return min_u <= max_u && std::max(width(), height()) < widest_image;
  }
};

}  // namespace sextant
