#include "sextant/estimator/flow_depth_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/estimator/lanes.h"

namespace sextant {

/// The arrays and constants that the vectorised loop reads, and what it writes per point.
struct FlowDepthLanes {
  const double *x, *y, *target_u, *target_v, *inverse_depth, *inverse_depth_curr, *weight, *has_curr;
  double *refined, *q, *error_u, *error_v, *slope_u, *slope_v;
  size_t n;
  double fx, fy, cx, cy;

  explicit FlowDepthLanes(FlowDepthData& d)
      : x(d.x_.data()),
        y(d.y_.data()),
        target_u(d.target_u_.data()),
        target_v(d.target_v_.data()),
        inverse_depth(d.inverse_depth_.data()),
        inverse_depth_curr(d.inverse_depth_curr_.data()),
        weight(d.weight_.data()),
        has_curr(d.has_curr_.data()),
        refined(d.refined_.data()),
        q(d.q_.data()),
        error_u(d.error_u_.data()),
        error_v(d.error_v_.data()),
        slope_u(d.slope_u_.data()),
        slope_v(d.slope_v_.data()),
        n(d.x_.size()),
        fx(d.camera_.left.fx),
        fy(d.camera_.left.fy),
        cx(d.camera_.left.cx),
        cy(d.camera_.left.cy) {}
};

namespace {

bool is_positive(const Matrix6d& hessian) { return Eigen::LLT<Matrix6d>(hessian).info() == Eigen::Success; }

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int n_hessian = 21;  // upper triangle, row by row
constexpr int max_depth_steps = 30;
// Square of the last step of a depth, in its standard deviations; the next would be of the order of its
// square.
constexpr double last_depth_step2 = 1e-10;

/// Noise levels and kernel as the factors that the loop needs.
struct Factors {
  double info_u, info_v;
  double info_depth = 0;  ///< 1 / kappa^2 = (bf / delta_d)^2
  double info_curr = 0;
  bool refine = false;
  bool as_measured = false;
  bool quasi = false;
  bool newton = false;
  int last_step;             ///< of a depth, before the one in what is linear in it
  bool points_only = false;  ///< leave out kernel and sums
  RobustKernel kernel;

  Factors(const NoiseLevels& levels, const StereoCamera& camera, const RobustKernel& rho, Curvature curvature)
      : info_u(1 / (levels.sigma_flow_u_px * levels.sigma_flow_u_px)),
        info_v(1 / (levels.sigma_flow_v_px * levels.sigma_flow_v_px)),
        refine(levels.delta_d_px > 0),
        as_measured(levels.as_measured),
        quasi(levels.depth_noise == DepthNoise::depth),
        newton(curvature == Curvature::newton && !levels.as_measured),
        last_step(curvature == Curvature::rough ? 0 : max_depth_steps),
        kernel(rho) {
    const auto information = [&](double delta_d_px) {
      return delta_d_px > 0 ? (camera.bf / delta_d_px) * (camera.bf / delta_d_px) : 0.0;
    };
    info_depth = information(levels.delta_d_px);
    info_curr = information(levels.delta_d_curr_px);
  }
};

/// sums = [hessian (21), gradient (6), sum of rho, number of points behind the camera]
SEXTANT_SIMD void accumulate_lanes(const FlowDepthLanes& d, const RigidMotion& m, const Factors& f,
                                   double* sums) {
  Lanes hessian[n_hessian] = {};
  Lanes gradient[6] = {};
  Lanes cost = {};
  Lanes behind = {};
  const Lanes zero = {};
  const Lanes one = zero + 1.0;
  const double scale2 = f.kernel.scale * f.kernel.scale;
  for (size_t i = 0; i < d.n; i += n_lanes) {
    const Lanes x = SEXTANT_LOAD(d.x + i);
    const Lanes y = SEXTANT_LOAD(d.y + i);
    const Lanes ax = m.r[0] * x + m.r[1] * y + m.r[2];
    const Lanes ay = m.r[3] * x + m.r[4] * y + m.r[5];
    const Lanes az = m.r[6] * x + m.r[7] * y + m.r[8];
    const Lanes count = SEXTANT_LOAD(d.weight + i);
    const Lanes tu = SEXTANT_LOAD(d.target_u + i);
    const Lanes tv = SEXTANT_LOAD(d.target_v + i);
    const Lanes sm = SEXTANT_LOAD(d.inverse_depth + i);       // measured
    const Lanes cm = SEXTANT_LOAD(d.inverse_depth_curr + i);  // measured, 1 where there is none
    const Lanes inverse_sm = f.quasi ? one / sm : zero;
    const Lanes inverse_cm = f.quasi ? one / cm : zero;
    const Lanes info_curr = f.info_curr * SEXTANT_LOAD(d.has_curr + i);
    const Lanes info_depth = zero + f.info_depth;
    Lanes s = f.refine && !f.as_measured ? SEXTANT_LOAD(d.refined + i) : sm;

    Lanes iw, xn, yn, eu, ev, us, vs, c, cs, slope, slope_curr, curv, curv_curr;
    LaneMask in_front;
    for (int step = 0;; ++step) {
      const Lanes w = az + s * m.t[2];
      in_front = w > min_depth_m * s;
      iw = one / (in_front ? w : one);
      xn = (ax + s * m.t[0]) * iw;
      yn = (ay + s * m.t[1]) * iw;
      eu = d.fx * xn + d.cx - tu;
      ev = d.fy * yn + d.cy - tv;
      us = d.fx * (m.t[0] - xn * m.t[2]) * iw;
      vs = d.fy * (m.t[1] - yn * m.t[2]) * iw;
      c = s * iw;  // inverse depth in the current frame
      cs = az * iw * iw;
      // Half the deviances' first and second derivatives.
      slope = info_depth * (s - sm) * (f.quasi ? s * inverse_sm : one);
      curv = info_depth * (f.quasi ? 2.0 * s * inverse_sm - 1.0 : one);
      slope_curr = info_curr * (c - cm) * (f.quasi ? c * inverse_cm : one);
      curv_curr = info_curr * (f.quasi ? 2.0 * c * inverse_cm - 1.0 : one);
      curv = curv > 0.1 * info_depth ? curv : 0.1 * info_depth;
      curv_curr = curv_curr > 0.1 * info_curr ? curv_curr : 0.1 * info_curr;
      if (!f.refine || f.as_measured || step == f.last_step) break;
      const Lanes bend = -2.0 * m.t[2] * iw;  // u''/u' = v''/v' = s'''/s''
      const Lanes first = eu * us * f.info_u + ev * vs * f.info_v + slope + slope_curr * cs;
      const Lanes gauss_newton = us * us * f.info_u + vs * vs * f.info_v + curv + curv_curr * cs * cs;
      const Lanes second = gauss_newton + bend * (eu * us * f.info_u + ev * vs * f.info_v + slope_curr * cs);
      const Lanes next = s - first / (second > 0.3 * gauss_newton ? second : gauss_newton);
      const Lanes low = 0.3 * s;
      const Lanes high = 3.0 * s;
      const Lanes moved = in_front ? (next < low ? low : (next > high ? high : next)) : s;
      const Lanes change = moved - s;
      if (f.last_step < max_depth_steps) {
        s = moved;
        continue;
      }
      const LaneMask moving = (count > zero) & (change * change * gauss_newton > last_depth_step2);
      s = moved;
      if ((moving[0] | moving[1] | moving[2] | moving[3]) == 0) step = f.last_step - 1;
    }

    const Lanes deviance =
        info_depth * (s - sm) * (s - sm) * (f.quasi ? (2.0 * s + sm) * inverse_sm / 3.0 : one);
    const Lanes deviance_curr =
        info_curr * (c - cm) * (c - cm) * (f.quasi ? (2.0 * c + cm) * inverse_cm / 3.0 : one);
    Lanes su = f.info_u * eu;
    Lanes sv = f.info_v * ev;
    Lanes q = su * eu + sv * ev + deviance + deviance_curr;
    const Lanes h = f.refine ? f.info_u * us * us + f.info_v * vs * vs + curv_curr * cs * cs + curv : one;
    const Lanes ih = one / h;
    if (f.refine &&
        (f.as_measured || f.last_step < max_depth_steps)) {  // one step of s, in what is linear in it
      const Lanes first = su * us + sv * vs + slope + slope_curr * cs;
      const Lanes step = -first * ih;
      const Lanes change = step < -0.7 * s ? -0.7 * s : (step > 2.0 * s ? 2.0 * s : step);
      q += change * (2.0 * first + h * change);
      q = q > zero ? q : zero;
      su += f.info_u * us * change;
      sv += f.info_v * vs * change;
      slope_curr += curv_curr * cs * change;
      if (!f.as_measured) s = in_front ? s + change : s;
    }
    behind += in_front ? zero : count;
    SEXTANT_STORE(d.refined + i, s);
    SEXTANT_STORE(d.q + i, in_front ? q : zero + infinity);
    SEXTANT_STORE(d.error_u + i, eu);
    SEXTANT_STORE(d.error_v + i, ev);
    SEXTANT_STORE(d.slope_u + i, us);
    SEXTANT_STORE(d.slope_v + i, vs);
    if (f.points_only) continue;

    // Kernel: robust_kernel.h.
    Lanes weight = count;
    Lanes rho = q;
    Lanes bent = zero;
    if (f.kernel.kind == RobustKernel::Kind::huber) {
      const LaneMask inside = q <= scale2;
      Lanes norm = inside ? one : q;
      for (size_t k = 0; k < n_lanes; ++k) norm[k] = std::sqrt(norm[k]);
      weight = inside ? count : count * f.kernel.scale / norm;
      rho = inside ? q : 2.0 * f.kernel.scale * norm - scale2;
      bent = inside ? zero : one / q;
    } else if (f.kernel.kind == RobustKernel::Kind::geman_mcclure) {
      const Lanes share = scale2 / (scale2 + q);
      weight = count * share * share;
      rho = share * q;
      bent = 4.0 / (scale2 + q);
      if (!f.newton) bent = 3.0 * q > scale2 ? one / q : bent;
    }
    if (f.last_step == 0) bent = zero;
    cost += count * rho;

    // By the point in the current frame, in units of its depth: T = [fx 0 -fx xn; 0 fy -fy yn; 0 0 -c] are
    // the derivatives of u', v', c; g = T^T s the gradient, G = T^T W T the Hessian, after the Schur
    // complement of s, with the kernel's curvature. The twist moves the point by T [c I | R], R = -[xn yn
    // 1]x.
    const Lanes g0 = d.fx * su;
    const Lanes g1 = d.fy * sv;
    const Lanes gc = c * slope_curr;
    const Lanes g2 = -(xn * g0 + yn * g1 + gc);
    const Lanes bu = f.refine ? d.fx * f.info_u * us : zero;
    const Lanes bv = f.refine ? d.fy * f.info_v * vs : zero;
    const Lanes bc = f.refine ? c * curv_curr * cs : zero;
    const Lanes schur = f.newton ? zero : ih;
    const Lanes wuu = weight * (d.fx * d.fx * f.info_u - schur * bu * bu - bent * g0 * g0);
    const Lanes wuv = weight * (-schur * bu * bv - bent * g0 * g1);
    const Lanes wvv = weight * (d.fy * d.fy * f.info_v - schur * bv * bv - bent * g1 * g1);
    const Lanes wuc = weight * (-schur * bu * bc - bent * g0 * gc);
    const Lanes wvc = weight * (-schur * bv * bc - bent * g1 * gc);
    const Lanes wcc = weight * (c * c * curv_curr - schur * bc * bc - bent * gc * gc);
    Lanes G02 = -(xn * wuu + yn * wuv + wuc);
    Lanes G12 = -(xn * wuv + yn * wvv + wvc);
    Lanes G22 = xn * (wuc - G02) + yn * (wvc - G12) + wcc;
    if (f.newton) {  // u', v', c are not linear in the point
      G02 -= weight * g0;
      G12 -= weight * g1;
      G22 -= 2.0 * weight * g2;
    }
    const Lanes K03 = yn * G02 - wuv, K04 = wuu - xn * G02, K05 = xn * wuv - yn * wuu;
    const Lanes K13 = yn * G12 - wvv, K14 = wuv - xn * G12, K15 = xn * wvv - yn * wuv;
    const Lanes K23 = yn * G22 - G12, K24 = G02 - xn * G22, K25 = xn * G12 - yn * G02;
    const Lanes c2 = c * c;
    Lanes h6[n_hessian] = {c2 * wuu,           c2 * wuv,       c2 * G02,       c * K03, c * K04, c * K05,  //
                           c2 * wvv,           c2 * G12,       c * K13,        c * K14, c * K15,           //
                           c2 * G22,           c * K23,        c * K24,        c * K25,                    //
                           yn * K23 - K13,     yn * K24 - K14, yn * K25 - K15,                             //
                           K04 - xn * K24,     K05 - xn * K25,                                             //
                           xn * K15 - yn * K05};
    if (f.newton) {
      // Turning moves the point along a circle, and s moves it by e: mixed derivatives instead of b.
      const Lanes along = -iw / s;
      const Lanes e0 = along * ax, e1 = along * ay, e2 = along * az;
      const Lanes n0 = bu - g0 * e2;
      const Lanes n1 = bv - g1 * e2;
      const Lanes n2 = -(xn * bu + yn * bv + bc + g0 * e0 + g1 * e1 + 2.0 * g2 * e2);
      const Lanes mixed[6] = {c * n0,
                              c * n1,
                              c * n2,
                              yn * n2 - n1 + e1 * g2 - e2 * g1,
                              n0 - xn * n2 + e2 * g0 - e0 * g2,
                              xn * n1 - yn * n0 + e0 * g1 - e1 * g0};
      const Lanes second = h - 2.0 * m.t[2] * iw * (su * us + sv * vs + slope_curr * cs);
      const Lanes share = weight / (second > 0.3 * h ? second : h);
      const Lanes half = 0.5 * weight;
      h6[15] += weight * (g0 * xn + gc);
      h6[16] += half * (g0 * yn + g1 * xn);
      h6[17] += half * (g0 + g2 * xn);
      h6[18] += weight * (g1 * yn + gc);
      h6[19] += half * (g1 + g2 * yn);
      h6[20] += weight * (g2 + gc);
      int k = 0;
      for (int a = 0; a < 6; ++a) {
        const Lanes scaled = f.refine ? share * mixed[a] : zero;
        for (int b = a; b < 6; ++b) h6[k++] -= scaled * mixed[b];
      }
    }
    for (int k = 0; k < n_hessian; ++k) hessian[k] += h6[k];
    const Lanes wc = weight * c;
    gradient[0] += wc * g0;
    gradient[1] += wc * g1;
    gradient[2] += wc * g2;
    gradient[3] += weight * (yn * g2 - g1);
    gradient[4] += weight * (g0 - xn * g2);
    gradient[5] += weight * (xn * g1 - yn * g0);
  }
  const auto total = [](const Lanes& v) { return (v[0] + v[1]) + (v[2] + v[3]); };
  for (int k = 0; k < n_hessian; ++k) sums[k] = total(hessian[k]);
  for (int k = 0; k < 6; ++k) sums[n_hessian + k] = total(gradient[k]);
  sums[n_hessian + 6] = total(cost);
  sums[n_hessian + 7] = total(behind);
}

}  // namespace

FlowDepthData::FlowDepthData(const StereoCamera& camera, size_t size) : camera_(camera), size_(size) {
  const size_t padded = (size + lanes - 1) / lanes * lanes;
  for (auto* array : {&x_, &y_, &target_u_, &target_v_, &weight_, &has_curr_, &q_, &error_u_, &error_v_,
                      &slope_u_, &slope_v_}) {
    array->assign(padded, 0);
  }
  for (auto* array : {&inverse_depth_, &inverse_depth_curr_, &refined_}) {
    array->assign(padded, 1);
  }
  valid_.assign(size, 0);
  valid_curr_.assign(size, 0);
}

FlowDepthData::FlowDepthData(const Problem& problem) : FlowDepthData(problem.camera, problem.points.size()) {
  const Correspondences& p = problem.points;
  for (size_t i = 0; i < size_; ++i) {
    const double target_u = p.u[i] + p.flow_u[i];
    const double target_v = p.v[i] + p.flow_v[i];
    const double inverse = 1 / p.depth[i];
    if (!std::isfinite(target_u) || !std::isfinite(target_v) || !std::isfinite(inverse) || inverse <= 0) {
      continue;
    }
    valid_[i] = 1;
    weight_[i] = 1;
    x_[i] = (p.u[i] - camera_.left.cx) / camera_.left.fx;
    y_[i] = (p.v[i] - camera_.left.cy) / camera_.left.fy;
    target_u_[i] = target_u;
    target_v_[i] = target_v;
    inverse_depth_[i] = inverse;
    const double inverse_curr = 1 / p.depth_curr[i];
    if (std::isfinite(inverse_curr) && inverse_curr > 0) {
      valid_curr_[i] = 1;
      inverse_depth_curr_[i] = inverse_curr;
      has_curr_[i] = 1;
    }
  }
  refined_ = inverse_depth_;
}

FlowDepthData FlowDepthData::sample(size_t size) const {
  const size_t used_points = n_used();
  const size_t stride = std::max<size_t>(used_points / size, 1);
  FlowDepthData out(camera_, (used_points + stride - 1) / stride);
  size_t seen = 0;
  size_t k = 0;
  for (size_t i = 0; i < size_; ++i) {
    if (!used(i) || seen++ % stride != 0) continue;
    out.valid_[k] = 1;
    out.weight_[k] = 1;
    out.x_[k] = x_[i];
    out.y_[k] = y_[i];
    out.target_u_[k] = target_u_[i];
    out.target_v_[k] = target_v_[i];
    out.inverse_depth_[k] = out.refined_[k] = inverse_depth_[i];
    ++k;
  }
  return out;
}

void FlowDepthData::use(size_t i, bool point, bool depth_curr) {
  weight_[i] = point && valid_[i] != 0 ? 1 : 0;
  has_curr_[i] = depth_curr && measures_depth_curr(i) ? 1 : 0;
}

size_t FlowDepthData::n_used() const {
  size_t n = 0;
  for (size_t i = 0; i < size_; ++i) n += used(i) ? 1 : 0;
  return n;
}

PointDepths FlowDepthData::depths(size_t i, const NoiseLevels& levels) const {
  const auto weight = [&](double delta_d_px) { return delta_d_px > 0 ? camera_.bf / delta_d_px : 0.0; };
  return {inverse_depth_[i], weight(levels.delta_d_px), inverse_depth_curr_[i],
          uses_depth_curr(i) ? weight(levels.delta_d_curr_px) : 0};
}

NormalEquations accumulate(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                           const RobustKernel& kernel, Curvature curvature) {
  std::array<double, n_hessian + 8> sums{};
  accumulate_lanes(FlowDepthLanes(data), RigidMotion(T_curr_prev),
                   Factors(levels, data.camera_, kernel, curvature), sums.data());
  NormalEquations out;
  int k = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) out.hessian(a, b) = out.hessian(b, a) = sums[k++];
  }
  for (int a = 0; a < 6; ++a) out.gradient[a] = sums[k++];
  out.cost = sums[k + 1] > 0 ? infinity : 0.5 * sums[k];
  return out;
}

void evaluate_distances(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                        std::vector<double>& q) {
  std::array<double, n_hessian + 8> sums{};
  Factors factors(levels, data.camera_, {}, Curvature::gauss_newton);
  factors.points_only = true;
  factors.last_step = 1;
  accumulate_lanes(FlowDepthLanes(data), RigidMotion(T_curr_prev), factors, sums.data());
  q = data.q_;  // keeps its memory
  for (size_t i = 0; i < data.size_; ++i) {
    if (data.valid_[i] == 0) q[i] = infinity;
  }
}

void evaluate_points(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                     PointEvaluation& out) {
  std::array<double, n_hessian + 8> sums{};
  Factors factors(levels, data.camera_, {}, Curvature::gauss_newton);
  factors.points_only = true;
  accumulate_lanes(FlowDepthLanes(data), RigidMotion(T_curr_prev), factors, sums.data());
  out.q = data.q_;  // keeps its memory
  out.error_u = data.error_u_;
  out.error_v = data.error_v_;
  out.slope_u = data.slope_u_;
  out.slope_v = data.slope_v_;
  out.inverse_depth = data.refined_;
  const RigidMotion m(T_curr_prev);
  for (auto* values : {&out.inverse_depth_curr, &out.x_curr, &out.y_curr}) values->resize(data.x_.size());
  for (size_t i = 0; i < data.size_; ++i) {
    const double x = data.x_[i];
    const double y = data.y_[i];
    const double s = out.inverse_depth[i];
    const double w = m.r[6] * x + m.r[7] * y + m.r[8] + s * m.t[2];
    out.inverse_depth_curr[i] = s / w;
    out.x_curr[i] = (m.r[0] * x + m.r[1] * y + m.r[2] + s * m.t[0]) / w;
    out.y_curr[i] = (m.r[3] * x + m.r[4] * y + m.r[5] + s * m.t[1]) / w;
    if (data.valid_[i] == 0) out.q[i] = infinity;
  }
}

std::optional<SE3> step_flow_depth(FlowDepthData& data, const SE3& from, const NoiseLevels& levels,
                                   const RobustKernel& kernel, double* size) {
  const NormalEquations at = accumulate(data, from, levels, kernel, Curvature::rough);
  const Vector6d step = at.hessian.ldlt().solve(-at.gradient);
  if (!std::isfinite(at.cost) || !step.allFinite()) return std::nullopt;
  const SE3 to = SE3::exp(step) * from;
  if (size != nullptr) *size = step.cwiseAbs().maxCoeff();
  return to.is_finite() ? std::optional(to) : std::nullopt;
}

SolverResult descend(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                     const RobustKernel& kernel, int max_iterations) {
  return minimize_on_se3([&](const SE3& X) { return accumulate(data, X, levels, kernel, Curvature::rough); },
                         start, {.max_iterations = max_iterations, .step_tolerance = 1e-5});
}

SolverResult minimize_flow_depth(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                                 const RobustKernel& kernel, const SolverOptions& options,
                                 const MotionPrior& prior) {
  return minimize_on_se3(
      [&](const SE3& X) {
        NormalEquations at = accumulate(data, X, levels, kernel, Curvature::newton);
        if (prior.holds()) add_prior(prior, X, at);
        if (!std::isfinite(at.cost) || is_positive(at.hessian)) return at;
        at = accumulate(data, X, levels, kernel, Curvature::gauss_newton);
        if (prior.holds()) add_prior(prior, X, at);
        return at;
      },
      start, options);
}

}  // namespace sextant
