#include "sextant/eval/evaluation/distribution_figures.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"

namespace sextant {
namespace {

constexpr const char* next_line = ", \\\n     ";  // of a plot's parts

}  // namespace

std::vector<Distribution> by_system(const std::vector<RunErrors>& runs) {
  std::vector<Distribution> samples;
  for (const RunErrors& run : runs) {
    if (run.errors.empty()) continue;
    auto sample = std::ranges::find(samples, run.system, &Distribution::title);
    if (sample == samples.end()) sample = samples.insert(samples.end(), {run.system, {}});
    sample->values.insert(sample->values.end(), run.errors.begin(), run.errors.end());
  }
  return samples;
}

std::vector<Distribution> by_run(const std::vector<RunErrors>& runs) {
  std::vector<Distribution> samples;
  for (const RunErrors& run : runs) {
    if (!run.errors.empty()) samples.push_back({run.run, run.errors});
  }
  return samples;
}

Figure cumulative_figure(const std::string& name, const std::string& axis,
                         const std::vector<Distribution>& samples) {
  constexpr int n_steps = 100;
  Figure figure;
  figure.name = name;
  figure.caption = fmt::format("Cumulative distribution: the share of errors that are at most x. {}.", axis);
  figure.data.columns = {{"share", "share"}};
  std::vector<std::vector<double>> values;
  std::vector<std::string> lines;
  for (size_t i = 0; i < samples.size(); ++i) {
    values.push_back(samples[i].values);
    SEXTANT_CHECK(!values.back().empty());
    std::ranges::sort(values.back());
    figure.data.columns.push_back({fmt::format("quantile_{}", i + 1), samples[i].title});
    lines.push_back(
        fmt::format("data using (column(\"quantile_{}\")):(column(\"share\")) with lines lw 1.5 "
                    "lc rgb \"{}\" dt {} title {}",
                    i + 1, line_colour(i), i % 5 + 1, gp_text(samples[i].title)));
  }
  for (int k = 0; k <= n_steps; ++k) {
    const double share = static_cast<double>(k) / n_steps;
    std::vector<Cell> row = {share};
    for (const std::vector<double>& of_sample : values)
      row.emplace_back(quantile_of_sorted(of_sample, share));
    figure.data.add_row(std::move(row));
  }
  figure.script = fmt::format(
      "set xlabel {} noenhanced\nset ylabel \"share of errors\"\nset yrange [0:1]\nset xrange [0:*]\n"
      "set key bottom right noenhanced\nplot {}\n",
      gp_text(axis), fmt::join(lines, next_line));
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
  std::string tics;
  for (const Distribution& sample : samples) {
    boxes.push_back({static_cast<double>(boxes.size() + 1), &sample});
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", gp_tic(sample.title), boxes.back().position);
  }
  Fields<Box> fields = {{Column::text("position"), &Box::position},
                        {Column::text("title"), [](const Box& box) { return box.sample->title; }}};
  fields.add(box_fields(), [](const Box& box) { return &box.sample->values; });
  figure.data = table_of("", "", fields, boxes);
  figure.script = fmt::format(
      "unset key\nset xrange [0.4:{}]\nset yrange [0:*]\nset xtics ({}) {}\nset ylabel {} "
      "noenhanced\nplot {}\n",
      static_cast<double>(samples.size()) + 0.6, tics,
      samples.size() > 3 ? "noenhanced rotate by -30" : "noenhanced", gp_text(axis),
      fmt::join(box_plots("(column(\"position\"))", 0.5, line_colour(0)), next_line));
  return figure;
}

}  // namespace sextant
