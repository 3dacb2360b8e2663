#pragma once

// The card of an estimator: its results on a suite, computed only from the records of its sweeps.
//
// Every number of a curve belongs to one track, one kind of body (camera or objects) and one level. It is
// pooled over the sequences and objects that the track counts, over all frame pairs and seeds:
//
//   coverage       share of the frame pairs with truth for which the estimator returned a motion
//   error          mean of E_t, E_R and (objects) E_v over the estimated pairs
//   best pairs     mean of E_t over the share `min_coverage` of the frame pairs with truth that has the
//                  smallest errors, of which pairs without a motion are the worst; none if coverage is lower
//   efficiency     RMS of the Cramer-Rao bounds of the track's metric / RMS of its errors, over pairs with a
//                  bound
//   ANEES          mean normalised error squared, if the estimator returns a covariance
//   interval       95 %, bootstrap over seeds, or over frame numbers with fewer than five seeds; that of the
//                  efficiency always over seeds

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/base/names.h"
#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/report/noise_level.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

// ---- Breakdown level of a curve of errors over the noise level: the smallest level above the nominal one at
// which the mean error is `error_ratio` times that of the nominal level, or at which coverage falls below
// `min_coverage` or to 0.
//
//   between levels   error and coverage are interpolated linearly in the level
//   interval         95 %, percentile bootstrap of the same function (stats/bootstrap.h); a cluster is a seed
//                    with its frame pairs at all levels, or, with fewer than min_seed_clusters seeds, a frame
//                    number with its pairs of all seeds and levels
//   no crossing      neither happens up to the highest level: `level` is the highest level, without a cause
//   nominal          coverage is below the limit already at the nominal level: `level` is the nominal level

/// Smallest number of seeds for a bootstrap over seeds; fewer seeds are too few clusters.
inline constexpr size_t min_seed_clusters = 5;

enum class BreakdownCause { none, error, coverage, nominal };
constexpr Names<4> names_of(BreakdownCause) { return {"none", "error", "coverage", "nominal"}; }

struct BreakdownLevel {
  double nominal = 0, highest = 0;
  BreakdownCause cause = BreakdownCause::none;
  double level = 0;
  std::optional<Interval> interval;  ///< an end at `highest` means at least that level

  /// Formats "0.41", or "> 0.8" without a crossing.
  std::string text() const;
  /// Formats "[0.38, > 0.8]"; empty without an interval.
  std::string interval_text() const;
};

/// Computes the breakdown level of a curve from the error with index `error` of its levels (at least one),
/// whose records all have truth.
BreakdownLevel breakdown_of(const std::map<double, NoiseLevel>& levels, size_t error, double nominal,
                            double error_ratio, double min_coverage);

// ---- The card.

/// One level of a curve.
struct CurvePoint {
  std::string estimator, track, body;
  double level = 0;
  bool is_nominal = false;
  int n_seeds = 0, n_truth = 0, n_estimated = 0;
  std::optional<IntervalEstimate> Et_m, ER_deg, Ev_kmh;
  std::optional<double> best_Et_m;  ///< mean E_t of the best pairs
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
  Json options = Json::object();     ///< all its options, as the plans record them
  std::string fingerprint;           ///< SHA-256 of the version of an estimator that is not part of Sextant
  std::vector<std::string> results;  ///< labels in records; several if one program gives several results
  Json program;                      ///< see program_identity()
  std::vector<CardSweep> sweeps;
  std::map<std::string, std::string> left_out;  ///< reason for each track that did not run
  std::vector<CurvePoint> curves;
  std::vector<Breakdown> breakdowns;
  std::vector<Cost> costs;
};

/// Name of the file with the tracks that were not run, as {"TRACK": "reason"}, in the folder of the sweeps.
inline constexpr const char* left_out_name = "left_out.json";

/// Reads left_out.json of the folder; empty if it does not exist.
std::map<std::string, std::string> left_out_of(const Suite& suite, const std::filesystem::path& folder);

/// Makes a card from the sweeps in FOLDER/<sweep>/ and from FOLDER/left_out.json. Throws Error if a sweep is
/// missing, unfinished, or one of several shards, if it has lost records, and if the sweeps are not of one
/// estimator with the same options and version.
Card make_card(const Suite& suite, const std::filesystem::path& folder);

/// Makes card.json. Everything except `costs` is independent of jobs, shards and interruptions.
Json to_json(const Card& card);
/// Parses card.json; throws Error "WHERE: ..." on anything that is not a card.
Card parse_card(std::string_view text, const std::string& where);
/// Reads FOLDER/card.json.
Card stored_card(const std::filesystem::path& folder);

/// Returns the suite `requested` (find_suite()) or, if that is empty, the suite of this program that the card
/// in `folder` names. Throws Error if the card belongs to another suite.
Suite suite_of(const Card& card, const std::string& requested, const std::filesystem::path& folder);
/// Throws Error if the card in `folder` belongs to another suite.
void check_suite(const Card& card, const Suite& suite, const std::filesystem::path& folder);

/// Returns sentences that a reader of the card's numbers must know: by its recorded options the estimator was
/// given the truth, or its errors are smaller than those of any estimate from noisy data.
std::vector<std::string> card_notes(const Card& card);

Table breakdown_table(const std::vector<Breakdown>& rows);
Table curve_table(const std::vector<CurvePoint>& rows);
Table cost_table(const std::vector<Cost>& rows);

// ---- Paired comparison of an estimator with a reference, track by track: the
// change of the mean error of the suite's metric over the frame pairs that both estimated. It is a ratio of
// means over sequences and bodies as strata, with seeds and frames as crossed clusters
// (stats/paired_comparison.h); p-values are corrected by Holm over all rows.

struct CardComparison {
  std::string estimator, track, body;
  double level = 0;
  int n_pairs = 0;            ///< frame pairs that both estimated
  double change_percent = 0;  ///< 100 (error of the estimator / error of the reference - 1)
  std::optional<Interval> interval_percent;
  std::optional<double> p, p_corrected;
};

/// Compares the results of a card with the only result of a reference. Throws Error if one of the cards
/// belongs to another suite or only one is of a quick run, if the reference has several results, or if they
/// have no case in common.
std::vector<CardComparison> compare_benchmarks(const Suite& suite, const std::filesystem::path& folder,
                                               const std::filesystem::path& reference);

Table comparison_table(const std::vector<CardComparison>& rows, const Suite& suite);

}  // namespace sextant
