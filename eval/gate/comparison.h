#pragma once

// `sextant compare`: the comparison of two sides under a policy, and its results as tables. docs/ci.md
// explains it.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/gate/accuracy.h"
#include "sextant/eval/gate/speed.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// Results of a comparison.
struct Comparison : AccuracyComparison {
  std::string base;   ///< path of BASE
  std::string fresh;  ///< path of NEW
  std::vector<SpeedRow> speed;
  GateVerdict verdict = GateVerdict::invalid;
};

/// Compares two paths. Bad input does not throw: it becomes a finding "input" with the verdict `invalid`.
Comparison compare_paths(const std::filesystem::path& base, const std::filesystem::path& fresh,
                         const Policy& policy, int jobs);

/// Formats one line: the verdict, the number of findings and errors by verdict, and what was compared, e.g.
/// "regressed: 2 pooled errors regressed, 1 errors improved (54 errors over 360 cases compared)".
std::string headline(const Comparison& comparison);

/// Formats the largest change with its interval, e.g. "camera Et_m of joint_flow: +10.2 % [+8.1, +12.3],
/// ...". Errors with the worst verdict come first. The errors pooled over sources are used; if none of them
/// changed, or in the exact gate, the rows. Empty if no error changed.
std::string largest_change(const Comparison& comparison);

/// Tables with the worst verdict first. `changed_only` leaves out pooled errors that did not change, and
/// errors and times of single subjects whose verdict is ok, unless they have too few seeds or cases to judge.
Table findings_table(const Comparison& comparison);
Table family_table(const Comparison& comparison, bool changed_only);
Table accuracy_table(const Comparison& comparison, bool changed_only);
Table status_table(const Comparison& comparison);
Table speed_table(const Comparison& comparison, bool changed_only);

/// Makes report.html of `sextant compare --out`: the verdict, the findings, the tables and, for the worst 40
/// errors that are not ok or have too few cases to judge, the frame of AccuracyRow::largest_change(), with
/// the command that shows both runs there and links to their records. `out` is the folder of the page. Frames
/// are listed only if BASE and NEW are folders that contain records.jsonl.
ReportDocument comparison_document(const Comparison& comparison, const std::filesystem::path& out);

}  // namespace sextant
