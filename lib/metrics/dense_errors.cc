#include "sextant/metrics/dense_errors.h"

#include <cmath>
#include <limits>

namespace sextant {
namespace {

/// `rounding_px` is the error that the stored values have from rounding.
bool is_outlier(double error_px, double true_px, double rounding_px = 0) {
  return error_px > 3 + rounding_px && error_px > 0.05 * true_px + rounding_px;
}

double divided(double sum, int n) { return n > 0 ? sum / n : NAN; }

// Both structs store means; these functions convert sums to means and means back to sums.
DenseFlowError flow_means(const DenseFlowError& sum) {
  return {divided(sum.epe_px, sum.n),
          divided(sum.x_px, sum.n),
          divided(sum.y_px, sum.n),
          divided(sum.outlier_share, sum.n),
          sum.n,
          sum.n_truth,
          divided(sum.n, sum.n_truth)};
}

DenseDisparityError disparity_means(const DenseDisparityError& sum) {
  return {divided(sum.mean_px, sum.n),
          divided(sum.shift_px, sum.n - sum.n_outliers),
          divided(sum.n_outliers, sum.n),
          sum.n_outliers,
          sum.n,
          sum.n_truth,
          divided(sum.n, sum.n_truth)};
}

double summed(double mean, int n) { return n > 0 ? mean * n : 0; }

}  // namespace

DenseFlowError dense_flow_error(const Image<Flow>& estimate, const Image<Flow>& truth) {
  SEXTANT_CHECK(estimate.width() == truth.width() && estimate.height() == truth.height());
  DenseFlowError sum;
  for (size_t i = 0; i < truth.size(); ++i) {
    const Flow t = truth.data()[i];
    const Flow f = estimate.data()[i];
    if (!t.valid()) continue;
    ++sum.n_truth;
    if (!f.valid()) continue;
    const double du = double{f.u} - t.u;
    const double dv = double{f.v} - t.v;
    const double error = std::hypot(du, dv);
    ++sum.n;
    sum.epe_px += error;
    sum.x_px += std::abs(du);
    sum.y_px += std::abs(dv);
    sum.outlier_share += is_outlier(error, std::hypot(t.u, t.v));
  }
  return flow_means(sum);
}

DenseDisparityError dense_disparity_error(const Image<float>& depth_m, const Image<float>& true_depth_m,
                                          double bf) {
  SEXTANT_CHECK(depth_m.width() == true_depth_m.width() && depth_m.height() == true_depth_m.height());
  const auto usable = [](float z) { return std::isfinite(z) && z > 0; };
  DenseDisparityError sum;
  for (size_t i = 0; i < depth_m.size(); ++i) {
    const float t = true_depth_m.data()[i];
    const float z = depth_m.data()[i];
    if (!usable(t)) continue;
    ++sum.n_truth;
    if (!usable(z)) continue;
    const double shift = bf / z - bf / t;
    const double rounding_px = std::numeric_limits<float>::epsilon() * (bf / z + bf / t);
    const bool outlier = is_outlier(std::abs(shift), bf / t, rounding_px);
    ++sum.n;
    sum.mean_px += std::abs(shift);
    sum.n_outliers += outlier;
    if (!outlier) sum.shift_px += shift;
  }
  return disparity_means(sum);
}

DenseFlowError pooled(std::span<const DenseFlowError> images) {
  DenseFlowError sum;
  for (const DenseFlowError& e : images) {
    sum.epe_px += summed(e.epe_px, e.n);
    sum.x_px += summed(e.x_px, e.n);
    sum.y_px += summed(e.y_px, e.n);
    sum.outlier_share += summed(e.outlier_share, e.n);
    sum.n += e.n;
    sum.n_truth += e.n_truth;
  }
  return flow_means(sum);
}

DenseDisparityError pooled(std::span<const DenseDisparityError> images) {
  DenseDisparityError sum;
  for (const DenseDisparityError& e : images) {
    sum.mean_px += summed(e.mean_px, e.n);
    sum.shift_px += summed(e.shift_px, e.n - e.n_outliers);
    sum.n_outliers += e.n_outliers;
    sum.n += e.n;
    sum.n_truth += e.n_truth;
  }
  return disparity_means(sum);
}

DepthError depth_error(std::span<const Image<float>> estimates_m, std::span<const Image<float>> truths_m) {
  SEXTANT_CHECK(estimates_m.size() == truths_m.size());
  const auto usable = [](float z) { return std::isfinite(z) && z > 0; };
  DepthError e;
  for (size_t k = 0; k < truths_m.size(); ++k) {
    const Image<float>&estimate = estimates_m[k], &truth = truths_m[k];
    SEXTANT_CHECK(estimate.width() == truth.width() && estimate.height() == truth.height());
    for (size_t i = 0; i < truth.size(); ++i) {
      const double z = estimate.data()[i], t = truth.data()[i];
      if (!usable(truth.data()[i])) continue;
      ++e.n_truth;
      if (!usable(estimate.data()[i])) continue;
      ++e.n;
      e.mean_m += std::abs(z - t);
      e.rmse_m += (z - t) * (z - t);
      e.relative += std::abs(z - t) / t;
      e.bias += (z - t) / t;
      e.within_125 += std::max(z / t, t / z) < 1.25;
    }
  }
  const double n = e.n > 0 ? static_cast<double>(e.n) : NAN;
  e.mean_m /= n;
  e.rmse_m = std::sqrt(e.rmse_m / n);
  e.relative /= n;
  e.bias /= n;
  e.within_125 /= n;
  e.coverage = e.n_truth > 0 ? static_cast<double>(e.n) / static_cast<double>(e.n_truth) : NAN;
  return e;
}

}  // namespace sextant
