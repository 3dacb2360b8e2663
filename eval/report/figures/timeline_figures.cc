#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/paper.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {

std::string seed_text(uint64_t seed, size_t n_seeds) {
  return n_seeds > 1 ? fmt::format(", seed {} of {}", seed, n_seeds) : "";
}

std::string rounding_note() {
  return fmt::format(
      " Errors of at most {:g}, in the unit of the axis, are rounding and are drawn at its lower end.",
      largest_rounding);
}

namespace {

constexpr size_t most_drawn_bodies = 6;
constexpr const char* no_estimate = "NaN";  // interrupts gnuplot's line

using Bodies = std::map<int, RecordRefs>;  // by body_order()

/// Returns the bodies that come first in `by_size`, six at most, in ascending order. An entry of `by_size` is
/// the negative number of estimates of a body, and its body_order().
std::vector<int> largest(std::vector<std::pair<ptrdiff_t, int>> by_size) {
  std::ranges::sort(by_size);
  by_size.resize(std::min(by_size.size(), most_drawn_bodies));
  std::vector<int> orders;
  for (const auto& [negative_n, order] : by_size) orders.push_back(order);
  std::ranges::sort(orders);
  return orders;
}

/// Returns the camera and the objects with the most estimates, by body_order().
std::vector<int> chosen(const Bodies& bodies) {
  std::vector<std::pair<ptrdiff_t, int>> by_size;
  for (const auto& [order, records] : bodies) {
    const ptrdiff_t n = std::ssize(records_where(records, is_evaluated));
    if (n > 0) by_size.emplace_back(records.front()->is_ego() ? -1'000'000'000 : -n, order);
  }
  return largest(std::move(by_size));
}

size_t n_with_estimates(const Bodies& bodies) {
  return static_cast<size_t>(std::ranges::count_if(bodies, [](const auto& of_body) {
    return std::ranges::any_of(of_body.second, [](const Record* r) { return is_evaluated(*r); });
  }));
}

/// Returns the sentence of a caption that says which bodies are drawn; "" if all are.
std::string choice_text(const std::string& which, size_t n_drawn, size_t n_all) {
  if (n_drawn == n_all) return "";
  return fmt::format(" Drawn are {} of {} {} with the most estimates.", n_drawn, n_all, which);
}

std::string body_style(size_t i) {
  return fmt::format("with linespoints lc rgb \"{}\" lw 1.3 pt {} ps 0.25", line_colour(i), filled_point(i));
}

/// Numbers that a panel with a logarithmic axis shows.
struct Shown {
  bool has_rounding = false;
  double lowest = std::numeric_limits<double>::infinity();  ///< of those above rounding

  void include(double value) {
    has_rounding = has_rounding || value <= largest_rounding;
    if (value > largest_rounding) lowest = std::min(lowest, value);
  }
  /// Returns the lower end of the axis, a power of ten below all numbers, if there are numbers that are only
  /// rounding; otherwise gnuplot chooses it.
  std::optional<double> lower_end() const {
    if (!has_rounding) return std::nullopt;
    if (!std::isfinite(lowest)) return largest_rounding;
    return std::max(largest_rounding, std::pow(10, std::floor(std::log10(lowest / 2))));
  }
};

/// Adds the rows of one error and body; returns false if none has a number.
bool add_rows(const MetricDefinition& error, const RecordRefs& records, const MetricPreset& preset,
              Shown& shown, Table& data) {
  bool any = false;
  for (const Record* record : records) {
    const std::string key = record->is_ego() ? error.name : preset.object_key(error.name);
    const auto value = record->status == Status::ok ? find_number(record->errors, key) : std::nullopt;
    if (value) shown.include(*value);
    any |= value.has_value();
    data.add_row({error.name, record->body, record->frame, value ? Cell(*value) : Cell(no_estimate)});
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
  figure.data = figure_data({"error", "body", "frame", "value"});
  const std::vector<int> orders = chosen(bodies);
  std::vector<LegendEntry> legend;
  for (size_t i = 0; i < orders.size(); ++i)
    legend.push_back({body_title(bodies.at(orders[i]).front()->body), body_style(i)});
  std::vector<Panel> panels;
  bool has_floor = false, has_rounding = false;
  for (const MetricDefinition* error : metrics_for(in_summary)) {
    if (error->map != NumberMap::errors || error->better != Better::lower) continue;
    Panel panel{
        "",
        "set xlabel \"frame\" offset 0,0.4\nset logscale y\nset format y \"%g\"\nset autoscale xfix\n",
        {}};
    panel.settings +=
        fmt::format("set ylabel {} noenhanced\n",
                    gp_text(error->name == "epe_refined_px" ? "EPE after [px]" : error->heading()));
    Shown shown;
    std::vector<size_t> with_numbers;
    for (size_t i = 0; i < orders.size(); ++i) {
      if (add_rows(*error, bodies.at(orders[i]), preset, shown, figure.data)) with_numbers.push_back(i);
    }
    if (with_numbers.empty()) continue;
    const auto floor_m = error->name == "Et_m" ? floor_of(bodies.at(orders.front())) : std::nullopt;
    if (floor_m) shown.include(*floor_m);
    for (const size_t i : with_numbers) {
      const std::string x = only_where({{"error", error->name}, {"body", bodies.at(orders[i]).front()->body}},
                                       "column(\"frame\")");
      panel.plots.push_back(
          fmt::format("data using {}:{} {}", x, column_from("value", shown.lower_end()), body_style(i)));
    }
    if (floor_m) {
      panel.plots.push_back(fmt::format("{} with lines lc rgb \"#000000\" dt 2 lw 1", gp_number(*floor_m)));
      has_floor = true;
    }
    if (const auto end = shown.lower_end()) {
      has_rounding = true;
      panel.settings += std::isfinite(shown.lowest)
                            ? fmt::format("set yrange [{}:*]\n", gp_number(*end))
                            : fmt::format("set yrange [{}:{}]\n", gp_number(*end), gp_number(10 * *end));
    }
    panels.push_back(std::move(panel));
  }
  if (panels.empty()) return {};
  if (has_floor) legend.push_back({"floor of the camera's truth", "with lines lc rgb \"#000000\" dt 2 lw 1"});
  const PanelLayout layout{.columns = std::min<size_t>(2, panels.size()),
                           .width_cm = panels.size() == 1 ? 8.8 : 18.0,
                           .panel_height_cm = 4.8,
                           .left_cm = 1.8};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Errors by frame, {}. A gap: no estimate, or no truth.{}{}", title, has_rounding ? rounding_note() : "",
      choice_text("bodies: the camera and the objects", orders.size(), n_with_estimates(bodies)));
  return figure;
}

}  // namespace

std::vector<Figure> timeline_figures(const std::vector<Record>& records, const MetricPreset& preset) {
  std::vector<Figure> figures;
  const auto curve_of = [](const Record& r) { return std::tuple(r.dataset, r.sequence, r.estimator); };
  for (const auto& [curve, of_curve] : group_by(records, curve_of)) {
    const auto& [dataset, sequence, estimator] = curve;
    const auto by_seed = group_by(of_curve, &Record::seed);
    const std::string seed = seed_text(by_seed.begin()->first, by_seed.size());
    Figure figure = figure_of(fmt::format("{} {}, {}{}", dataset, sequence, estimator, seed),
                              file_stem(fmt::format("{}_{}_{}", dataset, sequence, estimator)),
                              group_by(by_seed.begin()->second, order_of), preset);
    if (!figure.data.rows.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

namespace {

constexpr size_t min_estimates = 5;
// The points show a true speed between two gaps, where there is no line.
constexpr const char* truth_style = "with linespoints lc rgb \"#000000\" lw 1.5 pt 7 ps 0.15";

bool has_speed(const Record& record) {
  return !record.is_ego() && record.status == Status::ok && record.values.contains("v_kmh");
}

/// Returns the ids of the objects with estimates in the most frames, and sets the number of objects among
/// which they were chosen.
std::vector<int> chosen_objects(const RecordRefs& records, size_t& n_objects) {
  std::vector<std::pair<ptrdiff_t, int>> by_size;
  for (const auto& [id, of_object] : group_by(records, order_of)) {
    const size_t n_frames = group_by(of_object, &Record::frame).size();
    if (n_frames >= min_estimates) by_size.emplace_back(-static_cast<ptrdiff_t>(n_frames), id);
  }
  n_objects = by_size.size();
  return largest(std::move(by_size));
}

/// Adds a row without numbers, which interrupts the line, if `frame` does not follow the last row of the same
/// line.
void add_gap(const std::string& body, const std::string& series, int frame, Table& data) {
  if (data.rows.empty()) return;
  const std::vector<Cell>& last = data.rows.back();
  const bool is_same = *last[0].text() == body && *last[1].text() == series;
  const int next = static_cast<int>(*last[2].number()) + 1;
  if (is_same && next < frame) data.add_row({body, series, next, no_estimate, no_estimate, no_estimate});
}

void add_rows(const std::string& body, const RecordRefs& of_body, std::optional<double> floor_kmh,
              Table& data) {
  // The true speed depends slightly on the estimator, since it is taken at its centroid; the first
  // estimator's is drawn.
  std::map<int, double> truth;
  for (const Record* record : of_body) {
    if (const auto v = find_number(record->values, "v_gt_kmh")) truth.emplace(record->frame, *v);
  }
  for (const auto& [frame, v] : truth) {
    const auto floor = floor_kmh ? std::optional(Interval{v - *floor_kmh, v + *floor_kmh}) : std::nullopt;
    add_gap(body, "truth", frame, data);
    data.add_row({body, "truth", frame, v, low_of(floor), high_of(floor)});
  }
  for (const std::string& estimator : distinct(of_body, &Record::estimator)) {
    for (const Record* record : of_body) {
      if (record->estimator != estimator) continue;
      add_gap(body, estimator, record->frame, data);
      data.add_row({body, estimator, record->frame, record->values.at("v_kmh"), Cell(), Cell()});
    }
  }
}

std::string numbered_style(const SystemStyles& systems, const std::string& estimator, size_t i) {
  const double size = std::max(0.3, 0.65 - 0.2 * static_cast<double>(i));
  return fmt::format("with linespoints lc rgb \"{}\" lw {} pt {} ps {:.2f}", systems.colour(estimator),
                     std::max(1.0, 2.5 - static_cast<double>(i)), systems.point(estimator), size);
}

Panel panel_of(const std::string& body, const std::vector<std::string>& estimators,
               const SystemStyles& systems, bool has_floor) {
  Panel panel{body_title(body),
              "set xlabel \"frame\" offset 0,0.4\nset ylabel \"speed [km/h]\"\nset offsets "
              "0,0,graph 0.08,graph 0.08\nset autoscale xfix\n",
              {}};
  const auto x = [&](const std::string& series) {
    return only_where({{"body", body}, {"series", series}}, "column(\"frame\")");
  };
  if (has_floor) {
    panel.plots.push_back(
        fmt::format("data using {}:(column(\"low_kmh\")):(column(\"high_kmh\")) with filledcurves fc "
                    "rgb \"#000000\" fs transparent solid 0.15 noborder",
                    x("truth")));
  }
  panel.plots.push_back(fmt::format("data using {}:(column(\"v_kmh\")) {}", x("truth"), truth_style));
  // Estimators often agree, so later ones are drawn smaller to keep the earlier ones visible.
  for (size_t i = 0; i < estimators.size(); ++i) {
    panel.plots.push_back(fmt::format("data using {}:(column(\"v_kmh\")) {}", x(estimators[i]),
                                      numbered_style(systems, estimators[i], i)));
  }
  return panel;
}

Figure figure_of(const RecordRefs& records, std::optional<double> floor_kmh, size_t n_seeds,
                 const SystemStyles& systems) {
  const Record& first = *records.front();
  Figure figure;
  figure.name = "speed_" + file_stem(first.dataset) + "_" + file_stem(first.sequence);
  figure.data = figure_data({"body", "series", "frame", "v_kmh", "low_kmh", "high_kmh"});
  const std::vector<std::string> estimators = in_order(distinct(records, &Record::estimator));
  std::vector<Panel> panels;
  size_t n_objects = 0;  // with enough estimates
  for (const int id : chosen_objects(records, n_objects)) {
    const RecordRefs of_body = records_where(records, [&](const Record& r) { return order_of(r) == id; });
    add_rows(object_body(id), of_body, floor_kmh, figure.data);
    panels.push_back(panel_of(object_body(id), estimators, systems, floor_kmh.has_value()));
  }
  if (panels.empty()) return figure;
  std::vector<LegendEntry> legend = {{"truth", truth_style}};
  if (floor_kmh)
    legend.push_back(
        {"truth \u00b1 floor", "with boxes fc rgb \"#000000\" fs transparent solid 0.15 noborder"});
  for (size_t i = 0; i < estimators.size(); ++i)
    legend.push_back({estimator_title(estimators[i]), numbered_style(systems, estimators[i], i)});
  const PanelLayout layout{.columns = std::min<size_t>(2, panels.size()),
                           .width_cm = panels.size() == 1 ? 8.8 : 18.0,
                           .panel_height_cm = 4.8};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Speed of the objects by frame, {} {}{}. A gap: no estimate.{}{}", first.dataset, first.sequence,
      seed_text(first.seed, n_seeds),
      choice_text(fmt::format("objects with at least {} estimates: those", min_estimates), panels.size(),
                  n_objects),
      floor_kmh ? fmt::format(" Band: error of the true speed itself, {:.1f} km/h (RMS) from the camera's "
                              "ground truth alone.",
                              *floor_kmh)
                : "");
  return figure;
}

}  // namespace

std::vector<Figure> speed_figures(const std::vector<Record>& records,
                                  const std::map<std::string, double>& floor_kmh) {
  const SystemStyles systems = styles_of(records);
  std::vector<Figure> figures;
  const auto data_of = [](const Record& r) { return std::pair(r.dataset, r.sequence); };
  for (const auto& [data, of_data] : group_by(records_where(records, has_speed), data_of)) {
    const auto by_seed = group_by(of_data, &Record::seed);
    Figure figure =
        figure_of(by_seed.begin()->second, find_number(floor_kmh, data.second), by_seed.size(), systems);
    if (!figure.data.rows.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

std::map<std::string, double> recorded_speed_floor_kmh(const std::vector<Record>& records) {
  std::map<std::string, double> floors;
  for (const Record& record : records) {
    if (const auto floor = find_number(record.values, "step_floor_m"))
      floors[record.sequence] = 3.6 * paper().recorded_rate_hz * *floor;
  }
  return floors;
}

}  // namespace sextant
