#include "sextant/eval/reproduce/figures.h"

#include <algorithm>
#include <cmath>

#include "sextant/eval/report/figures/panels.h"

namespace sextant {
namespace {

using Paths = std::vector<const AttributionPath*>;

/// Decisions of all paths, in their order.
std::vector<std::string> decisions_of(const Paths& paths) {
  std::vector<std::string> decisions;
  for (const AttributionPath* path : paths) {
    for (const AttributionStep& step : path->steps) {
      if (std::ranges::find(decisions, step.decision) == decisions.end()) decisions.push_back(step.decision);
    }
  }
  return decisions;
}

std::string panel_name(const AttributionPath& path) { return path.set + " " + path.body; }

Table data_of(const Paths& paths, const std::vector<std::string>& decisions) {
  struct StepMark {
    std::string panel, path, decision;
    std::ptrdiff_t x;
    IntervalEstimate Et_m;
  };
  std::vector<StepMark> marks;
  for (const AttributionPath* path : paths) {
    for (const AttributionStep& step : path->steps) {
      const auto x = std::ranges::find(decisions, step.decision) - decisions.begin();
      const double Et_m = step.Et_m.value;
      const Interval around = step.Et_m.interval.value_or(Interval{Et_m, Et_m});
      marks.push_back({panel_name(*path), path->path, step.decision, x, {Et_m, around}});
    }
  }
  Fields<StepMark> fields = {{Column::text("panel"), &StepMark::panel},
                             {Column::text("path"), &StepMark::path},
                             {Column::text("decision"), &StepMark::decision},
                             {Column::text("x"), &StepMark::x}};
  fields.add(estimate_fields(Column::text("Et"), "low", "high"),
             [](const StepMark& mark) { return &mark.Et_m; });
  return table_of("", "", fields, marks);
}

Panel panel_of(const Paths& paths, const std::vector<std::string>& decisions) {
  const std::string name = panel_name(*paths.front());
  Panel panel{name, "set logscale y\nset format y \"%g\"\nset ylabel \"mean E_t [m]\" noenhanced\n", {}};
  double low = INFINITY, high = 0;
  std::string tics;
  for (size_t k = 0; k < decisions.size(); ++k)
    tics += fmt::format("{}{} {}", k > 0 ? ", " : "", gp_text(decisions[k]), k);
  panel.settings += fmt::format("set xtics ({}) rotate by 60 right noenhanced\nset xrange [-0.5:{}]\n", tics,
                                gp_number(static_cast<double>(decisions.size()) - 0.5));
  for (size_t i = 0; i < paths.size(); ++i) {
    const AttributionPath& path = *paths[i];
    const std::string colour = estimator_colour(path.path);
    const std::string x =
        only_where({{"panel", name}, {"path", path.path}},
                   fmt::format("column(\"x\")+{}", gp_number(0.12 * (static_cast<double>(i) - 0.5))));
    panel.plots.push_back(interval_plot(x, "low", "high", colour, 1));
    panel.plots.push_back(fmt::format("data using {}:(column(\"Et\")) {}", x, estimator_style(path.path)));
    for (const AttributionStep& step : path.steps) {
      low = std::min(low, step.Et_m.value);
      high = std::max(high, step.Et_m.value);
    }
    if (!path.published_m) continue;
    panel.plots.push_back(
        fmt::format("{} with lines lc rgb \"{}\" dt 2 lw 1", gp_number(*path.published_m), colour));
    low = std::min(low, *path.published_m);
    high = std::max(high, *path.published_m);
  }
  panel.settings += fmt::format("set yrange [{}:{}]\n", gp_number(low / 1.5), gp_number(high * 1.5));
  return panel;
}

Figure figure_of(const std::string& kind, const Paths& paths) {
  Figure figure;
  figure.name = "attribution_" + file_stem(kind);
  const std::vector<std::string> decisions = decisions_of(paths);
  figure.data = data_of(paths, decisions);
  std::vector<std::pair<std::string, Paths>> by_panel;
  for (const AttributionPath* path : paths) {
    const std::string name = panel_name(*path);
    if (by_panel.empty() || by_panel.back().first != name) by_panel.push_back({name, {}});
    by_panel.back().second.push_back(path);
  }
  std::vector<Panel> panels;
  for (auto& [name, of_panel] : by_panel) {
    std::ranges::sort(of_panel, std::ranges::greater{}, &AttributionPath::path);
    panels.push_back(panel_of(of_panel, decisions));
  }
  std::vector<LegendEntry> legend;
  for (const std::string& path : {paper().baseline, paper().method}) {
    legend.push_back({"from " + estimator_title(path), estimator_style(path)});
    legend.push_back({"printed for " + estimator_title(path),
                      fmt::format("with lines lc rgb \"{}\" dt 2 lw 1", estimator_colour(path))});
  }
  const PanelLayout layout{.columns = std::min<size_t>(3, panels.size()),
                           .width_cm = 18.0,
                           .panel_height_cm = 7.6,
                           .left_cm = 2.0,
                           .bottom_cm = 3.3};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Mean E_t with 95 % intervals over {} seeds, from the published code (left) to our default (right): "
      "each step makes one decision more as we do. Dashed: the values that the paper prints. Data: {}s.",
      paths.front()->n_seeds, kind);
  return figure;
}

}  // namespace

std::vector<Figure> attribution_figures(const std::vector<AttributionPath>& paths) {
  std::vector<std::pair<std::string, Paths>>
      kinds;  // "scenario", "replay": the first word of the data's title
  for (const AttributionPath& path : paths) {
    const std::string kind = path.data.substr(0, path.data.find(' '));
    auto of_kind = std::ranges::find(kinds, kind, &std::pair<std::string, Paths>::first);
    if (of_kind == kinds.end()) of_kind = kinds.insert(kinds.end(), {kind, {}});
    of_kind->second.push_back(&path);
  }
  std::vector<Figure> figures;
  for (const auto& [kind, of_kind] : kinds) figures.push_back(figure_of(kind, of_kind));
  return figures;
}

}  // namespace sextant
