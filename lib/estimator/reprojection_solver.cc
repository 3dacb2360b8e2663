#include "sextant/estimator/reprojection_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "sextant/estimator/lanes.h"

namespace sextant {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int n_hessian = 21;  // upper triangle, row by row

/// sums = [hessian (21), gradient (6), sum of h, number of points behind the camera]
SEXTANT_SIMD void accumulate_lanes(const double* x, const double* y, const double* z, const double* target_u,
                                   const double* target_v, const double* weight, size_t n,
                                   const RigidMotion& m, const PinholeCamera& camera, double sigma,
                                   double threshold, double* sums) {
  Lanes hessian[n_hessian] = {};
  Lanes gradient[6] = {};
  Lanes cost = {};
  Lanes behind = {};
  const Lanes zero = {};
  const Lanes one = zero + 1.0;
  const double information = 1.0 / (sigma * sigma);
  const double threshold_px = threshold * sigma;
  const double threshold_px2 = threshold_px * threshold_px;
  const bool robust = std::isfinite(threshold);
  const double linear_weight = robust ? threshold / sigma : 0.0;
  const double linear_cost = robust ? threshold * threshold : 0.0;
  for (size_t i = 0; i < n; i += ReprojectionData::lanes) {
    const Lanes px = SEXTANT_LOAD(x + i);
    const Lanes py = SEXTANT_LOAD(y + i);
    const Lanes pz = SEXTANT_LOAD(z + i);
    const Lanes w = SEXTANT_LOAD(weight + i);
    const Lanes qx = m.r[0] * px + m.r[1] * py + m.r[2] * pz + m.t[0];
    const Lanes qy = m.r[3] * px + m.r[4] * py + m.r[5] * pz + m.t[1];
    const Lanes qz = m.r[6] * px + m.r[7] * py + m.r[8] * pz + m.t[2];
    const LaneMask in_front = qz > min_depth_m;
    behind += in_front ? zero : w;
    const Lanes iz = one / (in_front ? qz : one);
    const Lanes xn = qx * iz;
    const Lanes yn = qy * iz;
    // e = project(X m) - target = -r
    const Lanes eu = camera.fx * xn + camera.cx - SEXTANT_LOAD(target_u + i);
    const Lanes ev = camera.fy * yn + camera.cy - SEXTANT_LOAD(target_v + i);
    const Lanes n2 = eu * eu + ev * ev;
    const LaneMask inside = n2 <= threshold_px2;
    Lanes norm = inside ? one : n2;
    for (size_t k = 0; k < ReprojectionData::lanes; ++k) norm[k] = std::sqrt(norm[k]);
    const Lanes scale = w * (inside ? zero + information : linear_weight / norm);
    const Lanes radial = inside ? zero : scale / n2;
    cost += w * (inside ? information * n2 : 2.0 * linear_weight * norm - linear_cost);
    const Lanes wuu = scale - radial * eu * eu;
    const Lanes wuv = -radial * eu * ev;
    const Lanes wvv = scale - radial * ev * ev;
    // Rows of d project(exp(xi) q) / d xi; ju[1] = jv[0] = 0.
    const Lanes ju[6] = {
        camera.fx * iz, zero, -camera.fx * xn * iz, -camera.fx * xn * yn, camera.fx * (one + xn * xn),
        -camera.fx * yn};
    const Lanes jv[6] = {zero,
                         camera.fy * iz,
                         -camera.fy * yn * iz,
                         -camera.fy * (one + yn * yn),
                         camera.fy * xn * yn,
                         camera.fy * xn};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      const Lanes wu = wuu * ju[a] + wuv * jv[a];
      const Lanes wv = wuv * ju[a] + wvv * jv[a];
      gradient[a] += scale * (eu * ju[a] + ev * jv[a]);
      for (int b = a; b < 6; ++b) hessian[k++] += wu * ju[b] + wv * jv[b];
    }
  }
  const auto total = [](const Lanes& v) { return (v[0] + v[1]) + (v[2] + v[3]); };
  for (int k = 0; k < n_hessian; ++k) sums[k] = total(hessian[k]);
  for (int k = 0; k < 6; ++k) sums[n_hessian + k] = total(gradient[k]);
  sums[n_hessian + 6] = total(cost);
  sums[n_hessian + 7] = total(behind);
}

SEXTANT_SIMD void error_lanes(const double* x, const double* y, const double* z, const double* target_u,
                              const double* target_v, size_t n, const RigidMotion& m,
                              const PinholeCamera& camera, double* errors) {
  const Lanes zero = {};
  const Lanes one = zero + 1.0;
  for (size_t i = 0; i < n; i += ReprojectionData::lanes) {
    const Lanes px = SEXTANT_LOAD(x + i);
    const Lanes py = SEXTANT_LOAD(y + i);
    const Lanes pz = SEXTANT_LOAD(z + i);
    const Lanes qx = m.r[0] * px + m.r[1] * py + m.r[2] * pz + m.t[0];
    const Lanes qy = m.r[3] * px + m.r[4] * py + m.r[5] * pz + m.t[1];
    const Lanes qz = m.r[6] * px + m.r[7] * py + m.r[8] * pz + m.t[2];
    const LaneMask in_front = qz > min_depth_m;
    const Lanes iz = one / (in_front ? qz : one);
    const Lanes eu = camera.fx * (qx * iz) + camera.cx - SEXTANT_LOAD(target_u + i);
    const Lanes ev = camera.fy * (qy * iz) + camera.cy - SEXTANT_LOAD(target_v + i);
    const Lanes error = in_front ? eu * eu + ev * ev : zero + infinity;
    std::memcpy(errors + i, &error, sizeof(error));
  }
}

}  // namespace

void SolverOptions::check() const {
  check_option(max_iterations > 0, "max_iterations", max_iterations, "> 0");
  check_option(step_tolerance > 0, "step_tolerance", step_tolerance, "> 0");
}

ReprojectionData::ReprojectionData(const Problem& problem, const std::vector<unsigned char>& keep)
    : camera_(problem.camera.left) {
  const Correspondences& p = problem.points;
  SEXTANT_CHECK(keep.empty() || keep.size() == p.size());
  for (std::vector<double>* array : {&x_, &y_, &z_, &target_u_, &target_v_, &weight_}) {
    array->reserve(p.size() + lanes);
  }
  for (size_t i = 0; i < p.size(); ++i) {
    if (!keep.empty() && keep[i] == 0) continue;
    x_.push_back((p.u[i] - camera_.cx) / camera_.fx * p.depth[i]);
    y_.push_back((p.v[i] - camera_.cy) / camera_.fy * p.depth[i]);
    z_.push_back(p.depth[i]);
    target_u_.push_back(p.u[i] + p.flow_u[i]);
    target_v_.push_back(p.v[i] + p.flow_v[i]);
    weight_.push_back(1);
  }
  size_ = x_.size();
  while (x_.size() % lanes != 0) {  // padding: a harmless point of weight 0
    x_.push_back(0);
    y_.push_back(0);
    z_.push_back(1);
    target_u_.push_back(0);
    target_v_.push_back(0);
    weight_.push_back(0);
  }
}

NormalEquations accumulate(const ReprojectionData& data, const SE3& T_curr_prev, const HuberKernel& kernel) {
  std::array<double, n_hessian + 8> sums{};
  accumulate_lanes(data.x(), data.y(), data.z(), data.target_u(), data.target_v(), data.weight(),
                   data.padded_size(), RigidMotion(T_curr_prev), data.camera(), kernel.sigma_px,
                   kernel.threshold, sums.data());
  NormalEquations out;
  int k = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) out.hessian(a, b) = out.hessian(b, a) = sums[k++];
  }
  for (int a = 0; a < 6; ++a) out.gradient[a] = sums[k++];
  out.cost = sums[k + 1] > 0 ? infinity : 0.5 * sums[k];
  return out;
}

SolverResult minimize_reprojection(const ReprojectionData& data, const SE3& start, const HuberKernel& kernel,
                                   const SolverOptions& options) {
  return minimize_on_se3([&](const SE3& X) { return accumulate(data, X, kernel); }, start, options);
}

void squared_errors(const ReprojectionData& data, const SE3& T_curr_prev, std::vector<double>& errors) {
  errors.resize(data.padded_size());
  error_lanes(data.x(), data.y(), data.z(), data.target_u(), data.target_v(), data.padded_size(),
              RigidMotion(T_curr_prev), data.camera(), errors.data());
  errors.resize(data.size());
}

int count_inliers(const ReprojectionData& data, const SE3& T_curr_prev, double threshold_px, int at_least) {
  constexpr size_t block = 256;
  static_assert(block % ReprojectionData::lanes == 0);
  std::array<double, block> errors;
  const RigidMotion motion(T_curr_prev);
  const double threshold2 = threshold_px * threshold_px;
  int count = 0;
  for (size_t begin = 0; begin < data.size(); begin += block) {
    const size_t n = std::min(block, data.padded_size() - begin);
    error_lanes(data.x() + begin, data.y() + begin, data.z() + begin, data.target_u() + begin,
                data.target_v() + begin, n, motion, data.camera(), errors.data());
    const size_t real = std::min(n, data.size() - begin);
    for (size_t i = 0; i < real; ++i) count += errors[i] <= threshold2 ? 1 : 0;
    const auto seen = static_cast<double>(begin + real);
    const auto all = static_cast<double>(data.size());
    if (count + (all - seen) < at_least) break;
    // A model with at_least inliers would show at_least / all of them in the points seen, binomially.
    const double share = at_least / all;
    if (seen < all && count < share * seen - 4.0 * std::sqrt(share * std::max(1.0 - share, 0.0) * seen))
      break;
  }
  return count;
}

}  // namespace sextant
