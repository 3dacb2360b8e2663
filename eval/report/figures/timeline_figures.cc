#include "sextant/eval/report/figures/record_figures.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

constexpr size_t most_drawn_bodies = 6;
constexpr double rounding = 1e-9;           // smaller errors are rounding of exact data
constexpr const char* no_estimate = "NaN";  // interrupts gnuplot's line

using Bodies = std::map<int, RecordRefs>;  // by body_order()

/// The camera, and the objects with the most estimates.
std::vector<int> chosen(const Bodies& bodies) {
  std::vector<std::pair<ptrdiff_t, int>> by_size;
  for (const auto& [order, records] : bodies) {
    const ptrdiff_t n = std::ranges::count_if(records, [](const Record* r) { return r->status == Status::ok && has_truth(*r); });
    if (n > 0) by_size.emplace_back(records.front()->is_ego() ? -1'000'000'000 : -n, order);
  }
  std::ranges::sort(by_size);
  by_size.resize(std::min(by_size.size(), most_drawn_bodies));
  std::vector<int> orders;
  for (const auto& [n, order] : by_size) orders.push_back(order);
  std::ranges::sort(orders);
  return orders;
}

std::string body_style(size_t i) {
  return fmt::format("with linespoints lc rgb \"{}\" lw 1.3 pt {} ps 0.25", line_colour(i), filled_point(i));
}

struct TimelineRow {
  std::string error, body;
  int frame = 0;
  std::optional<double> value{};
};

/// Adds the rows of one error and body; returns false if none has a number.
bool add_rows(const MetricDefinition& error, const RecordRefs& records, const MetricPreset& preset,
              std::vector<TimelineRow>& rows) {
  bool any = false;
  for (const Record* record : records) {
    const std::string key = record->is_ego() ? error.name : preset.object_key(error.name);
    auto value = record->status == Status::ok ? find_number(record->errors, key) : std::nullopt;
    if (value && *value <= rounding) value.reset();
    any |= value.has_value();
    rows.push_back({error.name, record->body, record->frame, value});
  }
  return any;
}

std::optional<double> floor_of(const RecordRefs& ego) {
  for (const Record* record : ego) {
    if (const auto floor_m = find_number(record->values, "step_floor_m")) return floor_m;
  }
  return std::nullopt;
}

Figure figure_of(const std::string& title, const std::string& stem, const Bodies& bodies,
                 const MetricPreset& preset) {
  Figure figure;
  figure.name = "timeline_" + stem;
  std::vector<TimelineRow> rows;
  const std::vector<int> orders = chosen(bodies);
  std::vector<LegendEntry> legend;
  for (size_t i = 0; i < orders.size(); ++i)
    legend.push_back({body_title(bodies.at(orders[i]).front()->body), body_style(i)});
  std::vector<Panel> panels;
  bool has_floor = false;
  for (const MetricDefinition* error : metrics_for(in_summary)) {
    if (error->map != NumberMap::errors || error->better != Better::lower) continue;
    Panel panel{
        "",
        "set xlabel \"frame\" offset 0,0.4\nset logscale y\nset format y \"%g\"\nset autoscale xfix\n",
        {}};
    panel.settings +=
        fmt::format("set ylabel {} noenhanced\n",
                    gp_text(error->name == "epe_refined_px" ? "EPE after [px]" : error->heading()));
    for (size_t i = 0; i < orders.size(); ++i) {
      const RecordRefs& records = bodies.at(orders[i]);
      if (!add_rows(*error, records, preset, rows)) continue;
      const std::string x =
          only_where({{"error", error->name}, {"body", records.front()->body}}, "column(\"frame\")");
      panel.plots.push_back(fmt::format("data using {}:(column(\"value\")) {}", x, body_style(i)));
    }
    if (panel.plots.empty()) continue;
    const auto ego = bodies.find(orders.front());
    const auto floor_m = error->name == "Et_m" ? floor_of(ego->second) : std::nullopt;
    if (floor_m) {
      panel.plots.push_back(fmt::format("{} with lines lc rgb \"#000000\" dt 2 lw 1", gp_number(*floor_m)));
      has_floor = true;
    }
    panels.push_back(std::move(panel));
  }
  if (panels.empty()) return {};
  figure.data = table_of<TimelineRow>(
      "", "",
      {{Column::text("error"), &TimelineRow::error},
       {Column::text("body"), &TimelineRow::body},
       {Column::text("frame"), &TimelineRow::frame},
       {Column::text("value"),
        [](const TimelineRow& row) { return row.value ? Cell(*row.value) : Cell(no_estimate); }}},
      rows);
  if (has_floor) legend.push_back({"floor of the camera's truth", "with lines lc rgb \"#000000\" dt 2 lw 1"});
  const PanelLayout layout{.columns = std::min<size_t>(2, panels.size()),
                           .width_cm = panels.size() == 1 ? 8.8 : 18.0,
                           .panel_height_cm = 4.8,
                           .left_cm = 1.8};
  set_panels(layout, legend, panels, figure);
  figure.caption = "Errors by frame, " + title + ". A gap: no estimate, or no truth.";
  return figure;
}

}  // namespace

std::vector<Figure> timeline_figures(const std::vector<Record>& records, const MetricPreset& preset) {
  std::map<std::tuple<std::string, std::string, std::string>, std::map<uint64_t, Bodies>> groups;
  for (const Record& r : records)
    groups[{r.dataset, r.sequence, r.estimator}][r.seed][body_order(r.body)].push_back(&r);
  std::vector<Figure> figures;
  for (const auto& [key, by_seed] : groups) {
    const auto& [dataset, sequence, estimator] = key;
    Figure figure = figure_of(fmt::format("{} {}, {}", dataset, sequence, estimator),
                              file_stem(fmt::format("{}_{}_{}", dataset, sequence, estimator)),
                              by_seed.begin()->second, preset);
    if (!figure.data.rows.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
