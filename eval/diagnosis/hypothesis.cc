#include "sextant/eval/diagnosis/hypothesis.h"

#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

constexpr double alike_times = 2;
constexpr size_t max_causes = 3;

}  // namespace

std::string listed(const std::vector<std::string>& items, size_t most) {
  const auto end = items.begin() + static_cast<std::ptrdiff_t>(std::min(most, items.size()));
  return fmt::format("{}{}", fmt::join(items.begin(), end, ", "), end == items.end() ? "" : ", ...");
}

std::string factor_text(double factor) {
  const bool too_small = factor > 0 && factor < 1;
  return fmt::format("too {} by a factor {:.4g}", too_small ? "small" : "large",
                     too_small ? 1 / factor : factor);
}

std::string cause_text(const std::string& cause, double fitted) {
  return fmt::format(fmt::runtime(cause), fitted, fmt::arg("factor", factor_text(fitted)));
}

std::optional<Explanation> explain(double declared, const std::vector<Reading>& all,
                                   const ExplanationRule& rule) {
  std::vector<Reading> readings = all;
  std::erase_if(readings, [&](const Reading& reading) {
    return reading.strictness > 1 && reading.strictness * rule.times * reading.residual > declared;
  });
  if (!(declared > rule.negligible) || readings.empty()) return std::nullopt;
  const auto least = std::ranges::min_element(readings, {}, &Reading::residual);
  // Residuals that overflow cannot be compared.
  if (!std::isfinite(declared) || !std::isfinite(least->residual)) return std::nullopt;
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

}  // namespace sextant
