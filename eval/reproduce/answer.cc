#include <algorithm>

#include "sextant/eval/reproduce/reproduce.h"

namespace sextant {
namespace {

/// Verdict of a claim in the summary: reproduced, reproduced in part, not reproduced, undecided or not
/// measured.
std::string verdict_of(const CheckedClaim& claim) { return claim_verdicts({claim}, "").front().verdict; }

std::string sentence(const std::string& begin, const std::vector<std::string>& items) {
  return items.empty() ? "" : fmt::format("{}: {}. ", begin, fmt::join(items, "; "));
}

}  // namespace

std::string answer_paragraph(const std::vector<CheckedClaim>& checked,
                             const std::vector<PaperLayout>& tables) {
  std::vector<std::string> holds, partly, differs;
  std::string why;
  for (const CheckedClaim& claim : checked) {
    const std::string verdict = verdict_of(claim);
    if (claim.claim->name == "gain_is_selection" && verdict == "reproduced") why = claim.claim->statement;
    if (claim.claim->brief.empty()) continue;
    if (verdict == "reproduced") holds.push_back(claim.claim->brief);
    if (verdict == "partly" || verdict == "undecided") partly.push_back(claim.claim->brief);
    if (verdict == "not reproduced") differs.push_back(claim.claim->brief);
  }
  size_t n_judged = 0, n_within = 0;
  std::vector<std::string> missing, fetch;
  for (const PaperLayout& table : tables) {
    bool is_missing = false;
    for (const LayoutRow& row : table.versions.front().rows) {
      for (const auto& cell : row.cells) {
        for (const LayoutValue& value : cell) {
          n_within += value.verdict.starts_with("within");
          n_judged += value.verdict.starts_with("within") || value.verdict.starts_with("outside");
          is_missing |= value.published && !value.measured;
        }
      }
    }
    if (!is_missing) continue;
    missing.push_back(table.number + (table.versions.front().n_measured > 0 ? " (part)" : ""));
    const std::string command = paper().table(table.number).fetch;
    if (std::ranges::find(fetch, command) == fetch.end()) fetch.push_back(command);
  }
  std::string text =
      sentence("Holds", holds) + sentence("Holds in part", partly) + sentence("Does not hold", differs);
  if (!why.empty()) text += fmt::format("Why Table III differs: {}. ", why);
  text += fmt::format("{} of {} comparable published values lie within the range of single runs. ", n_within,
                      n_judged);
  if (!missing.empty())
    text += fmt::format("Not measured: tables {}: {}, then sextant reproduce --data ROOT.",
                        fmt::join(missing, ", "), fmt::join(fetch, " and "));
  return text;
}

}  // namespace sextant
