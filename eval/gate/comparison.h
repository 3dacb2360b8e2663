#pragma once

// `sextant compare`: the comparison of two sides under a policy, and its results as tables. docs/ci.md
// explains it.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/gate/accuracy.h"
#include "sextant/eval/gate/speed.h"
#include "sextant/eval/records/output.h"
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
/// "regressed: 2 pooled errors regressed, 1 errors improved (54 errors over 360 records compared)".
std::string headline(const Comparison& comparison);

/// Formats the largest change with its interval, e.g. "camera Et_m of joint_flow: +10.2 % [+8.1, +12.3],
/// ...". Errors with the worst verdict come first. The errors pooled over sources are used; if none of them
/// changed, or in the exact gate, the rows. Empty if no error changed.
std::string largest_change(const Comparison& comparison);

/// Tables with the worst verdict first. `changed_only` leaves out pooled errors that did not change, and
/// errors and times of single subjects whose verdict is ok, unless they have too few seeds or records to
/// judge.
Table findings_table(const Comparison& comparison);
Table family_table(const Comparison& comparison, bool changed_only);
Table accuracy_table(const Comparison& comparison, bool changed_only);
Table status_table(const Comparison& comparison);
Table speed_table(const Comparison& comparison, bool changed_only);

/// Makes report.html of `sextant compare --out`: the verdict, the findings, the tables and, for the worst 40
/// errors that are not ok or have too few records to judge, the frame of AccuracyRow::largest_change(), with
/// the command that shows both runs there and links to their records. `out` is the folder of the page. Frames
/// are listed only if BASE and NEW are folders that contain records.jsonl.
ReportDocument comparison_document(const Comparison& comparison, const std::filesystem::path& out);

// ---- Results of a comparison in formats for other programs (outputs.cc). The tests check every format with
// a checker written from the format's own documentation.
//
//   comparison.md     for a pull request or a job summary: findings, errors that changed, and all times
//   comparison.json   everything, with every digit
//   junit.xml         a test per row; regressed: failure, invalid: error, inconclusive and too few: skipped
//   bmf.json          Bencher Metric Format: NEW's means with intervals, times in ns as "latency"
//   github.json       github-action-benchmark, tool customSmallerIsBetter: the same numbers, except errors of
//                     which lower is not better

std::string comparison_markdown(const Comparison& comparison);
Json comparison_json(const Comparison& comparison, const Policy& policy);
/// Returns junit.xml. `timestamp` as for comparison_files().
std::string comparison_junit(const Comparison& comparison, const std::string& timestamp);
Json comparison_bmf(const Comparison& comparison);
Json comparison_github(const Comparison& comparison, const Policy& policy);

/// Returns the five files listed above. `timestamp`: ISO 8601 in UTC without zone, "2026-01-31T12:00:00";
/// only junit.xml contains it.
OutputFiles comparison_files(const Comparison& comparison, const Policy& policy,
                             const std::string& timestamp);

/// Returns the time of the environment variable SOURCE_DATE_EPOCH (seconds since 1970) if it is set,
/// otherwise the current time, as "2026-01-31T12:00:00" in UTC. Throws Error if the variable is not such a
/// number, or is beyond the year 9999.
std::string utc_timestamp();

}  // namespace sextant
