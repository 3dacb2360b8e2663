#pragma once

// The policy of a comparison: which differences count as a change. It is read from JSON, in which unknown
// keys are errors and missing keys have defaults. docs/ci.md explains the rules.
//
//   {"accuracy": {"default": {"minimum_effect": 0.02}, "metrics": {"Et_m": {"minimum_effect": 0.01}}},
//    "speed": {"judge": false}, "same": {"machine": "note"}}

#include <map>
#include <span>
#include <string>

#include "sextant/base/options.h"

namespace sextant {

/// Direction in which an error gets better; `ignore`: the error is not judged.
enum class Direction { lower, higher, ignore };
constexpr Names<3> names_of(Direction) { return {"lower", "higher", "ignore"}; }

/// Tolerances for one metric. A record is one body in one frame pair of one seed. Its change counts as
/// rounding if |new - base| <= max(absolute, relative |base|). The change of the mean over all records of a
/// body, or of the mean pooled over bodies, counts if it exceeds minimum_effect |mean of base|. With
/// minimum_effect 0, the exact gate (accuracy.h), every body is judged and nothing is pooled.
struct MetricPolicy {
  SEXTANT_OPTIONS((double, absolute, 1e-9, "of metric", "smaller changes of a record count as rounding"),
                  (double, relative, 1e-6, "share", "as absolute, as a share of the value in BASE"),
                  (double, minimum_effect, 0.01, "share", "smallest change of a mean that counts; 0: any"),
                  (Direction, direction, Direction::lower, "",
                   "direction that is better; ignore: not judged"))
  void check() const;
  /// Returns true if an error changed by more than rounding.
  bool is_change(double base, double fresh) const;
};

struct AccuracyPolicy {
  bool judge = true;
  double alpha = 0.01;
  int minimum_seeds = 6;
  int minimum_cases = 12;
  double inconclusive_effect = 1;
  int replicates = 500;
  int max_lost = 0;
  double gained_error = 10;
  MetricPolicy other;
  std::map<std::string, MetricPolicy> metrics;  ///< by key of a record's "errors"
  template <typename V>
  void visit(V& v) {
    v("judge", judge, "", "false: errors and statuses are left out");
    v("alpha", alpha, "0..1", "two-sided p-values (Holm) up to this are evidence");
    v("minimum_seeds", minimum_seeds, "count", "fewer seeds with different errors are too few to judge");
    v("minimum_cases", minimum_cases, "count", "fewer records are too few to judge");
    v("inconclusive_effect", inconclusive_effect, "share",
      "a pooled error that is worse by more, but without evidence, is inconclusive");
    v("replicates", replicates, "count", "resamples of the 95 % intervals of the exact gate");
    v("max_lost", max_lost, "count",
      "records of one body that may be lost beyond those gained; as many decisions may become wrong");
    v("gained_error", gained_error, "times",
      "a gained record with an error above so many times the largest of its body in BASE counts as lost");
    v("default", other, "", "metrics that 'metrics' does not name");
    v("metrics", metrics, "",
      "by key of a record's errors; a key that an entry lacks has its value from 'default'");
  }
  void check() const;

  /// Returns the policy of one error: its entry in `metrics`, if there is one, otherwise default_of().
  MetricPolicy of(const std::string& metric) const;
  /// Returns `other`, but with direction `higher` or `ignore` if metrics/definitions.h defines that higher is
  /// better, or neither.
  MetricPolicy default_of(const std::string& metric) const;
};

enum class BenchmarkTime { cpu, real };
constexpr Names<2> names_of(BenchmarkTime) { return {"cpu", "real"}; }

struct SpeedPolicy {
  SEXTANT_OPTIONS(
      (bool, judge, true, "", "false: times are left out"),
      (double, alpha, 0.05, "0..1", "p-values (Mann-Whitney) up to this are evidence"),
      (double, minimum_effect, 0.05, "share", "smallest change of a time that counts"),
      (double, unrepeated_effect, 0.5, "share",
       "without repetitions: slower by more (runs: nine of ten records) is inconclusive; less is not judged"),
      (BenchmarkTime, time, BenchmarkTime::cpu, "",
       "time of Google Benchmark that is compared; always real if the benchmark requests it"))
  void check() const;
};

/// Strictness of a requirement. must: a difference makes the comparison invalid; note: it is reported and
/// accepted.
enum class Strictness { must, note };
constexpr Names<2> names_of(Strictness) { return {"must", "note"}; }

/// Strictness of the properties that are compared between both sides.
struct SamenessPolicy {
  Strictness cases = Strictness::must, new_cases = Strictness::must, data = Strictness::must,
             configuration = Strictness::must, definitions = Strictness::must, machine = Strictness::must;

  struct Rule {
    const char* name;
    Strictness SamenessPolicy::*value;
    const char* compared;
  };
  static std::span<const Rule> rules();

  template <typename V>
  void visit(V& v) {
    for (const Rule& rule : rules()) v(rule.name, this->*rule.value, "", rule.compared);
  }
};

struct Policy {
  SEXTANT_OPTIONS((AccuracyPolicy, accuracy, {}, "", "errors and statuses"),
                  (SpeedPolicy, speed, {}, "", "times"), (SamenessPolicy, same, {}, "", "each: must or note"))
};

/// Reads a policy, in which an entry of `metrics` starts from AccuracyPolicy::default_of(). Throws Error
/// "FILE: ..." that names the key.
Policy read_policy(const std::string& file);

/// Verdicts of the gate, by precedence: a comparison has the first of these verdicts that any of its parts
/// has. It is `improved` only if something is improved and nothing is invalid, regressed or inconclusive.
enum class GateVerdict { invalid, regressed, inconclusive, improved, ok };

constexpr Names<5> names_of(GateVerdict) {
  return {"invalid", "regressed", "inconclusive", "improved", "ok"};
}
/// Exit codes: invalid 2, regressed 1, inconclusive 3, improved and ok 0.
constexpr int exit_code(GateVerdict verdict) {
  constexpr int codes[] = {2, 1, 3, 0, 0};
  return codes[static_cast<size_t>(verdict)];
}

}  // namespace sextant
