#include "sextant/metrics/dense_errors.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sextant {
namespace {

bool is_outlier(double error_px, double true_px) { return error_px > 3 && error_px > 0.05 * true_px; }

double divided(double sum, int n) { return n > 0 ? sum / n : NAN; }

double median(std::vector<double>& values) {
  if (values.empty()) return NAN;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

}  // namespace

DenseFlowError dense_flow_error(const Image<Flow>& estimate, const Image<Flow>& truth) {
  SEXTANT_CHECK(estimate.width() == truth.width() && estimate.height() == truth.height());
  DenseFlowError sum;
  int n_truth = 0, n_outliers = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const Flow t = truth.data()[i];
    const Flow f = estimate.data()[i];
    if (!t.valid()) continue;
    ++n_truth;
    if (!f.valid()) continue;
    const double du = double{f.u} - t.u;
    const double dv = double{f.v} - t.v;
    const double error = std::hypot(du, dv);
    ++sum.n;
    sum.epe_px += error;
    sum.x_px += std::abs(du);
    sum.y_px += std::abs(dv);
    n_outliers += is_outlier(error, std::hypot(t.u, t.v));
  }
  return {divided(sum.epe_px, sum.n),
          divided(sum.x_px, sum.n),
          divided(sum.y_px, sum.n),
          divided(n_outliers, sum.n),
          sum.n,
          divided(sum.n, n_truth)};
}

DenseDisparityError dense_disparity_error(const Image<float>& depth_m, const Image<float>& true_depth_m,
                                          double bf) {
  SEXTANT_CHECK(depth_m.width() == true_depth_m.width() && depth_m.height() == true_depth_m.height());
  const auto usable = [](float z) { return std::isfinite(z) && z > 0; };
  std::vector<double> errors;
  double sum = 0;
  int n_truth = 0, n_outliers = 0;
  for (size_t i = 0; i < depth_m.size(); ++i) {
    const float t = true_depth_m.data()[i];
    const float z = depth_m.data()[i];
    if (!usable(t)) continue;
    ++n_truth;
    if (!usable(z)) continue;
    const double error = std::abs(bf / z - bf / t);
    errors.push_back(error);
    sum += error;
    n_outliers += is_outlier(error, bf / t);
  }
  const int n = static_cast<int>(errors.size());
  return {divided(sum, n), median(errors), divided(n_outliers, n), n, divided(n, n_truth)};
}

}  // namespace sextant
