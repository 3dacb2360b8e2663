#pragma once

// How near the estimates of one noise level come to the limit (docs/metrics.md, "The limit"):
//
//   bound        RMS of the records' bounds
//   efficiency   bound / RMS of the errors of the same records; its interval from the bootstrap of that RMS
//   ANEES        mean of the records' NEES, and where that of a consistent estimator lies (stats/trend.h)

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_level.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct Efficiency {
  double bound = 0;  ///< unit of the error
  double efficiency = 0;
  std::optional<Interval> interval;  ///< of the efficiency, 95 %; none with one seed
};

struct Consistency {
  double anees = 0;
  Interval expected;  ///< 95 %
  int n = 0;
};

struct LimitSummary {
  std::map<std::string, Efficiency> efficiency;  ///< by error; those of bounded_errors() that records have
  std::optional<Consistency> consistency;
};

/// The compared errors that have a bound.
std::vector<const MetricDefinition*> bounded_errors();

/// Of the estimated records of one body, estimator and level. What no record has is none.
LimitSummary summarize_limit(const NoiseLevel& level, const BootstrapOptions& options);
LimitSummary summarize_limit(const RecordRefs& estimated, const BootstrapOptions& options);

/// The limit's columns of a noise table, and their cells.
std::vector<Column> limit_columns();
void add_limit_cells(const LimitSummary& limit, std::vector<Cell>& cells);

}  // namespace sextant
