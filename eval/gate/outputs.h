#pragma once

// Results of a comparison in formats for other programs. The tests check every format with a checker written
// from the format's own documentation.
//
//   comparison.md     for a pull request or a job summary: the rows that changed
//   comparison.json   everything, with every digit
//   junit.xml         a test per row; regressed: failure, invalid: error, inconclusive: skipped
//   bmf.json          Bencher Metric Format: NEW's means with intervals, times in ns as "latency"
//   github.json       github-action-benchmark, tool customSmallerIsBetter: the same numbers

#include <string>

#include "sextant/eval/gate/comparison.h"
#include "sextant/eval/records/output.h"

namespace sextant {

std::string comparison_markdown(const Comparison& comparison);
Json comparison_json(const Comparison& comparison, const Policy& policy);
/// `timestamp` as for comparison_files().
std::string comparison_junit(const Comparison& comparison, const std::string& timestamp);
Json comparison_bmf(const Comparison& comparison);
Json comparison_github(const Comparison& comparison, const Policy& policy);

/// Returns all of these files. `timestamp`: ISO 8601 in UTC without zone, "2026-01-31T12:00:00"; only JUnit
/// contains it.
OutputFiles comparison_files(const Comparison& comparison, const Policy& policy,
                             const std::string& timestamp);

/// Returns SOURCE_DATE_EPOCH if it is set, otherwise the current time, in that form.
std::string utc_timestamp();

}  // namespace sextant
