#include "sextant/estimator/solvers/motion_prior.h"

namespace sextant {

void add_prior(const MotionPrior& prior, const SE3& T_curr_prev, NormalEquations& equations) {
  const Eigen::Quaterniond q = T_curr_prev.rotation() * prior.mean.rotation().conjugate();
  const Eigen::Vector3d& t = T_curr_prev.translation();
  const Eigen::Vector3d& t_mean = prior.mean.translation();
  Vector6d xi;
  xi << t - t_mean + 2 * t_mean.cross(q.vec()), 2 * q.vec();
  const Eigen::Matrix3d turn = q.w() * Eigen::Matrix3d::Identity() - skew(q.vec());
  Matrix6d jacobian = Matrix6d::Identity();
  jacobian.topRightCorner<3, 3>() = skew(t_mean) * turn - skew(t);
  jacobian.bottomRightCorner<3, 3>() = turn;
  equations.cost += 0.5 * xi.dot(prior.precision * xi);
  equations.gradient += jacobian.transpose() * (prior.precision * xi);
  equations.hessian += jacobian.transpose() * prior.precision * jacobian;
}

}  // namespace sextant
