#pragma once

// Least-squares similarity y = s R x + t between paired points:
//
//   Sigma = 1/n sum (y_i - y_mean)(x_i - x_mean)' = U D V',  S = diag(1, 1, det(U) det(V))
//   R = U S V',  s = trace(D S) / var(x),  t = y_mean - s R x_mean
//
// For two trajectories whose vertical direction is known, s = 1 and R is a rotation about the known unit axis
// u:
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

  /// Returns [s R | t; 0 0 0 1].
  Eigen::Matrix4d matrix() const;
};

struct UmeyamaResult {
  Similarity y_from_x;
  /// Ratio of the second to the first singular value of Sigma. Near 0 the points lie on a line, and the
  /// rotation about this line is arbitrary.
  double flatness = 0;
};

/// Returns the least-squares similarity y_from_x; s = 1 unless `with_scale`. nullopt if the points do not
/// determine a rotation: fewer than two singular values of Sigma exceed 2.2e-16 m^2, for example because one
/// set stands still or lies on a line.
std::optional<UmeyamaResult> umeyama(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y,
                                     bool with_scale);

/// Returns the scale s of the same similarity. Points on a line determine it although they leave the rotation
/// about the line undetermined; nullopt if no singular value of Sigma exceeds 2.2e-16 m^2, because one set
/// stands still.
std::optional<double> umeyama_scale(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y);

/// Returns the least-squares rotation about the unit vector `axis`, and translation. nullopt if the points do
/// not determine the angle: the two arguments of atan2, divided by n, have a norm of at most 2.2e-16 m^2, for
/// example because one set has no extent across the axis.
std::optional<Similarity> rotation_about(const Eigen::Vector3d& axis, std::span<const Eigen::Vector3d> x,
                                         std::span<const Eigen::Vector3d> y);

// Alignment of an estimated trajectory with the reference before absolute errors are computed.
//
//   none     unchanged
//   origin   p <- T p with T = T_ref,0 inverse(T_est,0): the first poses agree
//   se3      p <- R p + t of Umeyama's similarity with s = 1
//   sim3     positions <- s positions, then R, t, of the similarity with scale
//   scale    positions <- s positions only, s as in sim3
//   yaw      p <- R p + t by least squares with R a rotation about `up` only: for systems that observe
//            gravity, whose roll and pitch are part of the estimate
//
// se3, sim3, scale and yaw use the positions of the first `first_n` poses (0: all). The definitions are
// evo's, except for yaw.

enum class Alignment { none, origin, se3, sim3, scale, yaw };
constexpr Names<6> names_of(Alignment) { return {"none", "origin", "se3", "sim3", "scale", "yaw"}; }

struct AlignmentResult {
  Similarity ref_from_est;  ///< the transformation applied: first scale, then rotation and translation
  double flatness = 1;      ///< UmeyamaResult::flatness; 1 if Umeyama's rotation was not used
};

/// Aligns `estimate` in place. Both series have the same length >= 1; `up` is the vertical unit vector of
/// both worlds and is used by yaw only. Throws Error if the positions do not determine the rotation (se3,
/// sim3, yaw) or the scale (scale), or if one side has no rotations (origin).
AlignmentResult align(PoseSeries& estimate, const PoseSeries& reference, Alignment alignment, int first_n = 0,
                      const Eigen::Vector3d& up = Eigen::Vector3d::Zero());

// Association of the poses of two recordings.
//
//   by time    each stamp of the shorter recording (of the estimate if equally long) is matched with the
//              nearest stamp of the other one, if they differ by at most max_difference_s; the earlier stamp
//              wins a tie. The offset is added to the stamps of the estimate. A pose of the longer recording
//              may be matched twice.
//   by frame   frame numbers that both have
//   by row     row i with row i; both have the same number of rows
//
// Association by time gives evo's pairs (evo.core.sync, version 1.3x).

struct AssociationOptions {
  double max_difference_s = 0.01;
  double offset_s = 0;                   ///< added to the stamps of the estimate
  std::optional<double> start_s, end_s;  ///< range of the reference's stamps, inclusive
};

/// Pairs of indices, ascending in both lists.
struct Association {
  std::vector<int> reference;
  std::vector<int> estimate;
};

/// Returns the matches by time. Stamps must be ascending. The result is empty if no stamps match; start_s and
/// end_s are not used here, since the caller selects the range.
Association associate_by_time(const std::vector<double>& reference_s, const std::vector<double>& estimate_s,
                              const AssociationOptions& options);
/// Returns the matches by frame number. Both lists must be strictly ascending.
Association associate_by_frame(const std::vector<int>& reference, const std::vector<int>& estimate);

}  // namespace sextant
