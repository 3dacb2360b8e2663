#include "sextant/eval/evaluation/run_statistics.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sextant/base/error.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

struct System {
  std::string name;
  std::vector<const RunErrors*> runs;
};

/// Groups runs by system; runs without errors are ignored.
std::vector<System> systems_of(const std::vector<RunErrors>& runs) {
  std::vector<System> systems;
  for (const RunErrors& run : runs) {
    SEXTANT_CHECK(run.steps.size() == run.errors.size());
    if (run.errors.empty()) continue;
    auto known =
        std::find_if(systems.begin(), systems.end(), [&](const System& s) { return s.name == run.system; });
    if (known == systems.end()) known = systems.insert(systems.end(), System{run.system, {}});
    known->runs.push_back(&run);
  }
  return systems;
}

/// Bootstrap interval of a statistic that depends on the sums of 1, e and e^2 over the runs.
std::optional<Interval> interval(const std::vector<ErrorStatistics>& runs, const std::vector<size_t>& counts,
                                 double (*statistic)(double n, double sum, double squares)) {
  const auto pooled = [&](std::span<const size_t> drawn) {
    double n = 0, sum = 0, squares = 0;
    for (const size_t i : drawn) {
      const auto count = static_cast<double>(counts[i]);
      n += count;
      sum += runs[i].mean * count;
      squares += runs[i].sse;
    }
    return statistic(n, sum, squares);
  };
  constexpr size_t fewest_runs = 5;
  if (runs.size() < fewest_runs) return std::nullopt;
  return cluster_bootstrap(runs.size(), pooled);
}

/// Mean error over the runs at each step.
std::map<ErrorStep, double> mean_by_step(const System& system) {
  std::map<ErrorStep, std::pair<double, int>> sums;
  for (const RunErrors* run : system.runs) {
    for (size_t i = 0; i < run->errors.size(); ++i) {
      auto& [sum, n] = sums[run->steps[i]];
      sum += run->errors[i];
      ++n;
    }
  }
  std::map<ErrorStep, double> means;
  for (const auto& [step, sum] : sums) means[step] = sum.first / sum.second;
  return means;
}

std::vector<double> stretch_means(const std::vector<double>& values, size_t n_stretches) {
  std::vector<double> means;
  for (size_t k = 0; k < n_stretches; ++k) {
    const size_t begin = k * values.size() / n_stretches, end = (k + 1) * values.size() / n_stretches;
    double sum = 0;
    for (size_t i = begin; i < end; ++i) sum += values[i];
    means.push_back(sum / static_cast<double>(end - begin));
  }
  return means;
}

std::optional<SystemComparison> compare(const System& a, const System& b) {
  constexpr size_t fewest = 6,
                   most = 20;  // number of stretches; with fewer than 6 no p-value can be below 0.03
  const std::map<ErrorStep, double> of_a = mean_by_step(a), of_b = mean_by_step(b);
  std::vector<double> differences;
  for (const ErrorStep& step : common_keys<std::map<ErrorStep, double>>({&of_a, &of_b}))
    differences.push_back(of_a.at(step) - of_b.at(step));
  if (differences.size() < fewest) return std::nullopt;
  const std::vector<double> stretches = stretch_means(differences, std::min(most, differences.size()));
  return SystemComparison{compare_pairs(stretches, {}, {}, PairedTest::sign_flip), a.name, b.name,
                          differences.size()};
}

}  // namespace

std::vector<SystemSummary> summarize_systems(const std::vector<RunErrors>& runs) {
  std::vector<SystemSummary> summaries;
  for (const System& system : systems_of(runs)) {
    std::vector<double> errors;
    std::vector<ErrorStatistics> of_runs;
    std::vector<size_t> counts;
    for (const RunErrors* run : system.runs) {
      errors.insert(errors.end(), run->errors.begin(), run->errors.end());
      of_runs.push_back(error_statistics(run->errors));
      counts.push_back(run->errors.size());
    }
    SystemSummary s{
        system.name, static_cast<int>(system.runs.size()), errors.size(), error_statistics(errors), {}, {}};
    s.rmse_interval =
        interval(of_runs, counts, [](double n, double, double squares) { return std::sqrt(squares / n); });
    s.mean_interval = interval(of_runs, counts, [](double n, double sum, double) { return sum / n; });
    summaries.push_back(std::move(s));
  }
  return summaries;
}

std::vector<SystemComparison> compare_systems(const std::vector<RunErrors>& runs) {
  const std::vector<System> systems = systems_of(runs);
  std::vector<SystemComparison> comparisons;
  for (size_t i = 0; i < systems.size(); ++i) {
    for (size_t j = i + 1; j < systems.size(); ++j) {
      if (auto c = compare(systems[i], systems[j])) comparisons.push_back(std::move(*c));
    }
  }
  std::vector<SystemComparison*> family;
  for (SystemComparison& comparison : comparisons) family.push_back(&comparison);
  correct_by_holm(family);
  return comparisons;
}

}  // namespace sextant
