#pragma once

// Times. A sample is one repetition: of Google Benchmark each repetition of a benchmark; of runs each folder,
// as the median over its cases of time / time in the first folder of BASE, per estimator and sequence. All
// is done on logarithms, so effects are ratios new / base:
//
//   ratio       exp of Hodges-Lehmann's shift (median of all log new - log base), with its 95 % interval from
//               the order statistics that Mann-Whitney's test does not reject
//   p           Mann-Whitney, two-sided; cliffs_delta: P(new slower) - P(new faster)
//   detectable  smallest ratio that so many repetitions find with probability 80 %
//
// `regressed`: the whole interval lies above 1 + minimum_effect; `improved`: below 1 / (1 + minimum_effect).
// `inconclusive`: the ratio lies above 1 + minimum_effect, but its interval does not: repeat. Without
// repetitions (or with fewer than the test needs, 4 on each side) there is no interval: `inconclusive` where
// it is slower, `improved` where it is faster by unrepeated_effect. The times of runs are wall-clock: of them
// nine of ten cases must be.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/sameness.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct SpeedRow {
  std::string name;  ///< of the benchmark, or "synthetic s18 joint_flow refine"
  int n_base = 0;    ///< repetitions
  int n_new = 0;
  double base_ns = 0;  ///< median
  double ratio = 1;
  std::optional<Interval> interval;
  std::optional<double> p;
  double cliffs_delta = 0;
  std::optional<double> detectable;  ///< none with fewer than 2 repetitions on a side
  GateVerdict verdict = GateVerdict::ok;
};

struct SpeedComparison {
  std::vector<SpeedRow> rows;
  std::vector<Mismatch> findings;
};

/// What one stage of one estimator took in one sequence.
struct RunTime {
  double reference_ms = 0;  ///< median of the reference
  double ratio = 1;         ///< to it, case by case: median
  Interval ratios;          ///< 10 % and 90 %
};

/// By "dataset sequence estimator stage", over the cases that both have estimated.
std::map<std::string, RunTime> run_times(const std::vector<SubjectCases>& subjects,
                                         const std::vector<SubjectCases>& reference);

SpeedComparison compare_speed(const Side& base, const Side& fresh, const Policy& policy);

/// Of two samples of times (ns, above 0). `cases`: 10 % and 90 % of the ratios case by case, which count
/// where there is no interval; none: the ratio itself does.
SpeedRow compare_times(const std::string& name, const std::vector<double>& base_ns,
                       const std::vector<double>& new_ns, const SpeedPolicy& policy,
                       const std::optional<Interval>& cases = std::nullopt);

}  // namespace sextant
