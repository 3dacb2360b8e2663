#include "sextant/eval/check/diagnosis.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/interrupt.h"
#include "sextant/base/parallel_for.h"

namespace sextant {
namespace {

constexpr double max_penalty = 6;
constexpr double lost = 3;      // a check that can no longer be made
constexpr double alike = 0.25;  // penalties that do not tell two hypotheses apart
constexpr size_t max_causes = 3;
constexpr double negligible = 0.002;  // of the limit: a residual not worth explaining
constexpr double taken_away = 0.1;    // of its residual is left to a sharp check whose cause is found

/// A hypothesis and what the checks say under it.
struct Trial {
  std::string cause;
  std::vector<Finding> findings;
  double penalty = 0;
};

/// Grows from 0 with the distance from passing, slower and slower.
double penalty(const Finding& before, const Finding& after) {
  if (!after.checkable()) return before.checkable() ? lost : 0;
  return std::min(max_penalty, std::log2(1 + after.ratio()) + (after.passes() ? 0 : 1));
}

Trial try_out(const Hypothesis<ConventionData>& hypothesis, const ConventionData& data, const std::vector<Finding>& before) {
  check_interrupt();
  ConventionData changed = data;
  double fitted = 0;
  if (!hypothesis.undo(changed, fitted)) return {};
  Trial trial{fmt::format(fmt::runtime(hypothesis.cause), fitted), check_conventions(changed),
              hypothesis.price};
  bool breaks_another = false;
  for (size_t i = 0; i < before.size(); ++i) {
    const Finding& after = trial.findings[i];
    trial.penalty += penalty(before[i], after);
    breaks_another |= after.fails() && !before[i].fails() && before[i].checkable();
  }
  if (breaks_another) trial.findings.clear();
  return trial;
}

std::string told(std::vector<const Trial*> fits) {
  std::ranges::stable_sort(fits, {}, &Trial::penalty);
  std::string causes;
  for (size_t i = 0; i < std::min(fits.size(), max_causes); ++i) {
    if (fits[i]->penalty > fits[0]->penalty + alike) break;
    causes += (i > 0 ? "; or: " : "") + fits[i]->cause;
  }
  return causes;
}

Diagnosis judge(size_t check, const std::vector<Finding>& findings, const std::vector<Trial>& trials) {
  const Finding& finding = findings[check];
  Diagnosis out{finding, finding.outcome(), ""};
  if (!finding.checkable()) return out;
  const bool passes = finding.passes();
  if (passes && (!finding.sharp || finding.ratio() < negligible)) return out;
  std::vector<const Trial*> fits, perfect;
  for (const Trial& trial : trials) {
    if (trial.findings.empty() || !trial.findings[check].passes()) continue;
    fits.push_back(&trial);
    if (*trial.findings[check].value < taken_away * *finding.value) perfect.push_back(&trial);
  }
  if (!passes) out.cause = fits.empty() ? "no known cause fits" : told(fits);
  if (!perfect.empty() && finding.sharp) {
    out.outcome = CheckOutcome::fail;
    out.cause = told(perfect);
  }
  return out;
}

}  // namespace

std::vector<Diagnosis> diagnose(const ConventionData& data, int jobs) {
  const std::vector<Finding> findings = check_conventions(data);
  const bool clean =
      std::ranges::all_of(findings, [](const Finding& f) { return f.passes() || !f.checkable(); });
  std::vector<Hypothesis<ConventionData>> table = hypotheses(data);
  if (clean) std::erase_if(table, [](const auto& h) { return h.fits_number; });
  std::vector<Trial> trials(table.size());
  parallel_for(static_cast<int>(table.size()), jobs, [&](int i) {
    const auto at = static_cast<size_t>(i);
    trials[at] = try_out(table[at], data, findings);
  });
  std::vector<Diagnosis> out;
  for (size_t i = 0; i < findings.size(); ++i) out.push_back(judge(i, findings, trials));
  return out;
}

}  // namespace sextant
