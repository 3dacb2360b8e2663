#include "sextant/eval/diagnosis/hypothesis.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sextant/base/quantile.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

constexpr double alike_times = 2;
constexpr size_t max_causes = 3;

}  // namespace

std::optional<Explanation> explain(double declared, const std::vector<Reading>& all,
                                   const ExplanationRule& rule) {
  std::vector<Reading> readings = all;
  std::erase_if(readings, [&](const Reading& reading) {
    return reading.strictness > 1 && reading.strictness * rule.times * reading.residual > declared;
  });
  if (!(declared > rule.negligible) || readings.empty()) return std::nullopt;
  const auto least = std::ranges::min_element(readings, {}, &Reading::residual);
  const auto explains = [&](double residual) {
    return rule.times * residual <= declared && (!rule.null || rule.times * residual <= *rule.null);
  };
  if (!explains(least->residual)) return std::nullopt;
  Explanation out{{}, {}, declared};
  // A residual below a millionth of the declared one is exact up to rounding.
  const double alike = std::max(alike_times * least->residual, 1e-6 * declared);
  for (const Reading& reading : readings) {
    if (reading.residual <= alike && explains(reading.residual)) out.alike.push_back(reading);
  }
  std::ranges::stable_sort(out.alike, {}, &Reading::price);
  out.best = out.alike.front();
  out.alike.erase(out.alike.begin());
  return out;
}

std::string message(const Explanation& explanation, const std::string& subject, const std::string& unit) {
  const Reading& best = explanation.best;
  std::string text =
      fmt::format("{}: {} (RMS residual {:.3g} {} read so, {:.3g} {} as declared)", subject, best.cause,
                  std::sqrt(best.residual), unit, std::sqrt(explanation.declared), unit);
  if (!best.remedy.empty()) text += ": " + best.remedy;
  for (size_t i = 0; i < explanation.alike.size() && i + 1 < max_causes; ++i)
    text += "; or: " + explanation.alike[i].cause;
  return text;
}

bool Explanation::allows(const std::string& code) const {
  return best.code == code || std::ranges::find(alike, code, &Reading::code) != alike.end();
}

std::vector<ObjectExplanation> group_by_reading(std::map<int, Explanation> of_object, size_t n_all) {
  std::vector<ObjectExplanation> out;
  while (!of_object.empty()) {
    std::map<std::string, size_t> objects;  // code -> objects that it explains
    for (const auto& [id, explanation] : of_object) {
      ++objects[explanation.best.code];
      for (const Reading& reading : explanation.alike) ++objects[reading.code];
    }
    // Among readings that explain equally many objects, the reported reading of the first object is taken.
    const auto n_explained = [&](const auto& at) { return objects.at(at.second.best.code); };
    const auto most = std::ranges::max_element(of_object, {}, n_explained);
    ObjectExplanation group{{}, false, most->second};
    for (const auto& [id, explanation] : of_object) {
      if (explanation.allows(group.code())) group.objects.push_back(id);
    }
    for (const int id : group.objects) of_object.erase(id);
    group.of_all = group.objects.size() == n_all;
    out.push_back(std::move(group));
  }
  return out;
}

std::string ObjectExplanation::text(const std::string& subject) const {
  if (of_all) return message(explanation, subject, "m");
  return message(
      explanation,
      fmt::format("{} of object{} {}", subject, objects.size() > 1 ? "s" : "", fmt::join(objects, ", ")),
      "m");
}

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
        const double centre = around_median ? middle_of(sizes) : 0;
        for (double& size : sizes) size = std::abs(size - centre);
        out[body][c] = std::max(rounding, sigma_of_median * middle_of(sizes));
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

Explanation FrameShift::explanation(Reading read, double declared) const {
  read.cause += fmt::format(
      "; the errors contain {:.2f} +- {:.2f} of the change over these frames (1 for shifted, 0 for right "
      "frame numbers)",
      share, standard_error);
  return {std::move(read), {}, declared};
}

std::optional<FrameShift> find_frame_shift(const std::vector<StepError>& all) {
  constexpr double half = 0.5, near_one = 0.3, much_better = 1;
  std::optional<FrameShift> best;
  for (int n = -longest_shift; n <= longest_shift; ++n) {
    if (n == 0) continue;
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
