// Cost and normal equations of one rigid body, with the errors e_i = project(X m_i) - p_i - phi_i (px) of
// the points m_i = backproject(p_i, d_i), whose pixels p_i, depths d_i and flows phi_i come from
// extract_frame_pair() (points/extraction.cc):
//
//   C(X) = 1/2 sum_i h(e_i),  h: Huber's kernel with the scale s and the threshold k s (robust_kernel.h)
//
// X is perturbed from the left, X <- exp(xi) X; the Jacobians of the errors are analytic. The weight of an
// error in the Hessian is the second derivative of h / 2 by the error, instead of the usual re-weighting:
// I / s^2 for |e| <= k s, and k / (s |e|) (I - e e^T / |e|^2) beyond, which is positive semi-definite. The
// second derivatives of project() are left out.
//
// The steps are those of Levenberg and Marquardt (levenberg_marquardt.h). A step that moves a point behind
// the camera (nearer than 1 mm) has an infinite cost and is rejected. The iterations end when no component of
// a step reaches 1e-12 m or rad (option solver.step_tolerance), or when rounding hides any further progress:
// the motion is then a local optimum of C, whatever the details of the iterations. They also end after
// solver.max_iterations steps, or when no damping leads to a lower cost; the best motion so far is then the
// result.

#include "sextant/estimator/solvers/reprojection_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sextant/estimator/solvers/levenberg_marquardt.h"
#include "sextant/estimator/solvers/robust_kernel.h"

namespace sextant {
namespace {

/// Input of the loops: `n` points, starting at `begin`.
template <typename Real>
struct LoopInput {
  const Real *x, *y, *z, *target_u, *target_v, *weight;
  size_t n;
  RigidMotionOf<Real> m;
  Real fx, fy, cx, cy;

  LoopInput(const ReprojectionPoints<Real>& p, const SE3& motion, size_t begin, size_t count)
      : n(count), m(motion) {
    using P = ReprojectionPoints<Real>;
    x = p.column(P::x) + begin, y = p.column(P::y) + begin, z = p.column(P::z) + begin;
    target_u = p.column(P::target_u) + begin, target_v = p.column(P::target_v) + begin;
    weight = p.column(P::weight) + begin;
    const auto real = [](double value) { return static_cast<Real>(value); };
    fx = real(p.camera().fx), fy = real(p.camera().fy), cx = real(p.camera().cx), cy = real(p.camera().cy);
  }
};

/// Points i, i + 1 ... after motion and projection.
template <typename Real>
struct Projection {
  using L = LanesOf<Real>;
  LaneMaskOf<Real> in_front;
  L iz, xn, yn;  ///< inverse depth; x / z, y / z
  L eu, ev;      ///< e = project(X m) - target = -r

  SEXTANT_INLINED Projection(const LoopInput<Real>& d, size_t i) {
    const RigidMotionOf<Real>& m = d.m;
    const L one = L{} + Real(1);
    const L px = SEXTANT_LOAD(d.x + i);
    const L py = SEXTANT_LOAD(d.y + i);
    const L pz = SEXTANT_LOAD(d.z + i);
    const L qx = m.r[0] * px + m.r[1] * py + m.r[2] * pz + m.t[0];
    const L qy = m.r[3] * px + m.r[4] * py + m.r[5] * pz + m.t[1];
    const L qz = m.r[6] * px + m.r[7] * py + m.r[8] * pz + m.t[2];
    in_front = qz > Real(min_depth_m);
    iz = one / (in_front ? qz : one);
    xn = qx * iz;
    yn = qy * iz;
    eu = d.fx * xn + d.cx - SEXTANT_LOAD(d.target_u + i);
    ev = d.fy * yn + d.cy - SEXTANT_LOAD(d.target_v + i);
  }
};

template <typename Real>
SEXTANT_INLINED void add_up_lanes(const LoopInput<Real>& d, const Huber<Real>& kernel, NormalSums& sums) {
  using L = LanesOf<Real>;
  constexpr size_t width = LaneTypes<Real>::n;
  NormalLanes<Real> sum;
  const L zero = {};
  const L one = zero + Real(1);
  for (size_t i = 0; i < d.n; i += width) {
    const L w = SEXTANT_LOAD(d.weight + i);
    const Projection<Real> p(d, i);
    const L &iz = p.iz, &xn = p.xn, &yn = p.yn, &eu = p.eu, &ev = p.ev;
    sum.behind += p.in_front ? zero : w;
    const L n2 = eu * eu + ev * ev;
    const HuberAt<L> huber(kernel, n2);
    const L scale = w * huber.weight;
    const L radial = huber.inside ? zero : scale / n2;
    sum.cost += w * huber.cost;
    const L wuu = scale - radial * eu * eu;
    const L wuv = -radial * eu * ev;
    const L wvv = scale - radial * ev * ev;
    // Rows of d project(exp(xi) q) / d xi; ju[1] = jv[0] = 0.
    const L ju[6] = {d.fx * iz, zero, -d.fx * xn * iz, -d.fx * xn * yn, d.fx * (one + xn * xn), -d.fx * yn};
    const L jv[6] = {zero, d.fy * iz, -d.fy * yn * iz, -d.fy * (one + yn * yn), d.fy * xn * yn, d.fy * xn};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      const L wu = wuu * ju[a] + wuv * jv[a];
      const L wv = wuv * ju[a] + wvv * jv[a];
      sum.gradient[a] += scale * (eu * ju[a] + ev * jv[a]);
      for (int b = a; b < 6; ++b) sum.hessian[k++] += wu * ju[b] + wv * jv[b];
    }
  }
  sum.store(sums);
}

// Function clones cannot be templates.
SEXTANT_SIMD void sum_loop(const LoopInput<double>& d, const Huber<double>& kernel, NormalSums& sums) {
  add_up_lanes(d, kernel, sums);
}
SEXTANT_SIMD void sum_loop(const LoopInput<float>& d, const Huber<float>& kernel, NormalSums& sums) {
  add_up_lanes(d, kernel, sums);
}

SEXTANT_SIMD void squared_error_loop(const LoopInput<float>& d, float* errors) {
  using L = LanesOf<float>;
  for (size_t i = 0; i < d.n; i += LaneTypes<float>::n) {
    const Projection<float> p(d, i);
    const L behind = L{} + std::numeric_limits<float>::infinity();
    SEXTANT_STORE(errors + i, p.in_front ? p.eu * p.eu + p.ev * p.ev : behind);
  }
}

SEXTANT_SIMD void error_loop(const LoopInput<float>& d, float* eu, float* ev) {
  using L = LanesOf<float>;
  for (size_t i = 0; i < d.n; i += LaneTypes<float>::n) {
    const Projection<float> p(d, i);
    const L behind = L{} + std::numeric_limits<float>::infinity();
    SEXTANT_STORE(eu + i, p.in_front ? p.eu : behind);
    SEXTANT_STORE(ev + i, p.in_front ? p.ev : behind);
  }
}

std::vector<uint32_t> indices_of(const std::vector<unsigned char>& keep) {
  std::vector<uint32_t> indices;
  indices.reserve(keep.size());
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] != 0) indices.push_back(static_cast<uint32_t>(i));
  }
  return indices;
}

}  // namespace

void SolverOptions::check() const {
  check_option(max_iterations > 0, "max_iterations", max_iterations, "> 0");
  check_option(step_tolerance > 0, "step_tolerance", step_tolerance, "> 0");
}

template <typename Real>
ReprojectionPoints<Real>::ReprojectionPoints(const Problem& problem, std::span<const uint32_t> indices)
    : camera_(problem.camera.left),
      size_(indices.size()),
      padded_((size_ + LaneTypes<Real>::n - 1) / LaneTypes<Real>::n * LaneTypes<Real>::n),
      values_(std::make_unique_for_overwrite<Real[]>(n_columns * padded_)) {
  const Correspondences& p = problem.points;
  const double per_fx = 1 / camera_.fx;
  const double per_fy = 1 / camera_.fy;
  const auto put = [this](size_t to, double px, double py, double pz, double u, double v, double w) {
    column(x)[to] = static_cast<Real>(px);
    column(y)[to] = static_cast<Real>(py);
    column(z)[to] = static_cast<Real>(pz);
    column(target_u)[to] = static_cast<Real>(u);
    column(target_v)[to] = static_cast<Real>(v);
    column(weight)[to] = static_cast<Real>(w);
  };
  for (size_t k = 0; k < size_; ++k) {
    const size_t i = indices[k];
    put(k, (p.u[i] - camera_.cx) * per_fx * p.depth[i], (p.v[i] - camera_.cy) * per_fy * p.depth[i],
        p.depth[i], p.u[i] + p.flow_u[i], p.v[i] + p.flow_v[i], 1);
  }
  for (size_t k = size_; k < padded_; ++k) put(k, 0, 0, 1, 0, 0, 0);  // padding: a valid point of weight 0
}

template <typename Real>
ReprojectionPoints<Real>::ReprojectionPoints(const Problem& problem, const std::vector<unsigned char>& keep)
    : ReprojectionPoints(problem, indices_of(keep)) {
  SEXTANT_CHECK(keep.size() == problem.points.size());
}

template <typename Real>
NormalEquations accumulate(const ReprojectionPoints<Real>& data, const SE3& T_curr_prev,
                           const HuberKernel& kernel) {
  NormalSums sums{};
  const Huber<Real> huber(static_cast<Real>(kernel.sigma_px), static_cast<Real>(kernel.threshold));
  sum_loop({data, T_curr_prev, 0, data.padded_size()}, huber, sums);
  return equations_of(sums);
}

template <typename Real>
SolverResult minimize_reprojection(const ReprojectionPoints<Real>& data, const SE3& start,
                                   const HuberKernel& kernel, const SolverOptions& options) {
  return minimize_on_se3([&](const SE3& X) { return accumulate(data, X, kernel); }, start, options,
                         rounding_of_sums<Real>);
}

void reprojection_errors(const RoughReprojectionData& data, const SE3& T_curr_prev, std::vector<float>& eu,
                         std::vector<float>& ev) {
  eu.resize(data.padded_size());
  ev.resize(data.padded_size());
  error_loop({data, T_curr_prev, 0, data.padded_size()}, eu.data(), ev.data());
  for (std::vector<float>* errors : {&eu, &ev}) {
    std::fill(errors->begin() + static_cast<ptrdiff_t>(data.size()), errors->end(),
              std::numeric_limits<float>::infinity());
  }
}

int count_inliers(const RoughReprojectionData& data, const SE3& T_curr_prev, double threshold_px,
                  int at_least) {
  constexpr size_t block = 256;
  static_assert(block % LaneTypes<float>::n == 0);
  std::array<float, block> errors;
  const auto threshold2 = static_cast<float>(threshold_px * threshold_px);
  int count = 0;
  LoopInput<float> input(data, T_curr_prev, 0, 0);
  for (size_t begin = 0; begin < data.size(); begin += block) {
    input.n = std::min(block, data.padded_size() - begin);
    squared_error_loop(input, errors.data());
    for (const float** array : {&input.x, &input.y, &input.z, &input.target_u, &input.target_v})
      *array += block;
    const size_t real = std::min(input.n, data.size() - begin);
    for (size_t i = 0; i < real; ++i) count += errors[i] <= threshold2 ? 1 : 0;
    const auto seen = static_cast<double>(begin + real);
    const auto all = static_cast<double>(data.size());
    if (count + (all - seen) < at_least) break;
    // Points are in random order, so a model with at_least inliers has a binomial number of them among those
    // seen so far. The count ends if it is more than four standard deviations below the mean.
    const double share = at_least / all;
    if (seen < all && count < share * seen - 4.0 * std::sqrt(share * std::max(1.0 - share, 0.0) * seen))
      break;
  }
  return count;
}

#define SEXTANT_INSTANTIATE(Real)                                                                       \
  template class ReprojectionPoints<Real>;                                                              \
  template NormalEquations accumulate(const ReprojectionPoints<Real>&, const SE3&, const HuberKernel&); \
  template SolverResult minimize_reprojection(const ReprojectionPoints<Real>&, const SE3&,              \
                                              const HuberKernel&, const SolverOptions&);
SEXTANT_INSTANTIATE(double)
SEXTANT_INSTANTIATE(float)
#undef SEXTANT_INSTANTIATE

}  // namespace sextant
