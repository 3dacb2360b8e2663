#include "sextant/eval/report/figures/record_figures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/paper.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

/// x of the i-th of n items of a category: side by side in 0.8 of its width.
struct Slots {
  size_t n;
  double width() const { return 0.8 / static_cast<double>(n); }
  double x(size_t c, size_t i) const {
    return static_cast<double>(c) + (static_cast<double>(i) - (static_cast<double>(n) - 1) / 2) * width();
  }
};

/// Abbreviates "object 12" to "obj. 12", because labels stand side by side.
std::string short_title(const std::string& title) {
  constexpr std::string_view word = "object ";
  return title.starts_with(word) ? "obj. " + title.substr(word.size()) : title;
}

std::string category_axis(const std::vector<BodyRecords>& bodies) {
  std::vector<std::string> labels;
  for (const BodyRecords& body : bodies) labels.push_back(short_title(body.title));
  return fmt::format("set xrange [-0.6:{}]\nset xtics scale 0 ({}) noenhanced\n",
                     static_cast<double>(bodies.size()) - 0.4, gp_tics(labels));
}

// ---- EPE before and after

std::optional<IntervalEstimate> mean_epe(const RecordRefs& records, const char* key) {
  const RecordRefs given =
      records_where(records, [](const Record& record) { return record.flow_truth == "given"; });
  const Clusters clusters(given);
  std::vector<double> values;
  std::vector<uint64_t> labels;
  for (const Record* record : given) {
    const auto value = find_number(record->errors, key);
    if (!value) continue;
    values.push_back(*value);
    labels.push_back(clusters.of(*record));
  }
  if (values.empty()) return std::nullopt;
  return summarize_sample(ClusteredSample(values, labels)).mean;
}

/// A kind of bar that each body has: "before", or "after" for an estimator that refines the flow.
struct EpeBar {
  std::string name;  ///< column `stage` of the data
  std::string title;
  std::string colour;
  std::string estimator;
  const char* key;

  std::string style() const { return fmt::format("with boxes fc rgb \"{}\" fs solid 0.75 noborder", colour); }
};

/// Returns the styles of all estimators of the sets.
SystemStyles styles_of(const std::vector<RecordSet>& sets) {
  std::vector<std::string> estimators;
  for (const RecordSet& set : sets) std::ranges::copy(estimators_of(set), std::back_inserter(estimators));
  return SystemStyles(sorted_systems(std::move(estimators)));
}

std::vector<EpeBar> epe_bars(const std::vector<RecordSet>& sets) {
  const SystemStyles styles = styles_of(sets);
  std::vector<EpeBar> bars;
  for (const RecordSet& set : sets) {
    for (const std::string& estimator : in_order(estimators_of(set))) {
      const bool refines = std::ranges::any_of(set.bodies, [&](const BodyRecords& body) {
        return std::ranges::any_of(of_estimator(body.records, estimator), [](const Record* record) {
          return record->flow_truth == "given" && record->errors.contains("epe_refined_px") &&
                 record->errors.at("epe_refined_px") != record->errors.at("epe_initial_px");
        });
      });
      const std::string name = "after " + estimator;
      if (!refines || std::ranges::find(bars, name, &EpeBar::name) != bars.end()) continue;
      if (bars.empty())
        bars.push_back({"before", "before optimisation", "#A0A0A0", estimator, "epe_initial_px"});
      bars.push_back({name, "after, " + estimator_title(estimator), styles.colour(estimator), estimator,
                      "epe_refined_px"});
    }
  }
  return bars;
}

/// Data of figure 5, in our form and in the paper's.
Table epe_data() { return figure_data({"set", "body", "stage", "x", "epe_px", "low_px", "high_px"}); }

void add_epe(const std::string& set, const BodyRecords& body, const EpeBar& bar, double x, Table& data) {
  if (const auto epe_px = mean_epe(of_estimator(body.records, bar.estimator), bar.key))
    data.add_row(
        {set, body.title, bar.name, x, epe_px->value, low_of(epe_px->interval), high_of(epe_px->interval)});
}

Panel epe_panel(const RecordSet& set, const std::vector<EpeBar>& bars, Table& data) {
  Panel panel{set.title, category_axis(set.bodies), {}};
  panel.settings += "set ylabel \"mean EPE [px]\"\nset yrange [0:*]\n";
  const Slots slots{bars.size()};
  for (size_t i = 0; i < bars.size(); ++i) {
    for (size_t c = 0; c < set.bodies.size(); ++c)
      add_epe(set.name, set.bodies[c], bars[i], slots.x(c, i), data);
    const std::string x = only_where({{"set", set.name}, {"stage", bars[i].name}}, "column(\"x\")");
    panel.plots.push_back(
        fmt::format("data using {}:(column(\"epe_px\")):({}) {}", x, 0.9 * slots.width(), bars[i].style()));
    panel.plots.push_back(interval_plot(x, "low_px", "high_px", "#000000", 0.8));
  }
  return panel;
}

// ---- distribution

/// Errors of one body for one estimator.
struct Box {
  std::string error, body, estimator;
  double x = 0;
  std::vector<double> values;
};

/// Range of a logarithmic axis.
struct LogRange {
  double low = 0, high = 0;
  bool has_rounding = false;  ///< some drawn quantiles are only rounding and are drawn at the lower end
};

/// Returns the range of all drawn quantiles of an error, except those that are only rounding; nullopt if no
/// body has the error.
std::optional<LogRange> value_range(const std::vector<Box>& boxes, const std::string& error) {
  LogRange range{std::numeric_limits<double>::infinity(), 0};
  bool any = false;
  for (const Box& box : boxes) {
    if (box.error != error) continue;
    any = true;
    for (const double p : {0.05, 0.25, 0.5, 0.75, 0.95}) {
      const double value = quantile(box.values, p);
      range.has_rounding = range.has_rounding || value <= largest_rounding;
      if (value <= largest_rounding) continue;
      range.low = std::min(range.low, value);
      range.high = std::max(range.high, value);
    }
  }
  if (!any) return std::nullopt;
  if (range.high == 0) return LogRange{largest_rounding, 10 * largest_rounding, true};
  range.low = range.has_rounding ? std::max(largest_rounding, 0.5 * range.low) : 0.7 * range.low;
  range.high *= 1.4;
  return range;
}

/// Returns tics at powers of ten and, for a short range, also at 2 and 5 times these.
std::string logarithmic_tics(const LogRange& range) {
  const bool is_short = range.high < 100 * range.low;
  std::string tics;
  for (int exponent = -9; exponent < 9; ++exponent) {
    for (const int digit : {1, 2, 5}) {
      const double at = digit * std::pow(10.0, exponent);
      if (at < range.low || at > range.high || (digit != 1 && !is_short)) continue;
      tics += (tics.empty() ? "" : ", ") + gp_number(at);
    }
  }
  return tics;
}

void add_box(const std::string& error, const BodyRecords& body, const std::string& estimator, double x,
             std::vector<Box>& boxes) {
  const auto records = of_estimator(body.records, estimator);
  const std::vector<double> values = numbers_of(records, NumberMap::errors, error);
  if (values.empty()) return;
  boxes.push_back({error, body.title, estimator, x, values});
}

struct BoxPanel {
  Panel panel;
  bool has_rounding = false;
};

/// Makes the panel of one error. Returns nullopt if no body has this error, because gnuplot cannot draw an
/// empty panel.
std::optional<BoxPanel> box_panel(const MetricDefinition& error, const RecordSet& set,
                                  const std::vector<std::string>& estimators, const SystemStyles& styles,
                                  std::vector<Box>& boxes) {
  Panel panel{"", category_axis(set.bodies), {}};
  const Slots slots{estimators.size()};
  for (size_t i = 0; i < estimators.size(); ++i) {
    for (size_t c = 0; c < set.bodies.size(); ++c)
      add_box(error.name, set.bodies[c], estimators[i], slots.x(c, i), boxes);
  }
  const auto range = value_range(boxes, error.name);
  if (!range) return std::nullopt;
  const auto least = range->has_rounding ? std::optional(range->low) : std::nullopt;
  for (const std::string& estimator : estimators) {
    const std::string x = only_where({{"error", error.name}, {"estimator", estimator}}, "column(\"x\")");
    std::ranges::move(box_plots(x, 0.75 * slots.width(), styles.colour(estimator), least),
                      std::back_inserter(panel.plots));
  }
  panel.settings +=
      fmt::format("set ylabel \"{}\" noenhanced\nset yrange [{}:{}]\nset logscale y\nset ytics ({})\n",
                  error.heading(), gp_number(range->low), gp_number(range->high), logarithmic_tics(*range));
  return BoxPanel{std::move(panel), range->has_rounding};
}

}  // namespace

std::vector<Figure> epe_figures(const std::vector<RecordSet>& sets) {
  Figure figure;
  figure.name = "fig5_epe";
  const std::vector<EpeBar> bars = epe_bars(sets);
  std::vector<Panel> panels;
  figure.data = epe_data();
  for (const RecordSet& set : sets) {
    const size_t n_before = figure.data.rows.size();
    Panel panel = epe_panel(set, bars, figure.data);
    if (figure.data.rows.size() > n_before) panels.push_back(std::move(panel));
  }
  if (panels.empty()) return {};
  std::vector<LegendEntry> legend;
  for (const EpeBar& bar : bars) legend.push_back({bar.title, bar.style()});
  const PanelLayout layout{.columns = std::min<size_t>(3, panels.size()),
                           .width_cm = panels.size() == 1 ? 8.8 : 18.0,
                           .panel_height_cm = 4.6,
                           .bottom_cm = 0.6};
  set_panels(layout, legend, panels, figure);
  figure.caption =
      "Fig. 5, mean end-point error of the flow before and after the optimisation, over inliers, with 95 % "
      "intervals.";
  return {figure};
}

std::vector<Figure> paper_epe_figures(const std::vector<RecordSet>& sets) {
  const std::vector<EpeBar> bars = {{"before", "initial flow", "#999999", paper().method, "epe_initial_px"},
                                    {"after", "optimised flow", "#0072B2", paper().method, "epe_refined_px"}};
  const Slots slots{bars.size()};
  Figure figure;
  figure.name = "fig5_paper";
  figure.data = epe_data();
  std::vector<std::string> labels;
  for (const RecordSet& set : sets) {
    for (const BodyRecords& body : set.bodies) {
      const size_t n_before = figure.data.rows.size();
      for (size_t i = 0; i < bars.size(); ++i)
        add_epe(set.title, body, bars[i], slots.x(labels.size(), i), figure.data);
      if (figure.data.rows.size() == n_before) continue;
      labels.push_back(set.title.substr(0, set.title.find(',')) + " " + body.title);
    }
  }
  if (labels.empty()) return {};
  Panel panel;
  panel.settings = fmt::format(
      "set xrange [-0.6:{}]\nset xtics scale 0 rotate by -25 ({}) noenhanced\nset ylabel \"mean EPE "
      "[px]\"\nset yrange [0:*]\n",
      gp_number(static_cast<double>(labels.size()) - 0.4), gp_tics(labels));
  std::vector<LegendEntry> legend;
  for (const EpeBar& bar : bars) {
    const std::string x = only_where({{"stage", bar.name}}, "column(\"x\")");
    panel.plots.push_back(fmt::format("data using {}:(column(\"epe_px\")):({}) {}", x,
                                      gp_number(0.9 * slots.width()), bar.style()));
    panel.plots.push_back(interval_plot(x, "low_px", "high_px", "#000000", 0.8));
    legend.push_back({bar.title, bar.style()});
  }
  const PanelLayout layout{
      .width_cm = 13.0, .panel_height_cm = 5.6, .right_cm = 2.4, .bottom_cm = 1.8, .top_cm = 0.2};
  set_panels(layout, legend, {panel}, figure);
  figure.script += "set xtics norotate\n";
  figure.caption =
      "Fig. 5: mean end-point error of the initial and of the optimised flow, over "
      "inliers, with 95 % intervals.";
  return {figure};
}

std::vector<Figure> distribution_figures(const std::vector<RecordSet>& sets) {
  std::vector<Figure> figures;
  const SystemStyles styles = styles_of(sets);
  for (const RecordSet& set : sets) {
    const std::vector<std::string> estimators = in_order(estimators_of(set));
    Figure figure;
    figure.name = "errors_" + file_stem(set.name);
    std::vector<Box> boxes;
    std::vector<Panel> panels;
    bool has_rounding = false;
    for (const MetricDefinition* error : metrics_for(compared)) {
      auto made = box_panel(*error, set, estimators, styles, boxes);
      if (!made) continue;
      has_rounding = has_rounding || made->has_rounding;
      panels.push_back(std::move(made->panel));
    }
    if (boxes.empty()) continue;
    Fields<Box> fields = {{Column::text("error"), &Box::error},
                          {Column::text("body"), &Box::body},
                          {Column::text("estimator"), &Box::estimator},
                          {Column::text("x"), &Box::x},
                          {Column::text("n"), [](const Box& box) { return box.values.size(); }}};
    fields.add(box_fields(), [](const Box& box) { return &box.values; });
    figure.data = table_of("", "", fields, boxes);
    std::vector<LegendEntry> legend;
    for (const std::string& estimator : estimators)
      legend.push_back({estimator_title(estimator),
                        fmt::format("with boxes fc rgb \"{}\" fs transparent solid 0.35 border",
                                    styles.colour(estimator))});
    PanelLayout layout{.panel_height_cm = 4.4, .left_cm = 1.9, .bottom_cm = 0.6, .top_cm = 0.25};
    set_panels(layout, legend, panels, figure);
    figure.caption = fmt::format(
        "Distribution of the errors, {}: median, quartiles, whiskers at 5 and 95 %, over all pairs and "
        "seeds.{}",
        set.title, has_rounding ? rounding_note() : "");
    figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
