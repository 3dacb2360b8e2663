#pragma once

// A benchmark suite: a frozen set of tracks, each of which is one or more ordinary sweeps
// (docs/benchmark.md). A suite is data, eval/suites/NAME.json; suite_test.cc pins the SHA-256 of each. A
// change of a suite is a new file with a new name, so that two cards of one suite always mean the same cases.
//
//   { "name": "sextant-1", "title": "..",
//     "metric": "Et_m",                                    // the error that defines the breakdown level: a
//                                                          // key of metrics/definitions.h, lower is better
//     "breakdown": {"error_ratio": 2, "min_coverage": 0.9},
//     "tracks": [
//       { "name": "depth", "title": "Depth noise",
//         "level": "disparity noise delta_d [px]",         // meaning of the numbers of its levels
//         "nominal": 0.2,                                  // level to whose errors those of the other
//                                                          // levels are compared; a level of the plans
//         "quick": [0.2, 0.8],                             // levels of a quick run, which has seed 0
//                                                          // only; all are levels of the plans
//         "objects": {"s18": [1, 2]},                      // objects that count, by sequence; without: all
//         "needs_data": false,                             // true: left out if its data are missing
//         "plans": {"depth": {"sources": [..], "noise": {..}, "seeds": 5, "options": {..}}} } ] }
//
// A plan has the keys "sources", "noise" (required), "seeds" and "options" of experiment/plan.h. The name of
// a plan is the name of its sweep's folder.

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/records/record.h"

namespace sextant {

/// One sweep of a track.
struct SuiteSweep {
  std::string name;
  Json plan;  ///< without "name" and "estimators"
};

/// Kinds of bodies that a card reports separately.
enum class BodyKind { camera, object };
constexpr Names<2> names_of(BodyKind) { return {"camera", "object"}; }

struct SuiteTrack {
  std::string name, title, level_title;
  double nominal = 0;
  std::vector<double> quick;
  bool needs_data = false;
  std::map<std::string, std::vector<int>>
      objects;  ///< objects that count, by sequence; empty: all that have truth
  std::vector<SuiteSweep> sweeps;

  /// Returns true if the track counts the record: it has truth, and its body is the camera or one of
  /// `objects`.
  bool counts(const Record& record) const;
};

struct Suite {
  std::string name, title;
  std::string metric;
  double error_ratio = 2;
  double min_coverage = 0.9;
  std::vector<SuiteTrack> tracks;
  std::string sha256;  ///< hash of the file

  /// Returns the symbol of the metric: "E_t".
  std::string symbol() const;
  /// Returns the condition of the breakdown level: "the mean of E_t is twice that of the nominal level, or
  /// coverage falls below 90 %".
  std::string breakdown_text() const;
  /// Returns the track of that name; throws Error that suggests the nearest one.
  const SuiteTrack& track(const std::string& name) const;
};

BodyKind kind_of(const Record& record);

/// Parses a suite; throws Error "NAME: ..." on anything that is not a suite, a name that ends with ".json",
/// an unknown metric, and a nominal or quick level that no plan of its track has.
Suite parse_suite(std::string_view text, const std::string& name);

/// Returns a suite that comes with the program. Throws Error on an unknown name, suggesting the nearest.
Suite own_suite(const std::string& name);
/// Reads a suite that the user names: own_suite(), or the file NAME.json.
Suite find_suite(const std::string& name);

/// Suffix of the names of all plans of a quick run.
inline constexpr const char* quick_ending = ", quick";

/// Returns the plan of one sweep for an estimator (an entry of "estimators" in a plan), as JSON text for
/// parse_plan(). `quick` keeps only seed 0 and the quick levels of the track; empty if no level
/// remains.
std::string plan_text(const Suite& suite, const SuiteTrack& track, const SuiteSweep& sweep,
                      const Json& estimator, bool quick);

}  // namespace sextant
