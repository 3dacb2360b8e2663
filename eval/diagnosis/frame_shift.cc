#include "sextant/eval/diagnosis/frame_shift.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sextant/base/quantile.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

constexpr size_t fewest_frames = 8, fewest_of_body = 8, most_stretches = 10;

/// Errors and changes over one shift.
struct ShiftFit {
  std::vector<const StepError*> steps;
  std::vector<Vector6d> changes;

  /// Scatter of each component of e - share d by body; with `around_median`, that around the body's median.
  std::map<int, Vector6d> scatter(double share, bool around_median = false) const {
    std::map<int, std::array<std::vector<double>, 6>> values;
    for (size_t i = 0; i < steps.size(); ++i) {
      const Vector6d left = steps[i]->error - share * changes[i];
      for (int c = 0; c < 6; ++c) values[steps[i]->body][static_cast<size_t>(c)].push_back(left[c]);
    }
    constexpr double sigma_of_median = 1.4826, rounding = 1e-9;
    std::map<int, Vector6d> out;
    for (auto& [body, of_body] : values) {
      if (of_body[0].size() < fewest_of_body) continue;
      for (int c = 0; c < 6; ++c) {
        std::vector<double>& sizes = of_body[static_cast<size_t>(c)];
        const double centre = around_median ? upper_median(sizes) : 0;
        for (double& size : sizes) size = std::abs(size - centre);
        out[body][c] = std::max(rounding, sigma_of_median * upper_median(sizes));
      }
    }
    return out;
  }

  /// Negative log likelihood of normally distributed errors e - share d, with their own scatter.
  double cost(double share, bool around_median = false) const {
    double sum = 0;
    const std::map<int, Vector6d> scale = scatter(share, around_median);
    for (const StepError* step : steps) {
      if (const auto at = scale.find(step->body); at != scale.end()) sum += at->second.array().log().sum();
    }
    return sum;
  }

  std::optional<FrameShift> fit(const std::map<int, size_t>& stretch_of_frame, size_t n_stretches) const {
    constexpr double huber = 2;
    constexpr int n_rounds = 8;
    double share = cost(1) < cost(0) ? 1 : 0, d_e = 0, d_d = 0;
    std::vector<double> along, across;
    for (int round = 0; round < n_rounds; ++round) {
      const std::map<int, Vector6d> scale = scatter(share);
      along.assign(n_stretches, 0);
      across.assign(n_stretches, 0);
      for (size_t i = 0; i < steps.size(); ++i) {
        const auto at = scale.find(steps[i]->body);
        if (at == scale.end()) continue;
        const size_t stretch = stretch_of_frame.at(steps[i]->frame);
        for (int c = 0; c < 6; ++c) {
          const double d = changes[i][c] / at->second[c], e = steps[i]->error[c] / at->second[c];
          const double left = std::abs(e - share * d), weight = left > huber ? huber / left : 1;
          along[stretch] += weight * d * e;
          across[stretch] += weight * d * d;
        }
      }
      d_e = d_d = 0;
      for (size_t s = 0; s < n_stretches; ++s) {
        d_e += along[s];
        d_d += across[s];
      }
      if (!(d_d > 0)) return std::nullopt;
      share = d_e / d_d;
    }
    double squares = 0;
    for (size_t s = 0; s < n_stretches; ++s) {
      if (!(d_d - across[s] > 0)) return std::nullopt;
      const double without = (d_e - along[s]) / (d_d - across[s]);
      squares += (without - share) * (without - share);
    }
    const auto n = static_cast<double>(n_stretches);
    return FrameShift{0, share, std::sqrt(squares * (n - 1) / n), 0};
  }
};

/// Standard errors that exclude chance: 5 with ten stretches, and as many more with fewer as Student's t has.
double standard_errors_needed(size_t n_stretches) {
  static const double chance = student_t_cdf(-5, static_cast<int>(most_stretches) - 1);
  return -student_t_quantile(chance, static_cast<int>(n_stretches) - 1);
}

}  // namespace

Vector6d step_numbers(const SE3& error) {
  Vector6d numbers;
  numbers << error.translation(), so3_log(error.rotation());
  return numbers;
}

std::string FrameShift::text() const {
  return fmt::format(
      "; the errors contain {:.2f} +- {:.2f} of the change over these frames (1 for shifted, 0 for right "
      "frame numbers)",
      share, standard_error);
}

std::optional<FrameShift> find_frame_shift(const std::vector<StepError>& all) {
  constexpr double half = 0.5, near_one = 0.3, much_better = 1;
  std::optional<FrameShift> best;
  for (const int n : frame_shifts) {
    ShiftFit fit;
    std::set<int> frames;
    for (const StepError& step : all) {
      const auto change = step.of_shift.find(n);
      if (change == step.of_shift.end()) continue;
      fit.steps.push_back(&step);
      fit.changes.push_back(change->second);
      frames.insert(step.frame);
    }
    if (frames.size() < fewest_frames) continue;
    const size_t n_stretches = std::min(most_stretches, frames.size() / 2);
    std::map<int, size_t> stretch_of_frame;
    for (const int frame : frames) {
      const size_t rank = stretch_of_frame.size();
      stretch_of_frame.emplace(frame, rank * n_stretches / frames.size());
    }
    auto found = fit.fit(stretch_of_frame, n_stretches);
    if (!found || std::abs(found->share - 1) > near_one ||
        found->share - half < standard_errors_needed(n_stretches) * found->standard_error)
      continue;
    // Different shifts have different numbers of steps with a change, so the mean gain per step over
    // unshifted numbers decides.
    const auto n_steps = static_cast<double>(fit.steps.size());
    const double cost_change = (fit.cost(1) - fit.cost(0)) / n_steps;
    const double change_of_constant = (fit.cost(0, /*around_median=*/true) - fit.cost(0)) / n_steps;
    if (change_of_constant < cost_change - much_better) continue;
    if (best && cost_change >= best->cost_change) continue;
    found->cost_change = cost_change;
    found->frames = n;
    best = found;
  }
  return best;
}

}  // namespace sextant
