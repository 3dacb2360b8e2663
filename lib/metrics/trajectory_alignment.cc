#include "sextant/metrics/trajectory_alignment.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"

namespace sextant {
namespace {

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

}  // namespace

Eigen::Matrix4d Similarity::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = scale * rotation;
  m.topRightCorner<3, 1>() = translation_m;
  return m;
}

namespace {

/// Means of paired points, their covariance Sigma and the variance of x.
struct PairedMoments {
  Eigen::Vector3d mean_x, mean_y;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double variance_x = 0;
};

PairedMoments moments_of(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y) {
  PairedMoments out;
  const auto n = static_cast<double>(x.size());
  out.mean_x = mean_of(x);
  out.mean_y = mean_of(y);
  for (size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d dx = x[i] - out.mean_x;
    out.covariance += (y[i] - out.mean_y) * dx.transpose();
    out.variance_x += dx.squaredNorm();
  }
  out.covariance /= n;
  out.variance_x /= n;
  return out;
}

}  // namespace

std::optional<UmeyamaResult> umeyama(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y,
                                     bool with_scale) {
  SEXTANT_CHECK(x.size() == y.size());
  if (x.empty()) return std::nullopt;
  const PairedMoments moments = moments_of(x, y);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moments.covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  if (!(d[1] > std::numeric_limits<double>::epsilon())) return std::nullopt;
  Eigen::Vector3d s = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) s[2] = -1;

  UmeyamaResult result;
  Similarity& out = result.y_from_x;
  out.rotation = svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();
  if (with_scale) out.scale = d.dot(s) / moments.variance_x;
  out.translation_m = moments.mean_y - out.scale * (out.rotation * moments.mean_x);
  result.flatness = d[1] / d[0];
  return result;
}

std::optional<double> umeyama_scale(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y) {
  if (const auto found = umeyama(x, y, true)) return found->y_from_x.scale;
  if (x.empty()) return std::nullopt;
  // The points of one set lie on a line: Sigma has one singular value, which is its norm.
  const PairedMoments moments = moments_of(x, y);
  const double norm = moments.covariance.norm();
  if (!(norm > std::numeric_limits<double>::epsilon())) return std::nullopt;
  return norm / moments.variance_x;
}

std::optional<Similarity> rotation_about(const Eigen::Vector3d& axis, std::span<const Eigen::Vector3d> x,
                                         std::span<const Eigen::Vector3d> y) {
  SEXTANT_CHECK(x.size() == y.size());
  if (x.empty()) return std::nullopt;
  const Eigen::Vector3d mean_x = mean_of(x), mean_y = mean_of(y);
  double sine = 0, cosine = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d dx = x[i] - mean_x, dy = y[i] - mean_y;
    sine += axis.dot(dx.cross(dy));
    cosine += dx.dot(dy) - axis.dot(dx) * axis.dot(dy);
  }
  const double extent = std::hypot(sine, cosine) / static_cast<double>(x.size());
  if (!(extent > std::numeric_limits<double>::epsilon())) return std::nullopt;
  Similarity out;
  out.rotation = Eigen::AngleAxisd(std::atan2(sine, cosine), axis).toRotationMatrix();
  out.translation_m = mean_y - out.rotation * mean_x;
  return out;
}

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
        "cannot align {} poses: one of the trajectories stands still or lies on a straight line, which "
        "leaves the rotation undetermined; use --align origin or --align none",
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
        "cannot align {} poses by yaw: one of the trajectories does not move perpendicular to --up, which "
        "leaves the angle undetermined; use --align origin or --align none",
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
        fail(
            "--align origin needs rotations, but one of the trajectories has positions alone; use se3, sim3 "
            "or yaw");
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
      const size_t n = count_to_align(estimate, first_n);
      const auto scale =
          umeyama_scale(std::span(estimate.positions_m).first(n), std::span(reference.positions_m).first(n));
      if (!scale) {
        fail(
            "cannot align {} poses: one of the trajectories stands still, which leaves the scale "
            "undetermined; use --align origin or --align none",
            n);
      }
      result.ref_from_est.scale = *scale;
      for (Eigen::Vector3d& p : estimate.positions_m) p *= *scale;
      for (size_t i = 0; i < estimate.covariances.size(); ++i)
        estimate.transform_covariance(i, Eigen::Matrix3d::Identity(), *scale);
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

namespace {

/// Matches each stamp of `from` with the nearest stamp of `to` + offset, the earlier one of a tie; both lists
/// are ascending.
void match(const std::vector<double>& from, const std::vector<double>& to, double offset_s,
           double max_difference_s, std::vector<int>& from_out, std::vector<int>& to_out) {
  size_t j = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    const auto difference = [&](size_t k) { return std::abs((to[k] + offset_s) - from[i]); };
    while (j + 1 < to.size() && difference(j + 1) < difference(j)) ++j;
    if (!to.empty() && difference(j) <= max_difference_s) {
      from_out.push_back(static_cast<int>(i));
      to_out.push_back(static_cast<int>(j));
    }
  }
}

}  // namespace

Association associate_by_time(const std::vector<double>& reference_s, const std::vector<double>& estimate_s,
                              const AssociationOptions& options) {
  Association found;
  if (estimate_s.size() > reference_s.size()) {
    match(reference_s, estimate_s, options.offset_s, options.max_difference_s, found.reference,
          found.estimate);
  } else {
    match(estimate_s, reference_s, -options.offset_s, options.max_difference_s, found.estimate,
          found.reference);
  }
  return found;
}

Association associate_by_frame(const std::vector<int>& reference, const std::vector<int>& estimate) {
  Association found;
  for (size_t i = 0, j = 0; i < reference.size() && j < estimate.size();) {
    if (reference[i] < estimate[j]) {
      ++i;
    } else if (reference[i] > estimate[j]) {
      ++j;
    } else {
      found.reference.push_back(static_cast<int>(i++));
      found.estimate.push_back(static_cast<int>(j++));
    }
  }
  return found;
}

}  // namespace sextant
