#pragma once

// `sextant compare`: two sides under a policy, and what came out as tables. docs/ci.md says it in words.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/gate/accuracy.h"
#include "sextant/eval/gate/speed.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct Comparison : AccuracyComparison {
  std::string base;  ///< path
  std::string fresh;
  std::vector<SpeedRow> speed;
  GateVerdict verdict = GateVerdict::invalid;
};

/// Bad input does not throw: it is a finding "input", and the verdict `invalid`.
Comparison compare_paths(const std::filesystem::path& base, const std::filesystem::path& fresh,
                         const Policy& policy, int jobs);

/// One line: "regressed: 2 of 54 errors worse, ...".
std::string headline(const Comparison& comparison);

/// The largest change and its interval: "camera Et_m of joint_flow: +10.2 % [8.1, 12.3] ...". Of errors pooled over sources,
/// worst verdict first; of the exact gate that of a row. Empty where no error changed.
std::string largest_change(const Comparison& comparison);

/// Rows in order of weight: worst verdict first. `changed_only` leaves out rows that are ok, but for those that changed and
/// are too few to judge.
Table findings_table(const Comparison& comparison);
Table family_table(const Comparison& comparison, bool changed_only);
Table accuracy_table(const Comparison& comparison, bool changed_only);
Table status_table(const Comparison& comparison);
Table speed_table(const Comparison& comparison, bool changed_only);

/// report.html of `sextant compare --out`: the verdict, what differs, the tables, and for every error that changed the
/// frame in which it changed most, with the line that shows both runs there and links to the records of both. The page
/// will lie in `out`. Frames are named where both sides are one folder with records each.
ReportDocument comparison_document(const Comparison& comparison, const std::filesystem::path& out);

/// Where a row was measured, in tables of one row a subject.
Fields<Subject> subject_fields();

/// The rows, worst first, otherwise in their order; `changed_only` as above.
template <typename Row>
std::vector<const Row*> by_weight(const std::vector<Row>& rows, bool changed_only) {
  std::vector<const Row*> sorted;
  for (const Row& row : rows) {
    bool is_shown = !changed_only || row.verdict != GateVerdict::ok;
    if constexpr (requires { row.too_few; }) is_shown = is_shown || row.too_few;
    if (is_shown) sorted.push_back(&row);
  }
  std::ranges::stable_sort(sorted, {}, [](const Row* row) { return row->verdict; });
  return sorted;
}

}  // namespace sextant
