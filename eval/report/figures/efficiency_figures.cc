#include <algorithm>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

constexpr size_t most_plotted_bodies = 4;

/// RMS / bound for one error, body, estimator and level.
struct Ratio {
  std::string error, body, estimator;
  double level = 0;
  IntervalEstimate of;
};

Panel panel_of(const MetricDefinition& error, const std::string& body,
               const std::vector<std::string>& estimators, double first, double last, double lowest,
               double highest) {
  const double margin = last > first ? 0.08 * (last - first) : 0.5;
  Panel panel{body_title(body), "", {}};
  panel.settings = fmt::format(
      "set xrange [{}:{}]\nset logscale y 2\nset yrange [{}:{}]\nset ylabel \"{}: RMS / bound\" noenhanced\n"
      "set arrow from graph 0,first 1 to graph 1,first 1 nohead lc rgb \"#000000\" dt 2 lw 1\n",
      gp_number(first - margin), gp_number(last + margin), gp_number(lowest / 1.15),
      gp_number(1.15 * highest), error.symbol);
  for (size_t i = 0; i < estimators.size(); ++i) {
    // Points are shifted so that their intervals do not overlap.
    const double shift =
        0.12 * margin * (static_cast<double>(i) - (static_cast<double>(estimators.size()) - 1) / 2);
    const std::string x = only_where({{"error", error.stem()}, {"body", body}, {"estimator", estimators[i]}},
                                     fmt::format("column(\"level\")+{}", gp_number(shift)));
    panel.plots.push_back(interval_plot(x, "low", "high", estimator_colour(estimators[i]), 1));
    panel.plots.push_back(
        fmt::format("data using {}:(column(\"ratio\")) {}", x, estimator_style(estimators[i])));
  }
  return panel;
}

Figure figure_of(const std::vector<const NoiseLevelRow*>& rows) {
  const NoiseLevelRow& first = *rows.front();
  Figure figure;
  figure.name = "efficiency_" + file_stem(first.parameter) + "_" + file_stem(first.dataset) + "_" +
                file_stem(first.sequence);
  const std::vector<const MetricDefinition*> errors = bounded_errors();
  std::vector<Ratio> ratios;
  for (const MetricDefinition* error : errors) {
    for (const NoiseLevelRow* row : rows) {
      const Efficiency* e = find_in(row->limit.efficiency, error->name);
      if (e != nullptr && e->efficiency > 0)
        ratios.push_back({error->stem(), row->body, row->estimator, row->level, e->ratio()});
    }
  }
  if (ratios.empty()) return figure;
  Fields<Ratio> fields = {{Column::text("error"), &Ratio::error},
                          {Column::text("body"), &Ratio::body},
                          {Column::text("estimator"), &Ratio::estimator},
                          {Column::text("level"), &Ratio::level}};
  fields.add(estimate_fields(Column::text("ratio"), "low", "high"),
             [](const Ratio& ratio) { return &ratio.of; });
  figure.data = table_of("", "", fields, ratios);
  double low = ratios.front().level, high = low, lowest = 0.5, highest = 2;
  for (const Ratio& ratio : ratios) {
    low = std::min(low, ratio.level);
    high = std::max(high, ratio.level);
    const auto& [value, interval] = ratio.of;
    lowest = std::min(lowest, interval ? interval->low : value);
    highest = std::max(highest, interval ? interval->high : value);
  }
  std::vector<std::string> bodies = distinct(rows, &NoiseLevelRow::body);
  bodies.resize(std::min(bodies.size(), most_plotted_bodies));
  const std::vector<std::string> estimators = in_order(distinct(rows, &NoiseLevelRow::estimator));
  std::vector<Panel> panels;
  for (const std::string& body : bodies) {
    for (const MetricDefinition* error : errors) {
      panels.push_back(panel_of(*error, body, estimators, low, high, lowest, highest));
      const std::string title =
          body == bodies.back() ? parameter_title(first.parameter, rows.back()->noise) : "";
      panels.back().settings += fmt::format("set xlabel {} noenhanced offset 0,0.4\n", gp_text(title));
    }
  }
  std::vector<LegendEntry> legend;
  for (const std::string& e : estimators) legend.push_back({estimator_title(e), estimator_style(e)});
  legend.push_back({"bound", "with lines lc rgb \"#000000\" dt 2 lw 1"});
  const PanelLayout layout{.columns = errors.size(), .width_cm = 18.0};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Errors over their Cramer-Rao bound, {} {}, with 95 % intervals over {} seeds: 1 is the limit of "
      "unbiased estimates from flow and one depth.",
      first.dataset, first.sequence, first.n_seeds);
  return figure;
}

}  // namespace

std::vector<Figure> efficiency_figures(const std::vector<NoiseLevelRow>& rows) {
  std::map<std::tuple<std::string, std::string, std::string>, std::vector<const NoiseLevelRow*>> groups;
  for (const NoiseLevelRow& row : rows) {
    if (!row.limit.efficiency.empty()) groups[{row.parameter, row.dataset, row.sequence}].push_back(&row);
  }
  std::vector<Figure> figures;
  for (const auto& [key, group] : groups) {
    Figure figure = figure_of(group);
    if (!figure.data.rows.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
