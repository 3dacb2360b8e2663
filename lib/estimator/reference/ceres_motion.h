#pragma once

// What the Ceres references share: SE(3) as a manifold with left perturbation, and the solve.

#include <ceres/ceres.h>

#include <array>

#include "sextant/estimator/solvers/degeneracy.h"

namespace sextant {

// Ambient parameters of a motion: quaternion x y z w, translation x y z.
using MotionBlock = std::array<double, 7>;

inline MotionBlock to_block(const SE3& T) {
  const Eigen::Quaterniond& q = T.rotation();
  const Eigen::Vector3d& t = T.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

inline SE3 from_block(const double* x) {
  return {Eigen::Quaterniond(x[3], x[0], x[1], x[2]), Eigen::Vector3d(x[4], x[5], x[6])};
}

#if CERES_VERSION_MAJOR > 2 || CERES_VERSION_MINOR > 0
using CeresManifold = ceres::Manifold;
constexpr auto manifold_ownership = &ceres::Problem::Options::manifold_ownership;
#else  // Ubuntu 22.04
class CeresManifold : public ceres::LocalParameterization {
 public:
  virtual int AmbientSize() const = 0;
  virtual int TangentSize() const = 0;
  virtual bool PlusJacobian(const double* x, double* jacobian) const = 0;
  virtual bool Minus(const double* y, const double* x, double* y_minus_x) const = 0;
  virtual bool MinusJacobian(const double* x, double* jacobian) const = 0;
  int GlobalSize() const override { return AmbientSize(); }
  int LocalSize() const override { return TangentSize(); }
  bool ComputeJacobian(const double* x, double* jacobian) const override { return PlusJacobian(x, jacobian); }
};
constexpr auto manifold_ownership = &ceres::Problem::Options::local_parameterization_ownership;
#endif

/// SE(3) with left perturbation, as everywhere in this project: plus(T, xi) = exp(xi) T.
class SE3Manifold : public CeresManifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const MotionBlock moved = to_block(SE3::exp(Eigen::Map<const Vector6d>(delta)) * from_block(x));
    std::copy(moved.begin(), moved.end(), x_plus_delta);
    return true;
  }

  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
    const Eigen::Vector3d v(x[0], x[1], x[2]);
    const Eigen::Vector3d t(x[4], x[5], x[6]);
    j.setZero();
    // d (exp(omega) q): vector part (w I - [v]x) / 2, scalar part -v^T / 2
    j.block<3, 3>(0, 3) = 0.5 * (x[3] * Eigen::Matrix3d::Identity() - skew(v));
    j.block<1, 3>(3, 3) = -0.5 * v.transpose();
    j.block<3, 3>(4, 0).setIdentity();
    j.block<3, 3>(4, 3) = -skew(t);
    return true;
  }

  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>(y_minus_x, 6) = (from_block(y) * from_block(x).inverse()).log();
    return true;
  }

  bool MinusJacobian(const double* x, double* jacobian) const override {
    // Left inverse of PlusJacobian: d omega = 2 (w I + [v]x) d v - 2 v d w; d rho = d t + [t]x d omega.
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
    const Eigen::Vector3d v(x[0], x[1], x[2]);
    const Eigen::Vector3d t(x[4], x[5], x[6]);
    j.setZero();
    j.block<3, 3>(3, 0) = 2.0 * (x[3] * Eigen::Matrix3d::Identity() + skew(v));
    j.block<3, 1>(3, 3) = -2.0 * v;
    j.block<3, 4>(0, 0) = skew(t) * j.block<3, 4>(3, 0);
    j.block<3, 3>(0, 4).setIdentity();
    return true;
  }
};

/// One motion to solve for, and unknowns of points that are eliminated before it (Schur complement). Takes
/// costs, not losses.
class CeresMotion {
 public:
  CeresMotion(const SE3& start, const SolverOptions& options);

  double* motion() { return motion_.data(); }
  void add(ceres::CostFunction* cost, ceres::LossFunction* loss, auto*... unknowns) {
    problem_.AddResidualBlock(cost, loss, unknowns...);
  }
  void eliminate(double* of_point) { options_.linear_solver_ordering->AddElementToGroup(of_point, 0); }

  /// Fills in all but the refined flow.
  void solve(const Problem& problem, MotionEstimate& estimate);

 private:
  SE3Manifold manifold_;
  MotionBlock motion_;
  ceres::Problem problem_;
  ceres::Solver::Options options_;
};

}  // namespace sextant
