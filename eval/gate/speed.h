#pragma once

// Compares times. A sample is one repetition: each repetition of a benchmark, for Google Benchmark; each
// folder, for runs, as the median over its records of time / time in the first folder of BASE, per data set,
// sequence, estimator and stage, separately for the camera and for all objects. All computations use
// logarithms, so effects are ratios new / base:
//
//   ratio       exp of the Hodges-Lehmann shift (median of all log new - log base), with the 95 % interval of
//               the shifts that the Mann-Whitney test does not reject
//   p           Mann-Whitney test, two-sided; cliffs_delta: P(new slower) - P(new faster)
//   detectable  smallest ratio that this number of repetitions detects with probability 80 %
//
// `regressed`: the whole interval lies above 1 + minimum_effect. `improved`: it lies below 1 / (1 +
// minimum_effect). `inconclusive`: the ratio lies above 1 + minimum_effect, but its interval does not; more
// repetitions are needed. Without repetitions, or with fewer than the test needs (4 on each side if alpha is
// 0.05), there is no interval: a time that is slower by more than unrepeated_effect is `inconclusive`, and
// any other time `ok`, because nothing is proven. The times of runs are wall-clock times, so nine of ten
// records must be slower by more than unrepeated_effect.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/side.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// One compared time.
struct SpeedRow {
  std::string name;  ///< name of the benchmark, or "synthetic s18 joint_flow refine"
  int n_base = 0;    ///< number of repetitions
  int n_new = 0;
  double base_ns = 0;  ///< median
  double ratio = 1;
  std::optional<Interval> interval;  ///< interval of the ratio; nullopt with too few repetitions for the test
  std::optional<double> p;           ///< empty with fewer than 2 repetitions on a side
  double cliffs_delta = 0;
  std::optional<double> detectable;  ///< empty with fewer than 2 repetitions on a side
  GateVerdict verdict = GateVerdict::ok;
};

/// Time of one stage of one estimator for the camera, or for the objects, of one sequence, relative to a
/// reference.
struct RunTime {
  double reference_ms = 0;  ///< median over all records of the reference
  double ratio = 1;         ///< median over the records that both sides have of time / reference time
  Interval ratios;          ///< 10 % and 90 % quantiles of these ratios
};

/// Returns times by "dataset sequence estimator stage" for the camera, and by the same name followed by " of
/// objects" for all objects, over records that have status ok and a time above 0. `reference_ms` does not
/// depend on `subjects`: an object that is missing there changes no time.
std::map<std::string, RunTime> run_times(const Subjects& subjects, const Subjects& reference);

/// Returns the compared times; appends to `findings` what prevents or limits their comparison.
std::vector<SpeedRow> compare_speed(const Side& base, const Side& fresh, const Policy& policy,
                                    std::vector<Mismatch>& findings);

}  // namespace sextant
