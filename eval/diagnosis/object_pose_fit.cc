#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>
#include <vector>

#include "sextant/base/quantile.h"
#include "sextant/eval/diagnosis/motion_readings.h"

namespace sextant {
namespace {

/// Solves A_i X = X B_i in least squares, first the rotation and then the translation.
SE3 solve_conjugation(const std::vector<std::pair<SE3, SE3>>& pairs) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  constexpr int n_rounds = 20;
  for (int round = 0; round < n_rounds; ++round) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const auto& [A, B] : pairs) {
      const Eigen::Vector3d moved = A * t - t;  // R t_B = A t - t
      sum += moved * B.translation().transpose() + so3_log(A.rotation()) * so3_log(B.rotation()).transpose();
    }
    R = nearest_rotation(sum);
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const auto& [A, B] : pairs) {
      const Eigen::Matrix3d M = A.rotation().toRotationMatrix() - Eigen::Matrix3d::Identity();
      N += M.transpose() * M;
      b += M.transpose() * (R * B.translation() - A.translation());
    }
    // Directions of t that the rotations do not determine stay at 0.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(N);
    t.setZero();
    for (int i = 0; i < 3; ++i) {
      if (solver.eigenvalues()[i] <= 1e-3 * solver.eigenvalues()[2] || !(solver.eigenvalues()[2] > 0))
        continue;
      const Eigen::Vector3d direction = solver.eigenvectors().col(i);
      t += direction * (direction.dot(b) / solver.eigenvalues()[i]);
    }
  }
  return {Eigen::Quaterniond(R), t};
}

/// The motion A in the world and B in the body frame of one step; P = inverse(L_0) L_{k-1}.
struct BodyStep {
  SE3 A, B, P;

  /// Difference of A and B if L0 is the first pose of the object: translation in m, rotation in m at a radius
  /// of 1 m.
  Vector6d error(const SE3& L0) const {
    const SE3 L = L0 * P;
    return step_numbers(B.inverse() * L.inverse() * A * L);
  }
};

/// Minimises the errors of the steps in the body frame by Gauss-Newton with Huber weights, from `L0` on.
/// The body frame avoids the lever arm that a rotation has in the world frame.
SE3 refine_object_pose(const std::vector<BodyStep>& steps, SE3 L0) {
  constexpr int n_rounds = 15;
  constexpr double delta = 1e-6, damping = 1e-6, huber = 1.5, converged = 1e-6;
  for (int round = 0; round < n_rounds; ++round) {
    std::vector<double> sizes;
    for (const BodyStep& step : steps) sizes.push_back(step.error(L0).norm());
    const double scale = std::max(1e-9, huber * upper_median(sizes));
    Matrix6d N = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    for (const BodyStep& step : steps) {
      const Vector6d e = step.error(L0);
      Matrix6d J;
      for (int c = 0; c < 6; ++c)
        J.col(c) = (step.error(L0 * SE3::exp(delta * Vector6d::Unit(c))) - e) / delta;
      const double weight = e.norm() > scale ? scale / e.norm() : 1;
      N += weight * J.transpose() * J;
      b -= weight * J.transpose() * e;
    }
    N.diagonal().array() += damping * N.trace();
    const Vector6d xi = N.ldlt().solve(b);
    if (!xi.allFinite()) break;
    L0 = L0 * SE3::exp(xi);
    if (xi.norm() < converged) break;
  }
  return L0;
}

/// Calls use(first, last) for stretches of eight samples or more of one object in successive frames, of which
/// each `is_known`.
template <typename IsKnown, typename Use>
void for_each_stretch(const std::vector<MotionSample>& samples, const IsKnown& is_known, const Use& use) {
  constexpr size_t fewest_of_stretch = 8;
  for (size_t first = 0; first < samples.size();) {
    const auto follows = [&](size_t i) {
      return samples[i].key == ObjectFrame(samples[i - 1].key.first, samples[i - 1].key.second + 1);
    };
    size_t last = first;
    while (last < samples.size() && is_known(samples[last]) && (last == first || follows(last))) ++last;
    if (last - first >= fewest_of_stretch) use(first, last);
    first = std::max(last, first + 1);
  }
}

SE3 fit_object_pose(const std::vector<BodyStep>& steps) {
  std::vector<std::pair<SE3, SE3>> pairs;
  for (const BodyStep& step : steps) pairs.emplace_back(step.A, step.P * step.B * step.P.inverse());
  return refine_object_pose(steps, solve_conjugation(pairs));
}

}  // namespace

void fit_poses_to_body_reference(MotionData& data, const WorldMotion& in_world) {
  const auto is_known = [&](const MotionSample& sample) { return in_world(sample).has_value(); };
  for_each_stretch(data.samples, is_known, [&](size_t first, size_t last) {
    std::vector<BodyStep> steps;
    SE3 P;
    for (size_t i = first; i < last; ++i) {
      steps.push_back({*in_world(data.samples[i]), data.samples[i].reference, P});
      P = P * data.samples[i].reference;
    }
    const SE3 L0 = fit_object_pose(steps);
    for (size_t i = first; i < last; ++i) data.samples[i].T_world_object = L0 * steps[i - first].P;
  });
}

void fit_poses_to_world_reference(MotionData& data) {
  const auto always = [](const MotionSample&) { return true; };
  for_each_stretch(data.samples, always, [&](size_t first, size_t last) {
    std::vector<BodyStep> steps;
    std::vector<SE3> moved;  // L_{k-1} = moved L_0
    SE3 Q;
    for (size_t i = first; i < last; ++i) {
      const SE3& H = data.samples[i].reference;
      steps.push_back({Q.inverse() * H * Q, data.samples[i].given, SE3()});
      moved.push_back(Q);
      Q = H * Q;
    }
    const SE3 L0 = fit_object_pose(steps);
    for (size_t i = first; i < last; ++i) data.samples[i].T_world_object = moved[i - first] * L0;
  });
}

}  // namespace sextant
