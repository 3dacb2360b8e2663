#pragma once

// The similarity y = s R x + t nearest to pairs of points in the sense of least squares:
//
//   Sigma = 1/n sum (y_i - y_mean)(x_i - x_mean)' = U D V',  S = diag(1, 1, det(U) det(V))
//   R = U S V',  s = trace(D S) / var(x),  t = y_mean - s R x_mean
//
// and the same with s = 1 and a rotation about one known axis u alone,
// for two paths that both know where up is:
//
//   R = rotation about u by atan2(u . sum dx x dy, sum dx . dy - (u . dx)(u . dy))
//
// Source: S. Umeyama, Least-squares estimation of transformation parameters between two point patterns,
// IEEE PAMI 13(4), 1991, eq. 34-43.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

struct Similarity {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();
  double scale = 1;

  /// [s R | t; 0 0 0 1]
  Eigen::Matrix4d matrix() const;
};

struct UmeyamaResult {
  Similarity y_from_x;
  /// Second over first singular value of Sigma; near 0 the points lie on a line, and the rotation about that
  /// line is arbitrary.
  double flatness = 0;
};

/// Empty when the points do not determine a rotation: fewer than two singular values of Sigma above 2.2e-16
/// m^2 (one of the sets stands still, or both lie on an axis). With `with_scale` off s = 1.
std::optional<UmeyamaResult> umeyama(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y,
                                     bool with_scale);

/// About the unit vector `axis`. Empty when the points do not determine the angle: one of the sets has no
/// extent across the axis (below 2.2e-16 m^2).
std::optional<Similarity> rotation_about(const Eigen::Vector3d& axis, std::span<const Eigen::Vector3d> x,
                                         std::span<const Eigen::Vector3d> y);

// Moves an estimated path onto the reference before absolute errors are taken.
//
//   none     as it is
//   origin   p <- T p with T = T_ref,0 inverse(T_est,0): the first poses agree
//   se3      p <- R p + t of Umeyama's similarity with s = 1
//   sim3     positions <- s positions, then R, t, of the similarity with scale
//   scale    positions <- s positions alone, s as in sim3
//   yaw      p <- R p + t nearest in the sense of least squares with R a rotation about `up` alone:
//            for systems that know gravity, whose roll and pitch are part of what they claim
//
// se3, sim3, scale and yaw look at the positions of the first `first_n` poses (0: all).
// As evo defines them (yaw: ours).

enum class Alignment { none, origin, se3, sim3, scale, yaw };
constexpr Names<6> names_of(Alignment) { return {"none", "origin", "se3", "sim3", "scale", "yaw"}; }

struct AlignmentResult {
  Similarity ref_from_est;  ///< what was applied: scale first, then rotation and translation
  double flatness = 1;      ///< UmeyamaResult::flatness, where Umeyama was used
};

/// Both of one length, >= 1. `up`: unit vector of both worlds, for yaw alone. Throws Error where the
/// positions determine no rotation.
AlignmentResult align(PoseSeries& estimate, const PoseSeries& reference, Alignment alignment, int first_n = 0,
                      const Eigen::Vector3d& up = Eigen::Vector3d::Zero());

// Which poses of two recordings belong together.
//
//   by time    each stamp of the shorter recording (of two as long, the estimate's) takes the nearest stamp
//              of the other, the earlier of two as near, when they differ by at most max_difference_s.
//              The offset is added to the stamps of the estimate.
//              A pose of the longer recording may be taken twice.
//   by frame   frame numbers that both have
//   by row     row i with row i; as many rows in both
//
// Association by time gives evo's pairs (evo.core.sync, version 1.3x).

struct AssociationOptions {
  double max_difference_s = 0.01;
  double offset_s = 0;                   ///< added to the estimate's stamps
  std::optional<double> start_s, end_s;  ///< of the reference's stamps, inclusive
};

/// Index pairs, ascending in both.
struct Association {
  std::vector<int> reference;
  std::vector<int> estimate;
};

/// Stamps ascending. With an empty result nothing matches.
Association associate_by_time(const std::vector<double>& reference_s, const std::vector<double>& estimate_s,
                              const AssociationOptions& options);
/// Frame numbers strictly ascending.
Association associate_by_frame(const std::vector<int>& reference, const std::vector<int>& estimate);

}  // namespace sextant
