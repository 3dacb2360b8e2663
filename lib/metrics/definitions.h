#pragma once

// Metric presets. A preset selects the definitions of the object errors in a table: the frame of the motion,
// the aggregate and the definition of the true velocity. Its name is printed in every table. Keys are those
// of a record's "errors" unless noted otherwise (docs/metrics.md).

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/base/options.h"

namespace sextant {

enum class Aggregate { mean, rmse };
constexpr Names<2> names_of(Aggregate) { return {"mean", "RMSE"}; }

struct MetricPreset {
  std::string name;
  std::string description;
  std::string object_Et_key;       ///< key of the translation error, m
  std::string object_ER_key;       ///< key of the rotation error, deg
  std::string velocity_key;        ///< key of the velocity error, km/h
  std::string velocity_truth_key;  ///< key of the true velocity, km/h (in "values")
  Aggregate aggregate = Aggregate::mean;
  int version = 1;  ///< incremented when a field above changes under the same name

  /// Returns the key under which an object's record stores this metric: the preset's choice for the errors of
  /// translation, rotation and velocity and for the true velocity, `metric` itself for all others.
  const std::string& object_key(const std::string& metric) const;
  /// Returns true if `aggregate` applies to this metric; all others are averaged.
  bool aggregates(const std::string& metric) const;
};

std::span<const MetricPreset> metric_presets();
const MetricPreset& find_preset(std::string_view name);

// Definitions of every number that a record can contain. This list determines the columns of the summary, the
// tables of noise levels, comparisons and trends, their figures, the rules of the gate and the tables of
// docs/metrics.md. To add a number: compute it, add its line to the table in definitions.cc, and paste into
// docs/metrics.md the table that the test of the list prints.
//
// The definitions of errors are stored in the provenance of every run, because numbers with different
// definitions must not be compared. A commit that changes the computation under a name also increments its
// version here.

/// The four maps of a record.
enum class NumberMap { errors, values, bound, time_ms };
constexpr Names<4> names_of(NumberMap) { return {"errors", "values", "bound", "time_ms"}; }

/// Direction of improvement. `neither` marks a property of the measurements or of the scene, which no
/// estimator can improve; comparisons do not judge it.
enum class Better { lower, higher, neither };

/// Places where a number is shown or used besides its record; a bit mask.
enum MetricUse : unsigned {
  unused = 0,
  in_summary = 1,    ///< a column of a run's summary: the mean, or the preset's aggregate
  compared = 2,      ///< an error that appears in every table and figure of noise, comparisons and trends
  truth_only = 4,    ///< depends on the ground truth only: if two runs differ in it, so do their data
  beside_speed = 8,  ///< averaged in the summary only over pairs that have the preset's E_v
  /// computed for trajectories recorded by other systems (`sextant reproduce`), not for runs
  recorded_only = 16,
};

struct MetricDefinition {
  std::string name;  ///< key in its map: quantity, '_', unit; without a suffix if dimensionless
  NumberMap map;
  std::string body;    ///< "ego", "object" or "both"
  std::string symbol;  ///< in headings: "E_t"
  std::string unit;
  int digits;  ///< decimals in tables; numbers with intervals get one more
  Better better;
  std::string definition;
  unsigned use = unused;
  int version = 1;

  bool is(MetricUse u) const { return (use & u) != 0; }
  /// Returns "E_t [m]".
  std::string heading() const { return symbol + " [" + unit + "]"; }
  /// Returns the key of one of its statistics: "Et_mean_m".
  std::string key(const std::string& statistic) const;
  /// Returns the name without its unit: "Et".
  std::string stem() const;
};

std::span<const MetricDefinition> metric_definitions();
/// Returns the definition of the metric `name`; null if there is none.
const MetricDefinition* find_metric(NumberMap map, std::string_view name);
/// Returns the definition of the metric `name`; throws InternalError if there is none.
const MetricDefinition& metric(NumberMap map, std::string_view name);
/// Returns the definitions with this use, in the order of the list.
std::vector<const MetricDefinition*> metrics_for(MetricUse use);

/// Returns the version, definition and unit of each error of a run, without the recorded_only ones:
/// {"Et_m": "1: translation of the pose ... [m]", ..}.
Json metric_definitions_json();

/// Returns the keys and the aggregate of each preset:
/// {"paper": "Et_m, ER_deg, Ev_kmh against v_gt_kmh, mean", ..}; the text of a preset with another version
/// than 1 begins with "VERSION: ".
Json metric_presets_json();

}  // namespace sextant
