#include "sextant/estimator/flow_depth/flow_depth_solver.h"

#include <cmath>
#include <limits>

#include "sextant/estimator/flow_depth/flow_depth_points.h"
#include "sextant/estimator/solvers/levenberg_marquardt.h"
#include "sextant/estimator/solvers/robust_kernel.h"

namespace sextant {
namespace {

/// Result of one pass over the points.
enum class FlowDepthLoop {
  distances,     ///< q only, to first order after one step of the depths
  points,        ///< all per-point results of FlowDepthPoints, with converged depths
  rough,         ///< sums of normal equations; see Curvature
  gauss_newton,  ///< as `rough`
  newton         ///< as `rough`
};

/// Newton's method doubles the digits of a depth in every step. Three steps from the measured depth are
/// sufficient for intermediate motions, which are computed in single precision.
template <typename Real>
constexpr int max_depth_steps = sizeof(Real) == 4 ? 3 : 30;
/// Square of the last step of a depth, in its standard deviations; the next step would have the order of its
/// square.
template <typename Real>
constexpr Real last_depth_step2 = sizeof(Real) == 4 ? 1e-6 : 1e-8;

/// Arrays, camera, noise levels and kernel in the form needed by the loop.
template <typename Real>
struct LoopInput {
  const Real *x, *y, *target_u, *target_v, *measured, *measured_curr, *weight, *has_curr;
  Real *refined, *q, *error_u, *error_v, *slope_u, *slope_v, *predicted_curr, *moved_x, *moved_y;
  size_t n;
  RigidMotionOf<Real> m;
  Real fx, fy, cx, cy;
  Real info_u, info_v;
  Real info_depth;  ///< 1 / kappa^2 = (bf / delta_d)^2
  Real info_curr;
  bool refine, as_measured, quasi;
  RobustKernel::Kind kind;
  Real scale;

  LoopInput(FlowDepthPoints<Real>& p, const SE3& motion, const NoiseLevels& levels,
            const RobustKernel& kernel)
      : n(p.padded()), m(motion) {
    using P = FlowDepthPoints<Real>;
    x = p.column(P::x), y = p.column(P::y);
    target_u = p.column(P::target_u), target_v = p.column(P::target_v);
    measured = p.column(P::measured), measured_curr = p.column(P::measured_curr);
    weight = p.column(P::weight), has_curr = p.column(P::has_curr);
    refined = p.column(P::refined), q = p.column(P::squared_distance);
    error_u = p.column(P::residual_u), error_v = p.column(P::residual_v);
    slope_u = p.column(P::du_ds), slope_v = p.column(P::dv_ds);
    predicted_curr = p.column(P::predicted_curr), moved_x = p.column(P::moved_x),
    moved_y = p.column(P::moved_y);
    const StereoCamera& camera = p.camera();
    const auto real = [](double value) { return static_cast<Real>(value); };
    const auto squared = [&](double value) { return real(value * value); };
    fx = real(camera.left.fx), fy = real(camera.left.fy), cx = real(camera.left.cx),
    cy = real(camera.left.cy);
    info_u = squared(1 / levels.sigma_flow_u_px);
    info_v = squared(1 / levels.sigma_flow_v_px);
    info_depth = levels.delta_d_px > 0 ? squared(camera.bf / levels.delta_d_px) : 0;
    info_curr = levels.delta_d_curr_px > 0 ? squared(camera.bf / levels.delta_d_curr_px) : 0;
    refine = levels.delta_d_px > 0;
    as_measured = levels.as_measured;
    quasi = levels.depth_noise == DepthErrors::depth;
    kind = kernel.kind;
    scale = real(kernel.scale);
  }
};

/// `both`: includes current depths.
template <typename Real, FlowDepthLoop loop, bool both>
SEXTANT_INLINED void loop_body(const LoopInput<Real>& d, NormalSums& sums) {
  using L = LanesOf<Real>;
  constexpr size_t width = LaneTypes<Real>::n;
  constexpr bool newton = loop == FlowDepthLoop::newton;
  constexpr bool summing = loop != FlowDepthLoop::points && loop != FlowDepthLoop::distances;
  constexpr bool rough = loop == FlowDepthLoop::rough;
  // Number of full depth steps before the last, linearised one.
  constexpr int last_step = rough ? 0 : loop == FlowDepthLoop::distances ? 1 : max_depth_steps<Real>;
  const RigidMotionOf<Real>& m = d.m;
  NormalLanes<Real> sum;
  const L zero = {};
  const L one = zero + Real(1);
  const Real scale2 = d.scale * d.scale;
  const Huber<Real> kernel(1, d.scale);
  for (size_t i = 0; i < d.n; i += width) {
    const L x = SEXTANT_LOAD(d.x + i);
    const L y = SEXTANT_LOAD(d.y + i);
    const L ax = m.r[0] * x + m.r[1] * y + m.r[2];
    const L ay = m.r[3] * x + m.r[4] * y + m.r[5];
    const L az = m.r[6] * x + m.r[7] * y + m.r[8];
    const L count = SEXTANT_LOAD(d.weight + i);
    const L tu = d.cx - SEXTANT_LOAD(d.target_u + i);
    const L tv = d.cy - SEXTANT_LOAD(d.target_v + i);
    const L sm = SEXTANT_LOAD(d.measured + i);
    const L cm = both ? SEXTANT_LOAD(d.measured_curr + i) : one;  // 1 if not measured
    const L inverse_sm = d.quasi ? one / sm : zero;
    const L inverse_cm = both && d.quasi ? one / cm : zero;
    const L info_curr = both ? d.info_curr * SEXTANT_LOAD(d.has_curr + i) : zero;
    const L info_depth = zero + d.info_depth;
    L s = d.refine && !d.as_measured ? SEXTANT_LOAD(d.refined + i) : sm;

    L iw, xn, yn, eu, ev, us, vs, c, cs, slope, slope_curr, curv, curv_curr;
    LaneMaskOf<Real> in_front;
    for (int step = 0;; ++step) {
      const L w = az + s * m.t[2];
      in_front = w > Real(min_depth_m) * s;
      iw = one / (in_front ? w : one);
      xn = (ax + s * m.t[0]) * iw;
      yn = (ay + s * m.t[1]) * iw;
      eu = d.fx * xn + tu;
      ev = d.fy * yn + tv;
      us = d.fx * (m.t[0] - xn * m.t[2]) * iw;
      vs = d.fy * (m.t[1] - yn * m.t[2]) * iw;
      c = s * iw;  // inverse depth in the current frame
      cs = az * iw * iw;
      // First and second derivatives of half the deviance.
      slope = info_depth * (s - sm) * (d.quasi ? s * inverse_sm : one);
      curv = info_depth * (d.quasi ? Real(2) * s * inverse_sm - Real(1) : one);
      curv = curv > Real(0.1) * info_depth ? curv : Real(0.1) * info_depth;
      slope_curr = curv_curr = zero;
      if constexpr (both) {
        slope_curr = info_curr * (c - cm) * (d.quasi ? c * inverse_cm : one);
        curv_curr = info_curr * (d.quasi ? Real(2) * c * inverse_cm - Real(1) : one);
        curv_curr = curv_curr > Real(0.1) * info_curr ? curv_curr : Real(0.1) * info_curr;
      }
      if (!d.refine || d.as_measured || step == last_step) break;
      const L second_over_first = Real(-2) * m.t[2] * iw;  // u''/u' = v''/v' = s'''/s''
      L along = eu * us * d.info_u + ev * vs * d.info_v;
      L gauss_newton = us * us * d.info_u + vs * vs * d.info_v + curv;
      if constexpr (both) {
        along += slope_curr * cs;
        gauss_newton += curv_curr * cs * cs;
      }
      const L first = along + slope;
      const L second = gauss_newton + second_over_first * along;
      const L next = s - first / (second > Real(0.3) * gauss_newton ? second : gauss_newton);
      const L low = Real(0.3) * s;
      const L high = Real(3) * s;
      const L moved = in_front ? (next < low ? low : (next > high ? high : next)) : s;
      const L change = moved - s;
      s = moved;
      if constexpr (last_step == max_depth_steps<Real>) {
        const LaneMaskOf<Real> moving =
            (count > zero) & (change * change * gauss_newton > last_depth_step2<Real>);
        typename LaneTypes<Real>::Integer any = 0;
        for (size_t k = 0; k < width; ++k) any |= moving[k];
        if (any == 0) step = last_step - 1;
      }
    }

    const L deviance =
        info_depth * (s - sm) * (s - sm) * (d.quasi ? (Real(2) * s + sm) * inverse_sm * Real(1.0 / 3) : one);
    L su = d.info_u * eu;
    L sv = d.info_v * ev;
    L q = su * eu + sv * ev + deviance;
    L h = d.refine ? d.info_u * us * us + d.info_v * vs * vs + curv : one;
    if constexpr (both) {
      q +=
          info_curr * (c - cm) * (c - cm) * (d.quasi ? (Real(2) * c + cm) * inverse_cm * Real(1.0 / 3) : one);
      if (d.refine) h += curv_curr * cs * cs;
    }
    const L ih = one / h;
    if (d.refine &&
        (d.as_measured || last_step < max_depth_steps<Real>)) {  // last step of s, in linearised form
      const L first = both ? su * us + sv * vs + slope + slope_curr * cs : su * us + sv * vs + slope;
      const L step = -first * ih;
      const L change = step < Real(-0.7) * s ? Real(-0.7) * s : (step > Real(2) * s ? Real(2) * s : step);
      q += change * (Real(2) * first + h * change);
      q = q > zero ? q : zero;
      su += d.info_u * us * change;
      sv += d.info_v * vs * change;
      if constexpr (both) slope_curr += curv_curr * cs * change;
      if (!d.as_measured) s = in_front ? s + change : s;
    }
    if (!summing || !d.as_measured) SEXTANT_STORE(d.refined + i, s);
    if constexpr (!summing) {
      SEXTANT_STORE(d.q + i, in_front ? q : zero + std::numeric_limits<Real>::infinity());
    }
    if constexpr (loop == FlowDepthLoop::points) {
      SEXTANT_STORE(d.error_u + i, eu);
      SEXTANT_STORE(d.error_v + i, ev);
      SEXTANT_STORE(d.slope_u + i, us);
      SEXTANT_STORE(d.slope_v + i, vs);
      SEXTANT_STORE(d.predicted_curr + i, c);
      SEXTANT_STORE(d.moved_x + i, xn);
      SEXTANT_STORE(d.moved_y + i, yn);
    }
    if constexpr (summing) {
      sum.behind += in_front ? zero : count;
      // Robust kernel, see robust_kernel.h.
      L weight = count;
      L rho = q;
      L bent = zero;
      if (d.kind == RobustKernel::Kind::huber) {
        const HuberAt<L> huber(kernel, q);
        weight = count * huber.weight;
        rho = huber.cost;
        bent = huber.inside ? zero : one / q;
      } else if (d.kind == RobustKernel::Kind::geman_mcclure) {
        const L share = scale2 / (scale2 + q);
        weight = count * share * share;
        rho = share * q;
        bent = Real(4) / (scale2 + q);
        if (!newton) bent = Real(3) * q > scale2 ? one / q : bent;
      }
      if constexpr (rough) bent = zero;
      sum.cost += count * rho;

      // Derivatives with respect to the point in the current frame, in units of its depth: T = [fx 0 -fx xn;
      // 0 fy -fy yn; 0 0 -c] are those of u', v', c; g = T^T s is the gradient, G = T^T W T the Hessian after
      // the Schur complement of s, with the kernel's curvature. The twist moves the point by T [c I | R], R =
      // -[xn yn 1]x.
      const L g0 = d.fx * su;
      const L g1 = d.fy * sv;
      const L gc = both ? c * slope_curr : zero;
      const L g2 = both ? -(xn * g0 + yn * g1 + gc) : -(xn * g0 + yn * g1);
      const L bu = d.refine ? d.fx * d.info_u * us : zero;
      const L bv = d.refine ? d.fy * d.info_v * vs : zero;
      const L bc = both && d.refine ? c * curv_curr * cs : zero;
      const L schur = newton ? zero : ih;
      const L wuu = weight * (d.fx * d.fx * d.info_u - schur * bu * bu - bent * g0 * g0);
      const L wuv = weight * (-schur * bu * bv - bent * g0 * g1);
      const L wvv = weight * (d.fy * d.fy * d.info_v - schur * bv * bv - bent * g1 * g1);
      L G02 = -(xn * wuu + yn * wuv);
      L G12 = -(xn * wuv + yn * wvv);
      L G22 = -(xn * G02 + yn * G12);
      if constexpr (both) {
        const L wuc = weight * (-schur * bu * bc - bent * g0 * gc);
        const L wvc = weight * (-schur * bv * bc - bent * g1 * gc);
        const L wcc = weight * (c * c * curv_curr - schur * bc * bc - bent * gc * gc);
        G22 += Real(2) * (xn * wuc + yn * wvc) + wcc;
        G02 -= wuc;
        G12 -= wvc;
      }
      if constexpr (newton) {  // u', v', c are nonlinear in the point
        G02 -= weight * g0;
        G12 -= weight * g1;
        G22 -= Real(2) * weight * g2;
      }
      const L K03 = yn * G02 - wuv, K04 = wuu - xn * G02, K05 = xn * wuv - yn * wuu;
      const L K13 = yn * G12 - wvv, K14 = wuv - xn * G12, K15 = xn * wvv - yn * wuv;
      const L K23 = yn * G22 - G12, K24 = G02 - xn * G22, K25 = xn * G12 - yn * G02;
      const L c2 = c * c;
      L h6[n_hessian] = {c2 * wuu,           c2 * wuv,       c2 * G02,       c * K03, c * K04, c * K05,  //
                         c2 * wvv,           c2 * G12,       c * K13,        c * K14, c * K15,           //
                         c2 * G22,           c * K23,        c * K24,        c * K25,                    //
                         yn * K23 - K13,     yn * K24 - K14, yn * K25 - K15,                             //
                         K04 - xn * K24,     K05 - xn * K25,                                             //
                         xn * K15 - yn * K05};
      if constexpr (newton) {
        // A rotation moves the point along a circle, and s moves it by e: mixed derivatives replace b.
        const L along = -iw / s;
        const L e0 = along * ax, e1 = along * ay, e2 = along * az;
        const L n0 = bu - g0 * e2;
        const L n1 = bv - g1 * e2;
        const L n2 = -(xn * bu + yn * bv + bc + g0 * e0 + g1 * e1 + Real(2) * g2 * e2);
        const L mixed[6] = {c * n0,
                            c * n1,
                            c * n2,
                            yn * n2 - n1 + e1 * g2 - e2 * g1,
                            n0 - xn * n2 + e2 * g0 - e0 * g2,
                            xn * n1 - yn * n0 + e0 * g1 - e1 * g0};
        const L second = h - Real(2) * m.t[2] * iw * (su * us + sv * vs + slope_curr * cs);
        const L share = weight / (second > Real(0.3) * h ? second : h);
        const L half = Real(0.5) * weight;
        h6[15] += weight * (g0 * xn + gc);
        h6[16] += half * (g0 * yn + g1 * xn);
        h6[17] += half * (g0 + g2 * xn);
        h6[18] += weight * (g1 * yn + gc);
        h6[19] += half * (g1 + g2 * yn);
        h6[20] += weight * (g2 + gc);
        int k = 0;
        for (int a = 0; a < 6; ++a) {
          const L scaled = d.refine ? share * mixed[a] : zero;
          for (int b = a; b < 6; ++b) h6[k++] -= scaled * mixed[b];
        }
      }
      for (int k = 0; k < n_hessian; ++k) sum.hessian[k] += h6[k];
      const L wc = weight * c;
      sum.gradient[0] += wc * g0;
      sum.gradient[1] += wc * g1;
      sum.gradient[2] += wc * g2;
      sum.gradient[3] += weight * (yn * g2 - g1);
      sum.gradient[4] += weight * (g0 - xn * g2);
      sum.gradient[5] += weight * (xn * g1 - yn * g0);
    }
  }
  if constexpr (summing) sum.store(sums);
}

// Function clones cannot be templates.
#define SEXTANT_LOOP(name, Real)                                                         \
  SEXTANT_SIMD void name##_##Real(const LoopInput<Real>& input, NormalSums& sums) {      \
    loop_body<Real, FlowDepthLoop::name, false>(input, sums);                            \
  }                                                                                      \
  SEXTANT_SIMD void name##_both_##Real(const LoopInput<Real>& input, NormalSums& sums) { \
    loop_body<Real, FlowDepthLoop::name, true>(input, sums);                             \
  }                                                                                      \
  void name(const LoopInput<Real>& input, NormalSums& sums) {                            \
    input.info_curr > 0 ? name##_both_##Real(input, sums) : name##_##Real(input, sums);  \
  }
SEXTANT_LOOP(distances, float)
SEXTANT_LOOP(distances, double)
SEXTANT_LOOP(points, float)
SEXTANT_LOOP(points, double)
SEXTANT_LOOP(rough, float)
SEXTANT_LOOP(rough, double)
SEXTANT_LOOP(gauss_newton, float)
SEXTANT_LOOP(gauss_newton, double)
SEXTANT_LOOP(newton, float)
SEXTANT_LOOP(newton, double)
#undef SEXTANT_LOOP

template <typename Real>
NormalSums run_loop(FlowDepthLoop loop, FlowDepthPoints<Real>& p, const SE3& T_curr_prev,
                    const NoiseLevels& levels, const RobustKernel& kernel) {
  NormalSums sums{};
  const LoopInput<Real> input(p, T_curr_prev, levels, kernel);
  switch (loop) {
    case FlowDepthLoop::distances:
      distances(input, sums);
      break;
    case FlowDepthLoop::points:
      points(input, sums);
      break;
    case FlowDepthLoop::rough:
      rough(input, sums);
      break;
    case FlowDepthLoop::gauss_newton:
      gauss_newton(input, sums);
      break;
    case FlowDepthLoop::newton:
      newton(input, sums);
      break;
  }
  return sums;
}

bool is_positive(const Matrix6d& hessian) { return Eigen::LLT<Matrix6d>(hessian).info() == Eigen::Success; }

FlowDepthLoop loop_of(Curvature curvature, const NoiseLevels& levels) {
  if (curvature == Curvature::rough) return FlowDepthLoop::rough;
  return curvature == Curvature::newton && !levels.as_measured ? FlowDepthLoop::newton
                                                               : FlowDepthLoop::gauss_newton;
}

template <typename Real>
void evaluate(FlowDepthLoop loop, FlowDepthPoints<Real>& data, const SE3& T_curr_prev,
              const NoiseLevels& levels) {
  run_loop(loop, data, T_curr_prev, levels, {});
  Real* q = data.column(FlowDepthPoints<Real>::squared_distance);
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.is_measurement(i)) q[i] = std::numeric_limits<Real>::infinity();
  }
}

}  // namespace

template <typename Real>
void evaluate_points(FlowDepthPoints<Real>& data, const SE3& T_curr_prev, const NoiseLevels& levels) {
  evaluate(FlowDepthLoop::points, data, T_curr_prev, levels);
}

void evaluate_distances(RoughFlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels) {
  evaluate(FlowDepthLoop::distances, data, T_curr_prev, levels);
}

template <typename Real>
NormalEquations accumulate(FlowDepthPoints<Real>& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                           const RobustKernel& kernel, Curvature curvature) {
  return equations_of(run_loop(loop_of(curvature, levels), data, T_curr_prev, levels, kernel));
}

std::optional<SE3> step_flow_depth(RoughFlowDepthData& data, const SE3& from, const NoiseLevels& levels,
                                   const RobustKernel& kernel, double* size) {
  const NormalEquations at = accumulate(data, from, levels, kernel, Curvature::rough);
  const Vector6d step = at.hessian.ldlt().solve(-at.gradient);
  if (!std::isfinite(at.cost) || !step.allFinite()) return std::nullopt;
  const SE3 to = SE3::exp(step) * from;
  if (size != nullptr) *size = step.cwiseAbs().maxCoeff();
  return to.is_finite() ? std::optional(to) : std::nullopt;
}

SolverResult descend(RoughFlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                     const RobustKernel& kernel, int max_iterations) {
  return minimize_on_se3([&](const SE3& X) { return accumulate(data, X, levels, kernel, Curvature::rough); },
                         start, {.max_iterations = max_iterations, .step_tolerance = 1e-5},
                         rounding_of_sums<float>);
}

namespace {

template <typename Real>
SolverResult minimize(FlowDepthPoints<Real>& data, const SE3& start, const NoiseLevels& levels,
                      const RobustKernel& kernel, const SolverOptions& options, const MotionPrior& prior,
                      double rounding) {
  return minimize_on_se3(
      [&](const SE3& X) {
        NormalEquations at = accumulate(data, X, levels, kernel, Curvature::newton);
        if (prior.holds()) add_prior(prior, X, at);
        at.is_exact = is_positive(at.hessian);
        if (!std::isfinite(at.cost) || at.is_exact) return at;
        at = accumulate(data, X, levels, kernel, Curvature::gauss_newton);
        if (prior.holds()) add_prior(prior, X, at);
        return at;
      },
      start, options, rounding);
}

}  // namespace

SE3 minimize_roughly(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                     const RobustKernel& kernel, const MotionPrior& prior) {
  constexpr size_t few = 300;  // a change of precision costs more than it saves
  if (data.size() < few) return start;
  RoughFlowDepthData rough(data);
  SE3 from = start;
  const auto minimize_some = [&](RoughFlowDepthData& some) {
    MotionPrior part = prior;
    part.precision *= static_cast<double>(some.size()) / static_cast<double>(data.size());
    // Newton's method leaves about the square of its last step (m, rad), which is enough for one last step in
    // double precision.
    const SolverResult close =
        minimize(some, from, levels, kernel, {.max_iterations = 10, .step_tolerance = 2e-3}, part,
                 rounding_of_sums<float>);
    if (!close.T_curr_prev.is_finite() || !std::isfinite(close.at_optimum.cost)) return false;
    from = close.T_curr_prev;
    return true;
  };
  constexpr size_t sample_size = 1000;
  if (data.size() >= 2 * sample_size) {
    RoughFlowDepthData some = rough.sample(sample_size);
    if (!minimize_some(some)) return start;
  }
  if (!minimize_some(rough)) return start;
  data.take_depths(rough);
  return from;
}

SolverResult minimize_flow_depth(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                                 const RobustKernel& kernel, const SolverOptions& options,
                                 const MotionPrior& prior) {
  return minimize(data, start, levels, kernel, options, prior, rounding_of_sums<double>);
}

template void evaluate_points(FlowDepthPoints<double>&, const SE3&, const NoiseLevels&);
template void evaluate_points(FlowDepthPoints<float>&, const SE3&, const NoiseLevels&);
template NormalEquations accumulate(FlowDepthPoints<double>&, const SE3&, const NoiseLevels&,
                                    const RobustKernel&, Curvature);
template NormalEquations accumulate(FlowDepthPoints<float>&, const SE3&, const NoiseLevels&,
                                    const RobustKernel&, Curvature);

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
