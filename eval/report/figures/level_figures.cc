#include "sextant/eval/report/figures/record_figures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/paper.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {

namespace {

constexpr double fig4_left_cm = 1.9, fig4_right_cm = 2.0;  // beside the plots of figure 4
constexpr size_t most_bodies = 4;                          // in a figure of efficiencies

std::string drawn_bodies(size_t drawn, size_t all) {
  return drawn < all ? fmt::format(" Drawn are the first {} of {} bodies.", drawn, all) : "";
}

/// Errors of one body at one level.
struct LevelMark {
  std::string panel, body;
  double level = 0;
  double bar_x = 0;  ///< beside the bars of the other bodies
  std::optional<IntervalEstimate> Et_m, ER_deg;
};

std::optional<IntervalEstimate> mean_error(const NoiseLevelRow& row, const char* error) {
  const SampleSummary* summary = find_in(row.errors, error);
  return summary ? std::optional(summary->mean) : std::nullopt;
}

/// Returns the largest upper end of the intervals, or the value that the paper states if that is larger.
double top_of(const std::vector<LevelMark>& marks, std::optional<IntervalEstimate> LevelMark::*error,
              double stated) {
  double top = stated;
  for (const LevelMark& mark : marks) {
    const auto& estimate = mark.*error;
    if (estimate) top = std::max(top, estimate->interval ? estimate->interval->high : estimate->value);
  }
  return top;
}

std::string stated_line(double at, const char* axis, const std::string& colour) {
  return fmt::format("set arrow from graph 0, {1} {0} to graph 1, {1} {0} nohead lc rgb \"{2}\" dt 2 lw 1\n",
                     gp_number(at), axis, colour);
}

std::string mark_style(size_t i) {
  return fmt::format("with linespoints lc rgb \"{}\" lw 1.5 pt {} ps 0.5", line_colour(i), filled_point(i));
}

Panel panel_of(const std::string& name, const std::vector<LevelMark>& marks,
               const std::vector<std::string>& bodies, double step, double axis_cm) {
  constexpr double label_cm = 0.75;  // a label of four characters and the gap to the next one
  const Json& stated = paper().stated.at(name);
  const double Et_m = stated.at("Et_m"), ER_deg = stated.at("ER_deg");
  Panel panel{stated.at("title"), "", {}};
  const double low = marks.front().level - step / 2, high = marks.back().level + step / 2;
  panel.settings = fmt::format(
      "set border 11\nset xlabel {} noenhanced\nset xrange [{}:{}]\nset ylabel \"mean E_t [m] "
      "(curves)\" noenhanced\nset yrange [0:{}]\n"
      "set y2label \"mean E_R [deg] (bars)\" noenhanced\nset y2tics\nset y2range [0:{}]\n",
      gp_text(parameter_title(name, "")), gp_number(low), gp_number(high),
      gp_number(1.15 * top_of(marks, &LevelMark::Et_m, Et_m)),
      gp_number(1.6 * top_of(marks, &LevelMark::ER_deg, ER_deg)));
  // As many labels as fit beside each other, at multiples of the step.
  const double n_labels = std::max(1.0, std::floor(axis_cm / label_cm));
  const double every = std::ceil((high - low) / step / n_labels);
  panel.settings += "set format x \"%.4g\"\n";
  if (std::isfinite(every) && every > 0)
    panel.settings += fmt::format("set xtics {}\n", gp_number(every * step));
  panel.settings += stated_line(Et_m, "first", "#000000") + stated_line(ER_deg, "second", "#909090");
  const double width = 0.75 * step / static_cast<double>(bodies.size());
  for (const bool bars : {true, false}) {
    for (size_t i = 0; i < bodies.size(); ++i) {
      const std::string x = only_where({{"panel", name}, {"body", bodies[i]}},
                                       bars ? "column(\"bar_x\")" : "column(\"level\")");
      const std::string colour = line_colour(i);
      if (bars) {
        panel.plots.push_back(fmt::format(
            "data using {}:(column(\"ER_deg\")):({}) axes x1y2 with boxes fc rgb \"{}\" fs transparent "
            "solid 0.3 noborder",
            x, gp_number(0.9 * width), colour));
      } else {
        panel.plots.push_back(interval_plot(x, "Et_low_m", "Et_high_m", colour, 1));
        panel.plots.push_back(fmt::format("data using {}:(column(\"Et_m\")) {}", x, mark_style(i)));
      }
    }
  }
  return panel;
}

}  // namespace

std::vector<Figure> paper_noise_figures(const std::vector<PaperSweep>& sweeps) {
  Figure figure;
  figure.name = "fig4_paper";
  std::vector<LevelMark> all;
  std::vector<Panel> panels;
  const std::vector<std::string> bodies = {"Ego", "Obj1", "Obj2", "Obj3"};  // in the paper's figure
  std::vector<std::string> sources, not_of_paper;
  const double axis_cm = 18.0 / static_cast<double>(paper().stated.size()) - fig4_left_cm - fig4_right_cm;
  for (const auto& [parameter, stated] : paper().stated.items()) {
    const auto sweep = std::ranges::find_if(sweeps, [&, &parameter = parameter](const PaperSweep& s) {
      return !s.levels.empty() && s.levels.front().parameter == parameter;
    });
    if (sweep == sweeps.end()) continue;
    std::vector<LevelMark> marks;
    std::vector<std::string> ids;
    for (const std::string& name : bodies) {
      for (const NoiseLevelRow& row : sweep->levels) {
        if (row.estimator != paper().method || row.noise.find(" (spatial ") != std::string::npos) continue;
        const std::string* const of_row = find_in(sweep->paper_names, row.body);
        if (of_row == nullptr || !std::ranges::count(bodies, *of_row)) {
          add_distinct(body_title(row.body), not_of_paper);
        } else if (*of_row == name) {
          marks.push_back(
              {parameter, name, row.level, row.level, mean_error(row, "Et_m"), mean_error(row, "ER_deg")});
          const std::string title = body_title(row.body);  // "object 2"
          if (name != bodies.front() && name != replaced(title, "object ", "Obj"))
            add_distinct(fmt::format("{} is {}", name, title), ids);
        }
      }
    }
    if (marks.empty()) continue;
    double step = marks.back().level;
    for (size_t i = 1; i < marks.size(); ++i)
      if (marks[i].level > marks[i - 1].level) step = std::min(step, marks[i].level - marks[i - 1].level);
    const auto n = static_cast<double>(bodies.size());
    for (LevelMark& mark : marks) {
      const auto place = static_cast<double>(std::ranges::find(bodies, mark.body) - bodies.begin());
      mark.bar_x += (place - (n - 1) / 2) * 0.75 * step / n;
    }
    panels.push_back(panel_of(parameter, marks, bodies, step, axis_cm));
    const NoiseLevelRow& first = sweep->levels.front();
    sources.push_back(fmt::format("{} on {}{}", stated.at("title").get<std::string>(),
                                  data_title(first.dataset, first.sequence),
                                  ids.empty() ? "" : fmt::format(" (there {})", fmt::join(ids, ", "))));
    std::ranges::move(marks, std::back_inserter(all));
  }
  if (panels.empty()) return {};
  Fields<LevelMark> fields = {{Column::text("panel"), &LevelMark::panel},
                              {Column::text("body"), &LevelMark::body},
                              {Column::text("level"), &LevelMark::level},
                              {Column::text("bar_x"), &LevelMark::bar_x}};
  fields.add(estimate_fields(Column::text("Et_m"), "Et_low_m", "Et_high_m"), &LevelMark::Et_m);
  fields.add(estimate_fields(Column::text("ER_deg"), "ER_low_deg", "ER_high_deg"), &LevelMark::ER_deg);
  figure.data = table_of("", "", fields, all);
  std::vector<LegendEntry> legend;
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (std::ranges::count(all, bodies[i], &LevelMark::body) > 0)
      legend.push_back({bodies[i], mark_style(i)});
  }
  legend.push_back({"paper, E_t", "with lines lc rgb \"#000000\" dt 2 lw 1"});
  legend.push_back({"paper, E_R", "with lines lc rgb \"#909090\" dt 2 lw 1"});
  const PanelLayout layout{.columns = panels.size(),
                           .width_cm = panels.size() == 1 ? 9.0 : 18.0,
                           .panel_height_cm = 5.8,
                           .left_cm = fig4_left_cm,
                           .right_cm = fig4_right_cm,
                           .bottom_cm = 1.3};
  set_panels(layout, legend, panels, figure);
  figure.script += "unset y2tics\nunset y2label\nunset arrow\n";
  figure.caption = fmt::format(
      "Fig. 4: mean error of the joint optimisation against {}. Curves: E_t with 95 % intervals, left "
      "axis; bars: E_R, right axis; dashed: largest errors that the paper states.{}",
      fmt::join(sources, ", and "),
      not_of_paper.empty()
          ? ""
          : fmt::format(" Not in the paper and not drawn: {}.", fmt::join(not_of_paper, ", ")));
  return {figure};
}

namespace {

Panel panel_of(const MetricDefinition& error, const std::string& body,
               const std::vector<std::string>& estimators, const SystemStyles& systems, double first,
               double last, double lowest, double highest) {
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
    panel.plots.push_back(interval_plot(x, "low", "high", systems.colour(estimators[i]), 1));
    panel.plots.push_back(
        fmt::format("data using {}:(column(\"ratio\")) {}", x, systems.line(estimators[i])));
  }
  return panel;
}

Figure figure_of(const std::vector<const NoiseLevelRow*>& rows, const SystemStyles& systems) {
  const NoiseLevelRow& first = *rows.front();
  Figure figure;
  figure.name = "efficiency_" + file_stem(first.parameter) + "_" + file_stem(first.dataset) + "_" +
                file_stem(first.sequence);
  const std::vector<const MetricDefinition*> errors = bounded_errors();
  figure.data = figure_data({"error", "body", "estimator", "level", "ratio", "low", "high"});
  double low = INFINITY, high = 0, lowest = 0.5, highest = 2;
  for (const MetricDefinition* error : errors) {
    for (const NoiseLevelRow* row : rows) {
      const Efficiency* e = find_in(row->limit.efficiency, error->name);
      if (e == nullptr || e->efficiency <= 0) continue;
      const auto [value, interval] = e->ratio();
      figure.data.add_row(
          {error->stem(), row->body, row->estimator, row->level, value, low_of(interval), high_of(interval)});
      low = std::min(low, row->level);
      high = std::max(high, row->level);
      lowest = std::min(lowest, interval ? interval->low : value);
      highest = std::max(highest, interval ? interval->high : value);
    }
  }
  if (figure.data.rows.empty()) return figure;
  std::vector<std::string> bodies = distinct(rows, &NoiseLevelRow::body);
  const size_t n_bodies = bodies.size();
  bodies.resize(std::min(n_bodies, most_bodies));
  const std::vector<std::string> estimators = in_order(distinct(rows, &NoiseLevelRow::estimator));
  std::vector<Panel> panels;
  for (const std::string& body : bodies) {
    for (const MetricDefinition* error : errors) {
      panels.push_back(panel_of(*error, body, estimators, systems, low, high, lowest, highest));
      const std::string title =
          body == bodies.back() ? parameter_title(first.parameter, rows.back()->noise) : "";
      panels.back().settings += fmt::format("set xlabel {} noenhanced offset 0,0.4\n", gp_text(title));
    }
  }
  std::vector<LegendEntry> legend;
  for (const std::string& e : estimators) legend.push_back({estimator_title(e), systems.line(e)});
  legend.push_back({"bound", "with lines lc rgb \"#000000\" dt 2 lw 1"});
  const PanelLayout layout{.columns = errors.size(), .width_cm = 18.0};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Errors over their Cramer-Rao bound, {} {}, with 95 % intervals over {} seeds: 1 is the limit of "
      "unbiased estimates from flow and one depth.{}",
      first.dataset, first.sequence, first.n_seeds, drawn_bodies(bodies.size(), n_bodies));
  return figure;
}

}  // namespace

std::vector<Figure> efficiency_figures(const std::vector<NoiseLevelRow>& rows) {
  std::map<std::tuple<std::string, std::string, std::string>, std::vector<const NoiseLevelRow*>> groups;
  for (const NoiseLevelRow& row : rows) {
    if (!row.limit.efficiency.empty()) groups[{row.parameter, row.dataset, row.sequence}].push_back(&row);
  }
  const SystemStyles systems = styles_of(rows);
  std::vector<Figure> figures;
  for (const auto& [key, group] : groups) {
    Figure figure = figure_of(group, systems);
    if (!figure.data.rows.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
