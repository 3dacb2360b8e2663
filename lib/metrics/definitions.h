#pragma once

// A preset bundles the definitions behind one column of a table: object frame, aggregate and velocity truth.
// Its name is printed in every table. The keys are those of a record's "errors" (docs/metrics.md).

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/base/options.h"

namespace sextant {

enum class Aggregate { mean, rmse };
constexpr Names<2> names_of(Aggregate) { return {"mean", "RMSE"}; }
/// Aggregate of finite values; throws InternalError on an empty span.
double aggregate(Aggregate how, std::span<const double> values);

struct MetricPreset {
  std::string name;
  std::string description;
  std::string object_Et_key;       ///< which recorded translation error, m
  std::string object_ER_key;       ///< which recorded rotation error, deg
  std::string velocity_key;        ///< which recorded velocity error, km/h
  std::string velocity_truth_key;  ///< which recorded true velocity, km/h ("values")
  Aggregate aggregate = Aggregate::mean;
  int version = 1;  ///< raised when the above change under the same name

  /// Under which key an object's record has what stands in the column of this metric: another one for those
  /// that the preset chooses, else the same.
  const std::string& object_key(const std::string& metric) const;
  /// An error that `aggregate` is for; all others are means.
  bool aggregates(const std::string& metric) const;
};

std::span<const MetricPreset> metric_presets();
const MetricPreset& find_preset(std::string_view name);

// Every number that a record can hold: the one list from which the summary, the tables of noise levels,
// comparisons and trends, their figures, the rules of the gate and the tables of docs/metrics.md follow. How
// to add one: compute it, add its line to the table in definitions.cc, and paste into docs/metrics.md the
// table that the test of the list asks for.
//
// The definitions of errors are written into the provenance of every run: numbers whose definitions differ
// must not be compared. Whoever changes what is computed under a name raises its version here, in the same
// commit.

/// The four maps of a record.
enum class NumberMap { errors, values, bound, time_ms };
/// "errors", ..
std::string_view to_string(NumberMap map);

/// `neither`: of the measurements or the scene, so no estimator can make it better; comparisons do not judge
/// it.
enum class Better { lower, higher, neither };

/// Where a number is shown or used besides its record; or-ed together.
enum MetricUse : unsigned {
  unused = 0,
  in_summary = 1,  ///< a column of a run's summary: the mean, or what the preset says (metrics/definitions.h)
  compared = 2,    ///< an error with a place in every table and figure of noise, comparisons and trends
  truth_only = 4,  ///< the truth alone decides it: where two runs differ in it, so do their data
  beside_speed = 8,    ///< in the summary over the pairs that have the preset's E_v
  recorded_only = 16,  ///< of trajectories that other systems recorded (`sextant reproduce`), not of runs
};

struct MetricDefinition {
  std::string name;  ///< key in its map: what it is, '_', its unit; others of no unit have the name alone
  NumberMap map;
  std::string body;    ///< "ego", "object" or "both"
  std::string symbol;  ///< in headings: "E_t"
  std::string unit;
  int digits;  ///< in tables; those with intervals have one more
  Better better;
  std::string definition;
  unsigned use = unused;
  int version = 1;

  bool is(MetricUse u) const { return (use & u) != 0; }
  /// "E_t [m]".
  std::string heading() const { return symbol + " [" + unit + "]"; }
  /// The name of a statistic of it: "Et_mean_m".
  std::string key(const std::string& statistic) const;
  /// Its name without the unit: "Et".
  std::string stem() const;
};

std::span<const MetricDefinition> metric_definitions();
/// Null where there is none.
const MetricDefinition* find_metric(NumberMap map, std::string_view name);
/// That of the list; throws InternalError where there is none.
const MetricDefinition& metric(NumberMap map, std::string_view name);
/// Those with this use, in order.
std::vector<const MetricDefinition*> metrics_for(MetricUse use);

/// The errors of a run: {"Et_m": "1: length of ... [m]", ..}
Json metric_definitions_json();

/// {"paper": "Et_m, ER_deg, Ev_kmh against v_gt_kmh, mean", ..}
Json metric_presets_json();

}  // namespace sextant
