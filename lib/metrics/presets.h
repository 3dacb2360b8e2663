#pragma once

// A preset bundles the definitions behind one column of a table: object frame, aggregate and velocity truth.
// Its name is printed in every table. The keys are those of a record's "errors" (docs/metrics.md).

#include <span>
#include <string>
#include <string_view>

#include "sextant/base/names.h"

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

}  // namespace sextant
