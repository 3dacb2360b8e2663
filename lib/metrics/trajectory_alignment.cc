#include "sextant/metrics/trajectory_alignment.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant {
namespace {

size_t count_to_align(const PoseSeries& estimate, int first_n) {
  return first_n > 0 ? std::min(static_cast<size_t>(first_n), estimate.size()) : estimate.size();
}

UmeyamaResult umeyama_alignment(const PoseSeries& estimate, const PoseSeries& reference, bool with_scale,
                                int first_n) {
  const size_t n = count_to_align(estimate, first_n);
  const auto result = umeyama(std::span(estimate.positions_m).first(n),
                              std::span(reference.positions_m).first(n), with_scale);
  if (!result) {
    fail(
        "cannot align {} poses: one of the trajectories stands still or both lie on a straight axis, which leaves the rotation open; use --align origin or --align none",
        n);
  }
  return *result;
}

Similarity yaw_alignment(const PoseSeries& estimate, const PoseSeries& reference, int first_n,
                         const Eigen::Vector3d& up) {
  const size_t n = count_to_align(estimate, first_n);
  const auto result =
      rotation_about(up, std::span(estimate.positions_m).first(n), std::span(reference.positions_m).first(n));
  if (!result) {
    fail(
        "cannot align {} poses by yaw: one of the trajectories does not move across --up, which leaves the angle open; use --align origin or --align none",
        n);
  }
  return *result;
}

}  // namespace

AlignmentResult align(PoseSeries& estimate, const PoseSeries& reference, Alignment alignment, int first_n,
                      const Eigen::Vector3d& up) {
  SEXTANT_CHECK(!estimate.empty() && estimate.size() == reference.size());
  AlignmentResult result;
  switch (alignment) {
    case Alignment::none:
      return result;
    case Alignment::origin:
      if (!estimate.has_rotations() || !reference.has_rotations())
        fail("--align origin needs rotations, but a side has positions alone; use se3, sim3 or yaw");
      result.ref_from_est.rotation = reference.rotations[0] * estimate.rotations[0].transpose();
      result.ref_from_est.translation_m =
          reference.positions_m[0] - result.ref_from_est.rotation * estimate.positions_m[0];
      break;
    case Alignment::se3:
    case Alignment::sim3: {
      const UmeyamaResult u = umeyama_alignment(estimate, reference, alignment == Alignment::sim3, first_n);
      result = {u.y_from_x, u.flatness};
      break;
    }
    case Alignment::scale: {
      const UmeyamaResult u = umeyama_alignment(estimate, reference, true, first_n);
      result.ref_from_est.scale = u.y_from_x.scale;
      result.flatness = u.flatness;
      for (Eigen::Vector3d& p : estimate.positions_m) p *= u.y_from_x.scale;
      for (size_t i = 0; i < estimate.covariances.size(); ++i)
        estimate.transform_covariance(i, Eigen::Matrix3d::Identity(), u.y_from_x.scale);
      return result;
    }
    case Alignment::yaw:
      SEXTANT_CHECK(std::abs(up.norm() - 1) < 1e-9);
      result.ref_from_est = yaw_alignment(estimate, reference, first_n, up);
      break;
  }
  const Similarity& s = result.ref_from_est;
  for (Eigen::Vector3d& p : estimate.positions_m) p = s.rotation * (s.scale * p) + s.translation_m;
  for (Eigen::Matrix3d& r : estimate.rotations) r = s.rotation * r;
  for (size_t i = 0; i < estimate.covariances.size(); ++i)
    estimate.transform_covariance(i, s.rotation, s.scale);
  return result;
}

}  // namespace sextant
