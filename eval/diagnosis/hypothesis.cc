#include "sextant/eval/diagnosis/hypothesis.h"

#include <cmath>

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

}  // namespace sextant
