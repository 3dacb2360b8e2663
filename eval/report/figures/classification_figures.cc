#include "sextant/eval/report/figures/record_figures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/roc_curve.h"

namespace sextant {
namespace {

constexpr double min_false_alarms = 1e-4;  // of the logarithmic axis
constexpr const char* likelihood_score = "motion_sigmas";

/// What was decided about one detection, with what its test decides by; as count_classification counts them.
struct Decision {
  ScoredDetection scored;
  bool found_dynamic = false;
  bool should_be_found = false;  ///< faster than what its covariance lets one see
  bool has_limit = false;
};

std::optional<Decision> decision_of(const Record& record) {
  if (record.status == Status::gated && record.gate != Gate::is_static) return std::nullopt;
  const auto found = find_number(record.values, "dynamic");
  const auto truth = find_number(record.values, "dynamic_gt");
  auto score = find_number(record.values, likelihood_score);
  if (!score) score = find_number(record.values, "moving_share");
  if (!found || !truth || !score) return std::nullopt;
  Decision out{{*score, *truth != 0}, *found != 0};
  const auto limit = find_number(record.values, "detectable_kmh");
  const auto speed = find_number(record.values, "v_gt_origin_kmh");
  out.has_limit = limit && speed;
  out.should_be_found = out.has_limit && *speed > *limit;
  return out;
}

using Key = std::tuple<std::string, std::string, double, std::string>;  // dataset, sequence, level, estimator

std::map<Key, std::vector<Decision>> decisions_of(const std::vector<Record>& records) {
  std::map<Key, std::vector<Decision>> out;
  for (const Record& record : records) {
    if (const auto decision = decision_of(record))
      out[{record.dataset, record.sequence, record.level, record.estimator}].push_back(*decision);
  }
  return out;
}

std::optional<RocCurve> curve_of(const std::vector<Decision>& decisions) {
  std::vector<ScoredDetection> scored;
  for (const Decision& decision : decisions) scored.push_back(decision.scored);
  return roc_curve(std::move(scored));
}

Panel panel_of(const std::string& sequence, const std::vector<std::string>& estimators) {
  Panel panel{
      sequence,
      fmt::format(
          "set logscale x\nset xrange [{}:1]\nset yrange [0:1.02]\nset xlabel \"static called dynamic\" "
          "offset 0,0.4\nset ylabel \"dynamic found\"\nset format x \"10^{{%L}}\"\n",
          gp_number(min_false_alarms)),
      {}};
  for (const std::string& estimator : estimators) {
    panel.plots.push_back(
        fmt::format("data using {}:(column(\"true_positive_rate\")) with steps lc rgb \"{}\" lw 2",
                    only_where({{"sequence", sequence}, {"estimator", estimator}}, "column(\"drawn_at\")"),
                    estimator_colour(estimator)));
  }
  return panel;
}

}  // namespace

Table classification_test_table(const std::vector<Record>& records) {
  Table table{
      "Dynamic or static: the tests",
      "Detections within the gates, all seeds together. Area: under the receiver operating characteristic of the "
      "number that the test decides by. Missed in sight: dynamic ones called static although their true speed is "
      "above what their covariance lets the test find in half of the cases."};
  table.columns = folded_columns({"dataset"});
  table.add_columns({{"sequence", "sequence", Align::left},
                     {"level", "delta_d [px]", Align::right, 2},
                     {"estimator", "estimator", Align::left},
                     {"n_static", "static", Align::right, 0},
                     {"n_false", "called dynamic", Align::right, 0},
                     {"false_percent", "of static [%]", Align::right, 2},
                     {"n_dynamic", "dynamic", Align::right, 0},
                     {"n_missed", "missed", Align::right, 0},
                     {"n_missed_in_sight", "missed in sight", Align::right, 0},
                     {"area", "area", Align::right, 4}});
  for (const auto& [key, decisions] : decisions_of(records)) {
    const auto& [dataset, sequence, level, estimator] = key;
    double n_static = 0, n_false = 0, n_dynamic = 0, n_missed = 0, in_sight = 0;
    bool has_limit = false;
    for (const Decision& decision : decisions) {
      has_limit = has_limit || decision.has_limit;
      if (decision.scored.is_dynamic) {
        ++n_dynamic;
        n_missed += decision.found_dynamic ? 0 : 1;
        in_sight += !decision.found_dynamic && decision.should_be_found ? 1 : 0;
      } else {
        ++n_static;
        n_false += decision.found_dynamic ? 1 : 0;
      }
    }
    const auto curve = curve_of(decisions);
    table.add_row({dataset, sequence, level, estimator, n_static, n_false,
                   n_static > 0 ? Cell(100 * n_false / n_static) : Cell(), n_dynamic, n_missed,
                   has_limit ? Cell(in_sight) : Cell(), curve ? Cell(curve->area) : Cell()});
  }
  return table;
}

std::vector<Figure> classification_figures(const std::vector<Record>& records) {
  std::map<std::pair<std::string, double>, std::map<std::string, std::map<std::string, RocCurve>>> curves;
  for (const auto& [key, decisions] : decisions_of(records)) {
    const auto& [dataset, sequence, level, estimator] = key;
    if (const auto curve = curve_of(decisions)) curves[{dataset, level}][sequence].emplace(estimator, *curve);
  }
  std::vector<Figure> figures;
  for (const auto& [data, by_sequence] : curves) {
    Figure figure;
    figure.name = fmt::format("roc_{}_{}", file_stem(data.first), file_stem(fmt::format("{}", data.second)));
    figure.data.columns = {
        {"sequence", ""},           {"estimator", ""}, {"threshold", ""}, {"false_positive_rate", ""},
        {"true_positive_rate", ""}, {"drawn_at", ""},  {"area", ""}};
    std::vector<Panel> panels;
    std::vector<std::string> all;
    for (const auto& [sequence, by_estimator] : by_sequence) {
      std::vector<std::string> estimators;
      for (const auto& [estimator, curve] : by_estimator) {
        estimators.push_back(estimator);
        if (std::ranges::find(all, estimator) == all.end()) all.push_back(estimator);
        for (const RocPoint& point : curve.points) {
          figure.data.add_row({sequence, estimator,
                               std::isfinite(point.threshold) ? Cell(point.threshold) : Cell(),
                               point.false_positive_rate, point.true_positive_rate,
                               std::max(point.false_positive_rate, min_false_alarms), curve.area});
        }
      }
      panels.push_back(panel_of(sequence, in_order(estimators)));
    }
    std::vector<LegendEntry> legend;
    for (const std::string& estimator : in_order(all)) {
      legend.push_back({estimator_title(estimator),
                        fmt::format("with lines lc rgb \"{}\" lw 2", estimator_colour(estimator))});
    }
    const size_t columns = std::min<size_t>(3, panels.size());
    set_panels({.columns = columns, .width_cm = columns == 1 ? 8.8 : 18.0, .panel_height_cm = 4.8}, legend,
               panels, figure);
    figure.caption = fmt::format(
        "Dynamic or static, {}, delta_d {} px: share of the dynamic detections that are found against the share of the "
        "static ones called dynamic, over all thresholds.",
        data.first, data.second);
    figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
