#include "sextant/eval/evaluation/body_offset.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "sextant/base/error.h"

namespace sextant {

namespace {

constexpr size_t fewest_poses = 10;
/// Components with less than this share of the largest information are not determined.
constexpr double least_information = 0.03;

/// Returns the inverse of a symmetric matrix in its eigenvectors whose eigenvalue exceeds `least`, and 0 in
/// the others.
template <int size>
Eigen::Matrix<double, size, size> inverse_of_determined(
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, size, size>>& N, double least) {
  Eigen::Matrix<double, size, size> inverse = Eigen::Matrix<double, size, size>::Zero();
  for (int i = 0; i < size; ++i) {
    if (N.eigenvalues()[i] <= least) continue;
    const Eigen::Matrix<double, size, 1> direction = N.eigenvectors().col(i);
    inverse += direction * direction.transpose() / N.eigenvalues()[i];
  }
  return inverse;
}

}  // namespace

TrajectoryPair at_lever_arm(TrajectoryPair pair, const Eigen::Vector3d& lever_m) {
  for (size_t i = 0; i < pair.size(); ++i)
    pair.estimate.positions_m[i] += pair.estimate.rotations[i] * lever_m;
  return pair;
}

std::optional<Eigen::Vector3d> estimate_lever_arm(const TrajectoryPair& pair) {
  SEXTANT_CHECK(pair.reference.size() == pair.size());
  constexpr double turn_rad = 0.2, least_turn_rad = 0.02;
  const size_t n = pair.size();
  if (n < fewest_poses) return std::nullopt;
  const auto turn_rms = [&](size_t k) {
    double sum = 0;
    for_each_step(pair, k, 1, [&](const RelativePose&, const RelativePose& step) {
      sum += std::pow(rotation_angle_rad(step.rotation), 2);
    });
    return std::sqrt(sum / static_cast<double>(n - k));
  };
  size_t k = 1;
  while (2 * k <= n / 4 && turn_rms(k) < turn_rad) k *= 2;
  if (turn_rms(k) < least_turn_rad) return std::nullopt;

  // Normal equations of (l, s), from which s is eliminated.
  Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  for_each_step(pair, k, 1, [&](const RelativePose& r, const RelativePose& e) {
    Eigen::Matrix<double, 3, 4> A;
    A << e.rotation - Eigen::Matrix3d::Identity(), e.translation_m;
    N += A.transpose() * A;
    b += A.transpose() * r.translation_m;
  });
  Eigen::Matrix3d M = N.topLeftCorner<3, 3>();
  Eigen::Vector3d c = b.head<3>();
  if (N(3, 3) > 0) {
    M -= N.topRightCorner<3, 1>() * N.topRightCorner<3, 1>().transpose() / N(3, 3);
    c -= N.topRightCorner<3, 1>() * (b[3] / N(3, 3));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(M);
  const double largest = solver.eigenvalues()[2];
  if (!(largest > 0)) return std::nullopt;
  const Eigen::Vector3d l = inverse_of_determined(solver, least_information * largest) * c;
  if (!l.allFinite()) return std::nullopt;
  return l;
}

std::optional<BodyRotation> estimate_body_rotation(const TrajectoryPair& pair) {
  SEXTANT_CHECK(pair.reference.size() == pair.size());
  constexpr double lever_sigma_m = 2, worse = 1.1;
  constexpr size_t n_pieces = 100, most_pieces = 2000;  // overlapping pieces, of which 2000 suffice
  constexpr int n_iterations = 5;
  const size_t n = pair.size();
  if (n < fewest_poses) return std::nullopt;
  struct Piece {
    RelativePose reference, estimate;
  };
  std::vector<Piece> pieces;
  for_each_step(pair, std::max<size_t>(1, n / n_pieces), n / most_pieces + 1,
                [&](const RelativePose& r, const RelativePose& e) {
                  pieces.push_back({r, e});
                });

  Eigen::Matrix3d camera_from_body = Eigen::Matrix3d::Identity();
  double scale = 1;
  // Sets the best scale, and returns the sum of squared errors of the translations.
  const auto squares = [&] {
    double along = 0, of_estimate = 0, of_reference = 0;
    for (const Piece& piece : pieces) {
      along += piece.reference.translation_m.dot(camera_from_body * piece.estimate.translation_m);
      of_estimate += piece.estimate.translation_m.squaredNorm();
      of_reference += piece.reference.translation_m.squaredNorm();
    }
    scale = of_estimate > 0 ? along / of_estimate : 0;
    return of_reference - scale * along;
  };
  const auto rotation_squares = [&] {
    double sum = 0;
    for (const Piece& piece : pieces) {
      const Eigen::Matrix3d turned =
          camera_from_body * piece.estimate.rotation * camera_from_body.transpose();
      sum += std::pow(rotation_angle_rad(piece.reference.rotation.transpose() * turned), 2);
    }
    return sum;
  };
  BodyRotation out;
  out.squares_without = squares();
  const double rotations_without = rotation_squares();
  if (!(scale > 0) || !(out.squares_without > 0)) return std::nullopt;

  for (int iteration = 0; iteration < n_iterations; ++iteration) {
    const double variance = squares() / (3 * static_cast<double>(pieces.size()));
    // Normal equations of (rotation, lever arm, change of scale); the latter two are eliminated.
    Eigen::Matrix<double, 7, 7> N = Eigen::Matrix<double, 7, 7>::Zero();
    Eigen::Matrix<double, 7, 1> b = Eigen::Matrix<double, 7, 1>::Zero();
    double across = 0;
    for (const Piece& piece : pieces) {
      const Eigen::Vector3d t = camera_from_body * piece.estimate.translation_m;
      Eigen::Matrix<double, 3, 7> A;
      A << -scale * skew(t), piece.reference.rotation - Eigen::Matrix3d::Identity(), t;
      N += A.transpose() * A;
      b += A.transpose() * (piece.reference.translation_m - scale * t);
      across += scale * scale * t.squaredNorm();
    }
    N.diagonal().segment<3>(3).array() += variance / (lever_sigma_m * lever_sigma_m);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> others(N.bottomRightCorner<4, 4>());
    constexpr double rounding = 1e-14;
    const Eigen::Matrix<double, 3, 4> C = N.topRightCorner<3, 4>();
    const Eigen::Matrix<double, 3, 4> R =
        C * inverse_of_determined(others, rounding * others.eigenvalues()[3]);
    const Eigen::Matrix3d M = N.topLeftCorner<3, 3>() - R * C.transpose();
    const Eigen::Vector3d c = b.head<3>() - R * b.tail<4>();
    const Eigen::Vector3d turn =
        inverse_of_determined(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(M), least_information * across) *
        c;
    if (!turn.allFinite()) return std::nullopt;
    camera_from_body = so3_exp(turn).toRotationMatrix() * camera_from_body;
  }
  out.squares_with = squares();
  out.body_from_camera = camera_from_body.transpose();
  if (rotation_squares() > worse * rotations_without) return std::nullopt;
  return out;
}

}  // namespace sextant
