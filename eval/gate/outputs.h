#pragma once

// Results of a comparison in formats for other programs. The tests check every format with a checker written
// from the format's own documentation.
//
//   comparison.md     for a pull request or a job summary: findings, errors that changed, and all times
//   comparison.json   everything, with every digit
//   junit.xml         a test per row; regressed: failure, invalid: error, inconclusive and too few: skipped
//   bmf.json          Bencher Metric Format: NEW's means with intervals, times in ns as "latency"
//   github.json       github-action-benchmark, tool customSmallerIsBetter: the same numbers, except errors of
//                     which lower is not better

#include <string>

#include "sextant/eval/gate/comparison.h"
#include "sextant/eval/records/output.h"

namespace sextant {

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
