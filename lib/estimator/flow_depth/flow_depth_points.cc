#include "sextant/estimator/flow_depth/flow_depth_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sextant {
namespace {

constexpr size_t most_spare = 8;
constexpr size_t largest_spare = size_t{1} << 18;

template <typename Real>
struct SpareArray {
  size_t capacity;
  std::unique_ptr<Real[]> values;
};
/// Spare arrays of this thread. A variable of the function, because GCC 12 does not destroy a thread_local
/// variable template at the end of its thread.
template <typename Real>
std::vector<SpareArray<Real>>& spare_arrays() {
  thread_local std::vector<SpareArray<Real>> spare;
  return spare;
}

}  // namespace

template <typename Real>
ReusedArray<Real>::ReusedArray(size_t size) : capacity_(size) {
  std::vector<SpareArray<Real>>& spare = spare_arrays<Real>();
  auto best = spare.end();
  for (auto it = spare.begin(); it != spare.end(); ++it) {
    if (it->capacity >= size && (best == spare.end() || it->capacity < best->capacity)) best = it;
  }
  if (best == spare.end()) {
    values_ = std::make_unique_for_overwrite<Real[]>(size);
    return;
  }
  capacity_ = best->capacity;
  values_ = std::move(best->values);
  std::swap(*best, spare.back());
  spare.pop_back();
}

template <typename Real>
ReusedArray<Real>::~ReusedArray() {
  std::vector<SpareArray<Real>>& spare = spare_arrays<Real>();
  if (!values_ || capacity_ > largest_spare) return;
  if (spare.size() < most_spare) {
    spare.push_back({capacity_, std::move(values_)});
    return;
  }
  const auto smallest = std::min_element(
      spare.begin(), spare.end(), [](const auto& a, const auto& b) { return a.capacity < b.capacity; });
  if (smallest->capacity < capacity_) *smallest = {capacity_, std::move(values_)};
}

template <typename Real>
ReusedArray<Real>& ReusedArray<Real>::operator=(ReusedArray&& other) noexcept {
  std::swap(capacity_, other.capacity_);
  std::swap(values_, other.values_);
  return *this;
}

template class ReusedArray<double>;
template class ReusedArray<float>;

template <typename Real>
FlowDepthPoints<Real>::FlowDepthPoints(const StereoCamera& camera, size_t size)
    : camera_(camera),
      size_(size),
      padded_((size + LaneTypes<Real>::n - 1) / LaneTypes<Real>::n * LaneTypes<Real>::n),
      valid_(size, 0),
      share_curr_(size, 0),
      values_(n_columns * padded_) {
  for (int k = 0; k <= refined; ++k) {
    const bool is_depth = k == measured || k == measured_curr || k == refined;
    Real* const values = column(static_cast<Column>(k));
    std::fill(values + size_, values + padded_, Real(is_depth ? 1 : 0));
  }
}

template <typename Real>
FlowDepthPoints<Real>::FlowDepthPoints(const Problem& problem)
    : FlowDepthPoints(problem.camera, problem.points.size()) {
  const Correspondences& p = problem.points;
  const PinholeCamera& left = camera_.left;
  const double per_fx = 1 / left.fx;
  const double per_fy = 1 / left.fy;
  const auto real = [](double value) { return static_cast<Real>(value); };
  for (size_t i = 0; i < size_; ++i) {
    column(x)[i] = real((p.u[i] - left.cx) * per_fx);
    column(y)[i] = real((p.v[i] - left.cy) * per_fy);
    column(target_u)[i] = real(p.u[i] + p.flow_u[i]);
    column(target_v)[i] = real(p.v[i] + p.flow_v[i]);
    column(measured)[i] = real(1 / p.depth[i]);
    column(measured_curr)[i] = real(1 / p.depth_curr[i]);
    column(weight)[i] = column(has_curr)[i] = share_curr_[i] = valid_[i] = 1;
  }
  neutralise_invalid();
  reset_depths();
}

template <typename Real>
template <typename Other>
FlowDepthPoints<Real>::FlowDepthPoints(const FlowDepthPoints<Other>& other)
    : FlowDepthPoints(other.camera_, other.size_) {
  for (int k = 0; k <= refined; ++k) {
    const auto* from = other.column(static_cast<typename FlowDepthPoints<Other>::Column>(k));
    std::transform(from, from + size_, column(static_cast<Column>(k)),
                   [](Other value) { return static_cast<Real>(value); });
  }
  valid_ = other.valid_;
  std::transform(other.share_curr_.begin(), other.share_curr_.end(), share_curr_.begin(),
                 [](Other share) { return static_cast<Real>(share); });
  neutralise_invalid();
}

template <typename Real>
void FlowDepthPoints<Real>::neutralise_invalid() {
  const Real max = std::numeric_limits<Real>::max();
  LaneMaskOf<Real> valid_lanes = ~LaneMaskOf<Real>{};  // of all points
  for (size_t i = 0; i < padded_; i += LaneTypes<Real>::n) {
    for (const Column k : {target_u, target_v}) {
      const LanesOf<Real> target = SEXTANT_LOAD(column(k) + i);
      valid_lanes &= (target <= max) & (target >= -max);
    }
    for (const Column k : {measured, measured_curr}) {
      const LanesOf<Real> inverse = SEXTANT_LOAD(column(k) + i);
      valid_lanes &= (inverse > 0) & (inverse <= max);
    }
  }
  bool is_valid = true;
  for (size_t k = 0; k < LaneTypes<Real>::n; ++k) is_valid &= valid_lanes[k] != 0;
  if (is_valid) return;
  for (size_t i = 0; i < size_; ++i) {
    const Real inverse = column(measured)[i];
    const Real inverse_curr = column(measured_curr)[i];
    const bool valid = (valid_[i] != 0) & (std::abs(column(target_u)[i]) <= max) &
                       (std::abs(column(target_v)[i]) <= max) & (inverse > 0) &
                       (inverse <= max);  // false for NaN
    const bool valid_curr = valid & (share_curr_[i] > 0) & (inverse_curr > 0) & (inverse_curr <= max);
    if (!valid) {
      for (const Column k : {x, y, target_u, target_v}) column(k)[i] = 0;
      for (const Column k : {measured, refined}) column(k)[i] = 1;
    }
    if (!valid_curr) {
      column(measured_curr)[i] = 1;
      share_curr_[i] = 0;
    }
    valid_[i] = valid ? 1 : 0;
    use(i, used(i), uses_depth_curr(i));
  }
}

template <typename Real>
FlowDepthPoints<Real> FlowDepthPoints<Real>::sample(size_t size,
                                                    const std::vector<unsigned char>& among) const {
  const Real* const weights = column(weight);
  std::vector<uint32_t> counting(size_);
  size_t n = 0;
  for (size_t i = 0; i < size_; ++i) {
    const bool counts = (weights[i] > 0) & (among.empty() || (i < among.size() && among[i] != 0));
    counting[n] = static_cast<uint32_t>(i);
    n += counts ? 1 : 0;
  }
  const size_t stride = std::max<size_t>(n / size, 1);
  FlowDepthPoints out(camera_, (n + stride - 1) / stride);
  const auto take = [&](const Real* from, Real* to) {
    for (size_t i = 0, at = 0; i < out.size_; ++i, at += stride) to[i] = from[counting[at]];
  };
  std::fill(out.valid_.begin(), out.valid_.end(), 1);
  take(share_curr_.data(), out.share_curr_.data());
  for (const Column k : {x, y, target_u, target_v, measured, measured_curr, weight, has_curr, refined})
    take(column(k), out.column(k));
  return out;
}

template <typename Real>
size_t FlowDepthPoints<Real>::n_used() const {
  return static_cast<size_t>(
      std::count_if(column(weight), column(weight) + size_, [](Real w) { return w > 0; }));
}

template <typename Real>
void FlowDepthPoints<Real>::reset_depths() {
  std::copy_n(column(measured), padded_, column(refined));
}

template <typename Real>
PointDepths FlowDepthPoints<Real>::depths(size_t i, const NoiseLevels& levels) const {
  const auto root_information = [&](double delta_d_px) {
    return delta_d_px > 0 ? camera_.bf / delta_d_px : 0.0;
  };
  return {column(measured)[i], root_information(levels.delta_d_px), column(measured_curr)[i],
          std::sqrt(static_cast<double>(column(has_curr)[i])) * root_information(levels.delta_d_curr_px)};
}

template class FlowDepthPoints<double>;
template class FlowDepthPoints<float>;
template FlowDepthPoints<float>::FlowDepthPoints(const FlowDepthPoints<double>&);

}  // namespace sextant
