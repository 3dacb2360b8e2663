#include "sextant/eval/gate/speed.h"

#include <cmath>
#include <map>
#include <set>

#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

struct Sample {
  std::vector<double> ns;  ///< one per repetition
  /// 10 % and 90 % quantiles of the case-by-case ratios of the first repetition to BASE's first one
  std::optional<Interval> ratios;
};
using Samples = std::map<std::string, Sample>;  ///< by name

std::string program_of(const BenchmarkFile& file) {
  const std::string path = file.context.value("executable", std::string());
  return path.substr(path.rfind('/') + 1);
}

bool several_programs(const std::vector<BenchmarkFile>& files) {
  std::set<std::string> programs;
  for (const BenchmarkFile& file : files) programs.insert(program_of(file));
  return programs.size() > 1;
}

Samples benchmark_samples(const std::vector<BenchmarkFile>& files, bool several, const SpeedPolicy& policy) {
  Samples samples;
  for (const BenchmarkFile& file : files) {
    for (const auto& [name, times] : file.times_ns(policy.time)) {
      for (const double ns : times) {
        if (ns <= 0)
          fail("{}: benchmark '{}': its {} time is 0: it measured nothing", file.path, name,
               BenchmarkFile::measures_real_time(name, policy.time) ? "real" : "CPU");
      }
      // Names of benchmarks are prefixed by their program if a side has several programs.
      std::vector<double>& all = samples[(several ? program_of(file) + ": " : "") + name].ns;
      all.insert(all.end(), times.begin(), times.end());
    }
  }
  return samples;
}

struct StageTimes {
  std::vector<double> reference_ms;  ///< of all records of the reference
  std::vector<double> log_ratios;    ///< of the records that both sides have
};

Samples run_samples(const Side& side, const Side& base) {
  Samples samples;
  if (base.runs.empty()) return samples;
  for (const RunFolder& run : side.runs) {
    for (const auto& [name, time] : run_times(run.subjects, base.runs.front().subjects)) {
      Sample& sample = samples[name];
      sample.ns.push_back(1e6 * time.reference_ms * time.ratio);
      if (!sample.ratios) sample.ratios = time.ratios;
    }
  }
  return samples;
}

std::vector<double> logarithms(const std::vector<double>& values) {
  std::vector<double> logs;
  for (const double value : values) logs.push_back(std::log(value));
  return logs;
}

/// Spread of the repetitions about the median of their side; robust against a few disturbed ones.
double pooled_sigma(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> residuals;
  for (const std::vector<double>* side : {&a, &b}) {
    const double middle = median(*side);
    for (const double value : *side) residuals.push_back(value - middle);
  }
  return 1.4826 * mad(residuals);
}

/// Compares two samples of times (ns, above 0). `cases`: the 10 % and 90 % quantiles of the ratios case by
/// case, which decide if there is no interval. Without `cases` the ratio decides.
SpeedRow compare_times(const std::string& name, const std::vector<double>& base_ns,
                       const std::vector<double>& new_ns, const SpeedPolicy& policy,
                       const std::optional<Interval>& cases) {
  SpeedRow row;
  row.name = name;
  row.n_base = static_cast<int>(base_ns.size());
  row.n_new = static_cast<int>(new_ns.size());
  row.base_ns = median(base_ns);
  const std::vector<double> a = logarithms(base_ns), b = logarithms(new_ns);
  const MannWhitneyTest test = mann_whitney_test(b, a);
  row.ratio = std::exp(test.hodges_lehmann_shift);
  row.cliffs_delta = test.cliffs_delta;
  if (const auto interval = hodges_lehmann_interval(b, a, 1 - policy.alpha)) {
    row.interval = Interval{std::exp(interval->low), std::exp(interval->high)};
  }
  if (row.n_base > 1 && row.n_new > 1) {
    row.p = test.p;
    const double n_equal =
        2.0 / (1.0 / row.n_base + 1.0 / row.n_new);  // repetitions per side if they were distributed equally
    const double shift = minimum_detectable_effect(std::sqrt(2.0) * pooled_sigma(a, b),
                                                   static_cast<int>(std::lround(n_equal)), policy.alpha);
    row.detectable = (1 + policy.minimum_effect) * std::exp(shift);
  }
  const double slower = 1 + policy.minimum_effect, faster = 1 / slower;
  if (!row.interval) {
    const Interval ratios = cases.value_or(Interval{row.ratio, row.ratio});
    if (ratios.low > 1 + policy.unrepeated_effect) row.verdict = GateVerdict::inconclusive;
  } else if (row.interval->low > slower) {
    row.verdict = GateVerdict::regressed;
  } else if (row.interval->high < faster) {
    row.verdict = GateVerdict::improved;
  } else if (row.ratio > slower) {
    row.verdict = GateVerdict::inconclusive;
  }
  return row;
}

void compare_samples(const Samples& base, const Samples& fresh, const Policy& policy,
                     std::vector<SpeedRow>& rows, std::vector<Mismatch>& findings) {
  for (const auto& [name, sample] : base) {
    const auto other = fresh.find(name);
    if (other == fresh.end()) {
      findings.push_back(mismatch(policy.same.cases, "cases", name, "there", "missing"));
    } else {
      const SpeedRow& row = rows.emplace_back(
          compare_times(name, sample.ns, other->second.ns, policy.speed, other->second.ratios));
      if (row.n_base != row.n_new) {
        findings.push_back(mismatch(Strictness::note, "repetitions", name, std::to_string(row.n_base),
                                    std::to_string(row.n_new)));
      }
    }
  }
  for (const auto& [name, sample] : fresh) {
    if (!base.contains(name))
      findings.push_back(mismatch(policy.same.new_cases, "new_cases", name, "missing", "there"));
  }
}

}  // namespace

std::map<std::string, RunTime> run_times(const Subjects& subjects, const Subjects& reference) {
  std::map<std::string, StageTimes> stages_of;
  for (const auto& [s, pair] : by_key(reference, subjects)) {
    if (!pair.base) continue;
    for (const auto& [stage, before] : pair.base->times) {
      StageTimes& times = stages_of[fmt::format("{} {} {} {}{}", s.dataset, s.sequence, s.estimator, stage,
                                                s.body == "ego" ? "" : " of objects")];
      for (size_t b = 0; b < before.size(); ++b)
        if (pair.base->statuses[b] == Status::ok && before[b] > 0) times.reference_ms.push_back(before[b]);
      const std::vector<double>* after = pair.fresh ? find_in(pair.fresh->times, stage) : nullptr;
      if (after == nullptr) continue;
      for (const auto& [b, f] : pair_rows(pair).both) {
        if (pair.base->statuses[b] != Status::ok || pair.fresh->statuses[f] != Status::ok) continue;
        const double a_ms = before[b], b_ms = (*after)[f];
        if (a_ms > 0 && b_ms > 0) times.log_ratios.push_back(std::log(b_ms / a_ms));
      }
    }
  }
  std::erase_if(stages_of, [](const auto& of) { return of.second.log_ratios.empty(); });
  std::map<std::string, RunTime> result;
  for (const auto& [name, times] : stages_of) {
    const auto at = [&ratios = times.log_ratios](double p) { return std::exp(quantile(ratios, p)); };
    result[name] = {median(times.reference_ms), at(0.5), {at(0.1), at(0.9)}};
  }
  return result;
}

std::vector<SpeedRow> compare_speed(const Side& base, const Side& fresh, const Policy& policy,
                                    std::vector<Mismatch>& findings) {
  std::vector<SpeedRow> rows;
  const bool several = several_programs(base.benchmarks) || several_programs(fresh.benchmarks);
  compare_samples(benchmark_samples(base.benchmarks, several, policy.speed),
                  benchmark_samples(fresh.benchmarks, several, policy.speed), policy, rows, findings);
  compare_samples(run_samples(base, base), run_samples(fresh, base), policy, rows, findings);
  return rows;
}

}  // namespace sextant
