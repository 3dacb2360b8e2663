#pragma once

// The card of an estimator: its results on a suite, computed only from the records of its sweeps.
//
// Every number of a curve belongs to one track, one kind of body (camera or objects) and one level. It is
// pooled over the sequences and objects that the track counts, over all frame pairs and seeds:
//
//   coverage       share of the frame pairs with truth for which the estimator returned a motion
//   error          mean of E_t, E_R and (objects) E_v over the estimated pairs
//   efficiency     RMS of the Cramer-Rao bounds of the track's metric / RMS of its errors, over pairs with a
//                  bound
//   ANEES          mean normalised error squared, if the estimator returns a covariance
//   interval       95 %, bootstrap over seeds, or over frame numbers with fewer than five seeds
//                  (breakdown.h); that of the efficiency always over seeds
//
// The breakdown level is defined in breakdown.h.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/benchmark/breakdown.h"
#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/report/noise_level.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// One level of a curve.
struct CurvePoint {
  std::string estimator, track, body;
  double level = 0;
  bool is_nominal = false;
  int n_seeds = 0, n_truth = 0, n_estimated = 0;
  std::optional<IntervalEstimate> Et_m, ER_deg, Ev_kmh;
  std::optional<IntervalEstimate> efficiency;
  std::optional<double> anees;
  std::optional<Interval> anees_expected;
  std::string records;  ///< file with its records, relative to the card

  double coverage() const { return static_cast<double>(n_estimated) / n_truth; }
};

struct Breakdown {
  std::string estimator, track, body;
  BreakdownLevel at;
};

/// Cost of a frame pair; it differs from run to run.
struct Cost {
  std::string estimator;
  std::optional<double> median_ms;       ///< median time of all bodies of a frame pair
  std::optional<double> peak_memory_mb;  ///< largest value over the pairs; external programs only
  std::string machine;
};

/// A finished sweep of a card.
struct CardSweep {
  std::string track, name;
  uint64_t n_cases = 0, n_records = 0;
  std::string records_sha256;  ///< hash of the records without times and memory (strip_times())
};

struct Card {
  std::string suite, suite_sha256;
  bool quick = false;
  std::string estimator;             ///< label of the estimator
  std::string plan_estimator;        ///< name in a plan: "joint_flow", "external:..."
  std::vector<std::string> results;  ///< labels in records; several if one program gives several results
  Json program;                      ///< see program_identity()
  std::vector<CardSweep> sweeps;
  std::map<std::string, std::string> left_out;  ///< reason for each track that did not run
  std::vector<CurvePoint> curves;
  std::vector<Breakdown> breakdowns;
  std::vector<Cost> costs;

  const CurvePoint* find_point(const std::string& result, const std::string& track, const std::string& body,
                               double level) const;
};

/// Name of the file with the tracks that were not run, as {"TRACK": "reason"}, in the folder of the sweeps.
inline constexpr const char* left_out_name = "left_out.json";

/// Makes a card from the sweeps in FOLDER/<sweep>/ and from FOLDER/left_out.json. Throws Error if a sweep is
/// missing, unfinished, or one of several shards.
Card make_card(const Suite& suite, const std::filesystem::path& folder);

/// Makes card.json. Everything except `costs` is independent of jobs, shards and interruptions.
Json to_json(const Card& card);
/// Parses card.json; throws Error "WHERE: ..." on anything that is not a card.
Card parse_card(std::string_view text, const std::string& where);

Table breakdown_table(const std::vector<Breakdown>& rows);
Table curve_table(const std::vector<CurvePoint>& rows);
Table cost_table(const std::vector<Cost>& rows);

}  // namespace sextant
