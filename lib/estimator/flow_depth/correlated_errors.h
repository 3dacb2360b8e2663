#pragma once

// Covariance of a motion whose measurements' errors are correlated over the image (docs/method.md).
//
// To first order the optimum errs by A^-1 sum_i s_i, s_i = sum_c G_ic^T n_c(p_i): n_c is the error of channel
// c (flow u, flow v, previous and current disparity) at the pixel, in its standard deviations, and G_ic what
// is left of its effect on the motion when the depth of the point has been eliminated. Where errors of a
// channel correlate by rho(|p - p'|) = sum_k share_k exp(-r^2 / (2 L_k^2)), the sum has the covariance
//
//   M = sum_c sum_ij rho(|p_i - p_j|) G_ic^T G_jc,     cov = A^-1 M A^-1.
//
// (Conley 1999, with modelled instead of observed products of scores: those of a body that the errors have
// bent the motion to are too small.) Errors of a channel have one variance, M is kept by channel and scaled
// at the end. Where the points fill few cells of 0.65 L_k, the sum is over all pairs of their corners, whose
// kernel is a product: first along rows, then along columns. Else sums over pairs are sums over the nodes of
// a lattice, as in noise_correlation.h: M_k = sum_q V_q^T V_q, V_q = sum_i w_q(p_i) G_i, w: quadratic
// B-splines of spacing 1.375 L_k, of unit norm everywhere, which has the Gaussian's integral. So it costs a
// few operations a point, in float, and M is positive semi-definite to rounding whatever the points.
//
// The disparities of a stereo matcher or network may be wrong by a common offset, which is correlated over
// any distance. Its estimate is one more unknown beside the motion; what its square has beyond its own
// variance is added to the covariance as that of a common error.

#include <algorithm>
#include <limits>
#include <vector>

#include "sextant/geometry/lanes.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// One point as the covariance sees it. Lanes: the four channels; 0 where the point has no such measurement.
struct alignas(lane_bytes) ErrorScore {
  static constexpr int n_unknowns = 7;  ///< left twist (m, rad); common offset of the disparities (px)
  double u = 0, v = 0;                  ///< previous pixel
  Lanes derivative[n_unknowns] = {};    ///< of the residuals
  Lanes by_depth = {};                  ///< derivative by the point's own depth, of unit length; 0: has none
  Lanes measured = {};                  ///< 1 for each channel there is
  Lanes residual = {};

  /// Takes the depth out of derivatives and residual.
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

/// M by channel, of errors of variance 1: upper triangle, row by row.
struct ChannelScores {
  static constexpr int size = ErrorScore::n_unknowns * (ErrorScore::n_unknowns + 1) / 2;
  double values[size * n_lanes] = {};

  void add(double share, const ChannelScores& other);
  /// M of errors with these variances.
  ScoreMatrix times(const Lanes& variances) const;
};

/// Of errors that are correlated as the parts say.
ChannelScores correlated_scores(const std::vector<ErrorScore>& points,
                                const std::vector<SpatialCorrelation::Part>& parts);
/// Of independent errors.
ChannelScores independent_scores(const std::vector<ErrorScore>& points);

// The smallest upright rectangle around points, px. Points: anything with numbers u and v.

struct PixelExtent {
  double min_u = std::numeric_limits<double>::infinity(), min_v = min_u;
  double max_u = -min_u, max_v = -min_u;

  template <typename Points>
  explicit PixelExtent(const Points& points) {
    for (const auto& p : points) {
      min_u = std::min(min_u, p.u), max_u = std::max(max_u, p.u);
      min_v = std::min(min_v, p.v), max_v = std::max(max_v, p.v);
    }
  }
  double width() const { return max_u - min_u; }
  double height() const { return max_v - min_v; }
  /// False for no points, and where they are so far apart that nothing is near anything.
  bool is_of_an_image() const {
    constexpr double widest_image = 1e6;
    return min_u <= max_u && std::max(width(), height()) < widest_image;
  }
};

}  // namespace sextant
