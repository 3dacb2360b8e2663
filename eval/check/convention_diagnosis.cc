#include <algorithm>
#include <cmath>

#include "sextant/base/interrupt.h"
#include "sextant/base/machine.h"
#include "sextant/eval/check/conventions.h"

namespace sextant {
namespace {

constexpr double max_penalty = 6;
constexpr double lost = 3;      // penalty of a check that is no longer possible
constexpr double alike = 0.25;  // difference of penalties that does not distinguish two hypotheses
constexpr size_t max_causes = 3;
constexpr double negligible = 0.002;  // share of the limit below which a residual needs no explanation
constexpr double taken_away = 0.1;  // remaining share of the residual of a sharp check whose cause was found
constexpr int min_sharp = 5;        // fewer samples may agree with a wrong cause by chance

/// A hypothesis and the results of the checks under it.
struct Trial {
  std::string cause;
  std::vector<Finding> findings;
  double penalty = 0;
  bool fits_number = false;
};

/// Returns the penalty of a check under a hypothesis: it grows with the ratio of value and limit at a
/// decreasing rate, by a step of 1 at the limit. Assumed sizes of objects can be wrong by as much as depth.
double penalty(const Finding& before, const Finding& after) {
  if (!after.checkable()) return before.checkable() ? lost : 0;
  if (after.sizes_assumed && after.passes()) return 0;
  return std::min(max_penalty, std::log2(1 + after.ratio()) + (after.passes() ? 0 : 1));
}

Trial try_out(const Hypothesis<ConventionData>& hypothesis, const ConventionData& data,
              const std::vector<Finding>& before) {
  check_interrupt();
  ConventionData changed = data;
  double fitted = 0;
  if (!hypothesis.undo(changed, fitted)) return {};
  Trial trial{cause_text(hypothesis.cause, fitted), check_conventions(changed), hypothesis.price,
              hypothesis.fits_number};
  bool breaks_another = false;
  for (size_t i = 0; i < before.size(); ++i) {
    const Finding& after = trial.findings[i];
    trial.penalty += penalty(before[i], after);
    breaks_another |= after.fails() && !before[i].fails() && before[i].checkable();
  }
  if (breaks_another) trial.findings.clear();
  return trial;
}

std::string causes_text(std::vector<const Trial*> fits) {
  std::ranges::stable_sort(fits, {}, &Trial::penalty);
  std::string causes;
  for (size_t i = 0; i < std::min(fits.size(), max_causes); ++i) {
    if (fits[i]->penalty > fits[0]->penalty + alike) break;
    causes += (i > 0 ? "; or: " : "") + fits[i]->cause;
  }
  return causes;
}

/// Returns true if another check that did not pass passes under the hypothesis.
bool explains_another(size_t check, const std::vector<Finding>& findings, const Trial& trial) {
  for (size_t i = 0; i < findings.size(); ++i) {
    const Finding& before = findings[i];
    if (i != check && before.checkable() && !before.passes() && trial.findings[i].passes()) return true;
  }
  return false;
}

Diagnosis judge(size_t check, const std::vector<Finding>& findings, const std::vector<Trial>& trials) {
  const Finding& finding = findings[check];
  Diagnosis out{finding, finding.outcome(), ""};
  if (!finding.checkable()) return out;
  if (!finding.cause.empty()) {
    out.cause = finding.cause;
    return out;
  }
  const bool passes = finding.passes(), sharp = finding.sharp && finding.n >= min_sharp;
  if (passes && (!sharp || finding.ratio() < negligible)) return out;
  std::vector<const Trial*> fits, perfect;
  for (const Trial& trial : trials) {
    if (trial.findings.empty() || !trial.findings[check].passes()) continue;
    if (finding.may_be_right && !explains_another(check, findings, trial)) continue;
    fits.push_back(&trial);
    // A number is fitted to the static flow; its effect on another check can be chance.
    if (trial.fits_number && finding.check != "static flow") continue;
    const Finding& after = trial.findings[check];
    const bool of_fewer = 2 * after.n < finding.n;  // what remains may be a part that was right before
    if (!of_fewer && *after.value < taken_away * *finding.value) perfect.push_back(&trial);
  }
  if (!passes && !fits.empty()) out.cause = causes_text(fits);
  if (!passes && fits.empty() && !finding.may_be_right) out.cause = no_known_cause;
  if (!perfect.empty() && sharp) {
    out.outcome = CheckOutcome::fail;
    out.cause = causes_text(perfect);
  }
  return out;
}

}  // namespace

std::vector<Diagnosis> diagnose(const ConventionData& data, int jobs) {
  const std::vector<Finding> findings = check_conventions(data);
  const std::vector<Hypothesis<ConventionData>> table = hypotheses(data);
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
