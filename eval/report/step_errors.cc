#include "sextant/eval/report/step_errors.h"

#include <fmt/format.h>

#include "sextant/base/error.h"

namespace sextant {

std::string StepErrors::text() const {
  return fmt::format(
      "mean {:.4f} m (right {:.4f}, down {:.4f}, ahead {:.4f}), scatter {:.4f}, {:.4f}, {:.4f} m; drift to the right "
      "{:.2f} mm a frame",
      mean_m.norm(), mean_m.x(), mean_m.y(), mean_m.z(), scatter_m.x(), scatter_m.y(), scatter_m.z(),
      1000 * drift_m);
}

std::optional<StepErrors> step_errors(const std::vector<int>& frames,
                                      const std::vector<Eigen::Vector3d>& errors_m) {
  SEXTANT_CHECK(frames.size() == errors_m.size());
  if (errors_m.size() < 2) return std::nullopt;
  StepErrors out;
  out.n = static_cast<int>(errors_m.size());
  double mean_frame = 0;
  for (size_t i = 0; i < errors_m.size(); ++i) {
    out.mean_m += errors_m[i] / out.n;
    mean_frame += static_cast<double>(frames[i]) / out.n;
  }
  double squares = 0, products = 0;
  for (size_t i = 0; i < errors_m.size(); ++i) {
    const Eigen::Vector3d e = errors_m[i] - out.mean_m;
    const double along = frames[i] - mean_frame;
    out.scatter_m += e.cwiseAbs2() / (out.n - 1);
    squares += along * along;
    products += along * e.x();
  }
  out.scatter_m = out.scatter_m.cwiseSqrt();
  if (squares > 0) out.drift_m = products / squares;
  return out;
}

}  // namespace sextant
