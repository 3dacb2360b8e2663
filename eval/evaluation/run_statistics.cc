#include "sextant/eval/evaluation/run_statistics.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/paired_comparison.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

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
    auto known = std::ranges::find(systems, run.system, &System::name);
    if (known == systems.end()) known = systems.insert(systems.end(), System{run.system, {}});
    known->runs.push_back(&run);
  }
  return systems;
}

std::vector<double> pooled_errors(const System& system) {
  std::vector<double> errors;
  for (const RunErrors* run : system.runs)
    errors.insert(errors.end(), run->errors.begin(), run->errors.end());
  return errors;
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

/// Sign-flip test over blocks of successive frames; `differences` are given for the common steps.
void test_blocks(const std::map<ErrorStep, double>& differences, size_t n_overlapping,
                 SystemComparison& out) {
  constexpr size_t fewest = 6, most = 20;  // with fewer than 6 blocks no p-value can be below 0.03
  std::map<int, std::vector<double>> by_frame;
  for (const auto& [step, difference] : differences) by_frame[step.second].push_back(difference);
  std::vector<double> of_frames;
  for (const auto& [frame, values] : by_frame) of_frames.push_back(mean(values));
  const size_t n_blocks = std::min(most, of_frames.size() / std::max<size_t>(1, 2 * n_overlapping));
  out.n_blocks = static_cast<int>(n_blocks);
  if (of_frames.size() < fewest) {
    out.why_no_p = fmt::format("the test needs errors of at least {} frames", fewest);
  } else if (n_blocks < fewest) {
    out.why_no_p = fmt::format(
        "each error overlaps with {} later ones, so that less than {} blocks are independent: leave out "
        "--all-pairs, or give shorter pairs",
        n_overlapping, fewest);
  } else {
    const std::vector<double> means = stretch_means(of_frames, n_blocks);
    out.p = mean(means) * *out.difference < 0 ? 1 : sign_flip_test(means);
  }
}

/// Mean of each run over the common steps, relative to the mean of all runs of both systems at each step, so
/// that a run that lacks some steps is comparable with the others. Runs without a common step are left out.
std::vector<double> means_of_runs(const System& system, const std::map<ErrorStep, double>& mean_of_all) {
  std::vector<double> means;
  for (const RunErrors* run : system.runs) {
    std::vector<double> errors;
    for (size_t i = 0; i < run->errors.size(); ++i) {
      const auto all = mean_of_all.find(run->steps[i]);
      if (all != mean_of_all.end()) errors.push_back(run->errors[i] - all->second);
    }
    if (!errors.empty()) means.push_back(mean(errors));
  }
  return means;
}

/// Mann-Whitney test of the runs of a against the runs of b; the keys of `differences` are the common steps.
void test_runs(const System& a, const System& b, const std::map<ErrorStep, double>& differences,
               SystemComparison& out) {
  System both{"", a.runs};
  both.runs.insert(both.runs.end(), b.runs.begin(), b.runs.end());
  std::map<ErrorStep, double> mean_of_all = mean_by_step(both);
  std::erase_if(mean_of_all, [&](const auto& at) { return !differences.contains(at.first); });
  const std::vector<double> of_a = means_of_runs(a, mean_of_all), of_b = means_of_runs(b, mean_of_all);
  out.n_runs_a = static_cast<int>(of_a.size());
  out.n_runs_b = static_cast<int>(of_b.size());
  constexpr double level = 0.05;
  const double smallest = smallest_p_of_runs(out.n_runs_a, out.n_runs_b);
  if (std::min(of_a.size(), of_b.size()) < 2) {
    out.why_no_p = "errors along one path depend on each other: give several runs of each system";
  } else if (smallest >= level) {
    out.why_no_p = fmt::format(
        "the smallest p that {} and {} runs can give is {:.2f}: give at least 4 runs of each system",
        out.n_runs_a, out.n_runs_b, smallest);
  } else {
    const MannWhitneyTest test = mann_whitney_test(of_a, of_b);
    out.p = test.cliffs_delta * *out.difference < 0 ? 1 : test.p;  // ranks and means must agree
  }
}

SystemComparison compare(const System& a, const System& b, IndependentUnit unit) {
  constexpr size_t fewest = 6;
  const std::map<ErrorStep, double> of_a = mean_by_step(a), of_b = mean_by_step(b);
  std::map<ErrorStep, double> differences;
  double sum = 0;
  for (const ErrorStep& step : common_keys<std::map<ErrorStep, double>>({&of_a, &of_b})) {
    differences[step] = of_a.at(step) - of_b.at(step);
    sum += differences[step];
  }
  SystemComparison out;
  out.a = a.name;
  out.b = b.name;
  out.n_common = differences.size();
  if (differences.empty()) {
    out.why_no_p = "they have no step in common";
    return out;
  }
  out.difference = sum / static_cast<double>(differences.size());
  if (differences.size() < fewest) {
    out.why_no_p =
        fmt::format("they have only {} steps in common, and the test needs {}", out.n_common, fewest);
  } else if (unit == IndependentUnit::blocks) {
    size_t n_overlapping = 0;
    for (const System* system : {&a, &b}) {
      for (const RunErrors* run : system->runs) n_overlapping = std::max(n_overlapping, run->n_overlapping);
    }
    test_blocks(differences, n_overlapping, out);
  } else {
    test_runs(a, b, differences, out);
  }
  return out;
}

}  // namespace

std::vector<SystemSummary> summarize_systems(const std::vector<RunErrors>& runs) {
  std::vector<SystemSummary> summaries;
  for (const System& system : systems_of(runs)) {
    const std::vector<double> errors = pooled_errors(system);
    std::vector<ErrorStatistics> of_runs;
    std::vector<size_t> counts;
    for (const RunErrors* run : system.runs) {
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

std::vector<SystemComparison> compare_systems(const std::vector<RunErrors>& runs, IndependentUnit unit) {
  const std::vector<System> systems = systems_of(runs);
  std::vector<SystemComparison> comparisons;
  for (size_t i = 0; i < systems.size(); ++i) {
    for (size_t j = i + 1; j < systems.size(); ++j)
      comparisons.push_back(compare(systems[i], systems[j], unit));
  }
  std::vector<SystemComparison*> family;
  for (SystemComparison& comparison : comparisons) family.push_back(&comparison);
  correct_by_holm(family);
  return comparisons;
}

double smallest_p_of_runs(int n_a, int n_b) {
  double ways = 1;  // number of ways to choose the runs of a among all
  for (int k = 1; k <= n_a; ++k) ways *= static_cast<double>(n_b + k) / k;
  return std::min(1.0, 2 / ways);
}

std::vector<std::string> notes_on_missing_p(const std::vector<SystemComparison>& comparisons) {
  std::map<std::string, std::vector<std::string>> pairs_by_reason;
  for (const SystemComparison& c : comparisons) {
    if (!c.p) pairs_by_reason[c.why_no_p].push_back(fmt::format("{} and {}", c.a, c.b));
  }
  std::vector<std::string> notes;
  for (const auto& [reason, pairs] : pairs_by_reason)
    notes.push_back(fmt::format("No p of {}: {}.", fmt::join(pairs, ", "), reason));
  return notes;
}

std::vector<Distribution> by_system(const std::vector<RunErrors>& runs, const RunColour& colour) {
  std::vector<Distribution> samples;
  for (const System& system : systems_of(runs)) {
    const RunErrors* first = system.runs.front();
    samples.push_back(
        {system.name, pooled_errors(system), colour(*first, static_cast<size_t>(first - runs.data()))});
  }
  return samples;
}

std::vector<Distribution> by_run(const std::vector<RunErrors>& runs, const RunColour& colour) {
  std::vector<Distribution> samples;
  for (size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].errors.empty()) samples.push_back({runs[i].run, runs[i].errors, colour(runs[i], i)});
  }
  return samples;
}

namespace {

/// Returns the colour of sample i of a figure.
std::string colour_of(const Distribution& sample, size_t i) {
  return sample.colour.empty() ? line_colour(i + 1) : sample.colour;
}

}  // namespace

Figure cumulative_figure(const std::string& name, const std::string& axis,
                         const std::vector<Distribution>& samples) {
  constexpr int n_steps = 100;
  Figure figure;
  figure.name = name;
  figure.caption = fmt::format("Cumulative distribution: the share of errors that are at most x. {}.", axis);
  figure.data.columns = {{"share", "share"}};
  std::vector<std::vector<double>> values;
  std::vector<std::string> plots;
  std::vector<LegendEntry> legend;
  double end = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    values.push_back(samples[i].values);
    SEXTANT_CHECK(!values.back().empty());
    std::ranges::sort(values.back());
    figure.data.columns.push_back({fmt::format("quantile_{}", i + 1), samples[i].title});
    const std::string line =
        fmt::format("with lines lc rgb \"{}\" dt {} lw 1.5", colour_of(samples[i], i), i % 5 + 1);
    plots.push_back(fmt::format("data using (column(\"quantile_{}\")):(column(\"share\")) {}", i + 1, line));
    legend.push_back({samples[i].title, line});
    end = std::max(end, values.back().back());
  }
  end = end > 0 ? 1.05 * end : 1;
  for (int k = 0; k <= n_steps; ++k) {
    const double share = static_cast<double>(k) / n_steps;
    std::vector<Cell> row = {share};
    for (const std::vector<double>& of_sample : values)
      row.emplace_back(quantile_of_sorted(of_sample, share));
    figure.data.add_row(std::move(row));
  }
  Panel panel{
      "",
      fmt::format("set xlabel {} noenhanced offset 0,0.4\nset ylabel \"share of errors\" offset 0.6,0\n"
                  "set yrange [0:1]\nset xrange [0:{}]\nset xtics {}\n",
                  gp_text(axis), gp_number(end), gp_number(tic_step(end, 5))),
      std::move(plots)};
  set_panels({.panel_height_cm = 5.8}, legend, {panel}, figure);
  return figure;
}

Figure box_figure(const std::string& name, const std::string& axis,
                  const std::vector<Distribution>& samples) {
  Figure figure;
  figure.name = name;
  figure.caption = fmt::format("Boxes: quartiles and median; whiskers: 5 % and 95 % quantiles. {}.", axis);
  struct Box {
    double position;
    const Distribution* sample;
  };
  std::vector<Box> boxes;
  std::vector<LegendEntry> legend;
  std::set<std::string> colours;
  for (size_t i = 0; i < samples.size(); ++i) colours.insert(colour_of(samples[i], i));
  const bool numbered = colours.size() < samples.size();
  Panel panel{"",
              fmt::format("set xrange [0.4:{}]\nset yrange [0:*]\n{} xtics{}\nset ylabel {} noenhanced "
                          "offset 0.6,0\n",
                          static_cast<double>(samples.size()) + 0.6, numbered ? "set" : "unset",
                          numbered ? " 1 scale 0" : "", gp_text(axis)),
              {}};
  for (const Distribution& sample : samples) {
    const std::string colour = colour_of(sample, boxes.size());
    boxes.push_back({static_cast<double>(boxes.size() + 1), &sample});
    const std::string x =
        fmt::format("(column(\"position\") == {0} ? {0} : NaN)", gp_number(boxes.back().position));
    std::ranges::move(box_plots(x, 0.5, colour), std::back_inserter(panel.plots));
    legend.push_back({numbered ? fmt::format("{}: {}", boxes.size(), sample.title) : sample.title,
                      fmt::format("with boxes lc rgb \"{}\" fs solid 0.35", colour)});
  }
  Fields<Box> fields = {{Column::text("position"), &Box::position},
                        {Column::text("title"), [](const Box& box) { return box.sample->title; }}};
  fields.add(box_fields(), [](const Box& box) { return &box.sample->values; });
  figure.data = table_of("", "", fields, boxes);
  set_panels({.panel_height_cm = 5.8, .bottom_cm = numbered ? 0.6 : 0.3}, legend, {panel}, figure);
  return figure;
}

Figure grouped_box_figure(const std::string& name, const std::string& axis,
                          const std::vector<BoxGroup>& groups) {
  Figure figure;
  figure.name = name;
  figure.caption = fmt::format("Boxes: quartiles and median; whiskers: 5 % and 95 % quantiles. {}.", axis);
  std::vector<std::string> titles, colours;
  for (const BoxGroup& group : groups) {
    for (const Distribution& sample : group.samples) {
      add_distinct(sample.title, titles);
      if (titles.size() > colours.size()) colours.push_back(colour_of(sample, colours.size()));
    }
  }
  struct Box {
    double position;
    size_t series;
    std::string group;
    const Distribution* sample;
  };
  std::vector<Box> boxes;
  std::string tics;
  const double pitch = 0.8 / static_cast<double>(std::max<size_t>(titles.size(), 1));
  for (size_t g = 0; g < groups.size(); ++g) {
    const auto place = static_cast<double>(g + 1);
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", gp_tic(groups[g].title), place);
    for (const Distribution& sample : groups[g].samples) {
      const auto series = static_cast<size_t>(std::ranges::find(titles, sample.title) - titles.begin());
      boxes.push_back(
          {place - 0.4 + pitch * (static_cast<double>(series) + 0.5), series, groups[g].title, &sample});
    }
  }
  Fields<Box> fields = {{Column::text("position"), &Box::position},
                        {Column::count("series"), &Box::series},
                        {Column::text("group"), &Box::group},
                        {Column::text("title"), [](const Box& box) { return box.sample->title; }}};
  fields.add(box_fields(), [](const Box& box) { return &box.sample->values; });
  figure.data = table_of("", "", fields, boxes);
  Panel panel{
      "",
      fmt::format(
          "set xrange [0.4:{}]\nset yrange [0:*]\nset xtics ({}) noenhanced\nset ylabel {} noenhanced\n",
          static_cast<double>(groups.size()) + 0.6, tics, gp_text(axis)),
      {}};
  std::vector<LegendEntry> legend;
  for (size_t series = 0; series < titles.size(); ++series) {
    const std::string x = fmt::format("(column(\"series\") == {} ? column(\"position\") : NaN)", series);
    const std::string& colour = colours[series];
    std::ranges::move(box_plots(x, 0.85 * pitch, colour), std::back_inserter(panel.plots));
    legend.push_back({titles[series], fmt::format("with boxes lc rgb \"{}\" fs solid 0.35", colour)});
  }
  set_panels({.width_cm = 14, .panel_height_cm = 6, .left_cm = 1.7}, legend, {panel}, figure);
  return figure;
}

}  // namespace sextant
