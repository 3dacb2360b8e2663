// An estimator of one's own inside Sextant's pipeline: plain least squares on the inliers of the robust
// start, by Gauss-Newton. It sees measurements only (Problem); features, RANSAC, objects, noise, truth,
// metrics and reports are Sextant's.
//
//   r_i(X) = p_i + phi_i - project(X * backproject(p_i, d_i)),   X <- exp(xi) * X

#include <Eigen/Cholesky>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/case_estimator.h"

namespace {

using sextant::Matrix6d, sextant::Vector6d;

struct LeastSquaresOptions {
  SEXTANT_OPTIONS((int, iterations, 10, "count", "Gauss-Newton steps"))
  void check() const { sextant::check_option(iterations > 0, "iterations", iterations, "> 0"); }
};

class LeastSquares final : public sextant::Estimator {
 public:
  explicit LeastSquares(const LeastSquaresOptions& options) : options_(options) {}

  sextant::MotionEstimate estimate(const sextant::Problem& problem,
                                   const sextant::StartingPoint& start) const override {
    sextant::MotionEstimate result{.T_curr_prev = start.T_curr_prev, .inliers = start.inliers};
    Matrix6d hessian;
    for (; result.iterations < options_.iterations; ++result.iterations) {
      Vector6d gradient;
      result.cost = linearise(problem, start.inliers, result.T_curr_prev, hessian, gradient);
      const Eigen::LDLT<Matrix6d> factor(hessian);
      const Vector6d step = -factor.solve(gradient);
      if (factor.info() != Eigen::Success || !step.allFinite()) return result;  // diverged
      result.T_curr_prev = sextant::SE3::exp(step) * result.T_curr_prev;
    }
    result.covariance = hessian.inverse();
    result.refined_flow_u = problem.points.flow_u;
    result.refined_flow_v = problem.points.flow_v;
    result.status = sextant::Status::ok;
    return result;
  }

  sextant::Json options() const override { return sextant::write_options(options_); }

 private:
  /// Returns the sum of squares; sets hessian = J'J and gradient = J'r.
  static double linearise(const sextant::Problem& problem, const std::vector<unsigned char>& use,
                          const sextant::SE3& X, Matrix6d& hessian, Vector6d& gradient) {
    const sextant::Correspondences& p = problem.points;
    const sextant::PinholeCamera& camera = problem.camera.left;
    hessian.setZero();
    gradient.setZero();
    double cost = 0;
    for (size_t i = 0; i < p.size(); ++i) {
      const Eigen::Vector3d q = X * camera.backproject(p.u[i], p.v[i], p.depth[i]);
      if (use[i] == 0 || q.z() <= 0) continue;
      const Eigen::Vector2d r =
          Eigen::Vector2d(p.u[i] + p.flow_u[i], p.v[i] + p.flow_v[i]) - camera.project(q);
      Eigen::Matrix<double, 2, 3> projection;
      projection << camera.fx / q.z(), 0, -camera.fx * q.x() / (q.z() * q.z()),  //
          0, camera.fy / q.z(), -camera.fy * q.y() / (q.z() * q.z());
      Eigen::Matrix<double, 3, 6> motion;
      motion << Eigen::Matrix3d::Identity(), -sextant::skew(q);
      const Eigen::Matrix<double, 2, 6> J = -projection * motion;
      hessian += J.transpose() * J;
      gradient += J.transpose() * r;
      cost += r.squaredNorm();
    }
    return cost;
  }

  LeastSquaresOptions options_;
};

}  // namespace

int main(int argc, char** argv) {
  sextant::add_estimator({"least_squares", "example: Gauss-Newton on the inliers, no robust kernel",
                          [](const sextant::Json& json) -> std::unique_ptr<sextant::Estimator> {
                            LeastSquaresOptions options;
                            sextant::read_options(json, options, "estimator");
                            return std::make_unique<LeastSquares>(options);
                          },
                          [] { return sextant::describe_options(LeastSquaresOptions{}, "estimator"); }});
  return sextant::program(argc, argv);
}
