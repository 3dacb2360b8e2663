#include "sextant/eval/report/figures/record_figures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

constexpr double min_false_alarms = 1e-4;  // lower end of the logarithmic axis
constexpr const char* likelihood_score = "motion_sigmas";

/// Decision about one detection, with the decision variable. The same detections as in count_classification()
/// are used.
struct Decision {
  ScoredDetection scored;
  bool found_dynamic = false;
  bool should_be_found = false;  ///< faster than the speed that its covariance allows to detect
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

Panel panel_of(const std::string& sequence, const std::vector<std::string>& estimators,
               const SystemStyles& systems) {
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
                    systems.colour(estimator)));
  }
  return panel;
}

}  // namespace

Table classification_test_table(const std::vector<Record>& records) {
  struct Test {
    std::string dataset, sequence, estimator;
    double level = 0;
    int n_static = 0, n_false = 0, n_dynamic = 0, n_missed = 0, n_missed_in_sight = 0;
    bool has_limit = false;
    std::optional<double> area{};
  };
  std::vector<Test> tests;
  for (const auto& [key, decisions] : decisions_of(records)) {
    const auto& [dataset, sequence, level, estimator] = key;
    Test test{dataset, sequence, estimator, level};
    for (const Decision& decision : decisions) {
      test.has_limit = test.has_limit || decision.has_limit;
      if (decision.scored.is_dynamic) {
        ++test.n_dynamic;
        test.n_missed += decision.found_dynamic ? 0 : 1;
        test.n_missed_in_sight += !decision.found_dynamic && decision.should_be_found ? 1 : 0;
      } else {
        ++test.n_static;
        test.n_false += decision.found_dynamic ? 1 : 0;
      }
    }
    if (const auto curve = curve_of(decisions)) test.area = curve->area;
    tests.push_back(std::move(test));
  }
  const Fields<Test> fields = {
      {Column::text("dataset").folded(), &Test::dataset},
      {Column::text("sequence"), &Test::sequence},
      {Column::number("level", "delta_d [px]", 2), &Test::level},
      {Column::text("estimator"), &Test::estimator},
      {Column::count("n_static", "static"), &Test::n_static},
      {Column::count("n_false", "called dynamic"), &Test::n_false},
      {Column::number("false_percent", "of static [%]", 2),
       [](const Test& t) { return t.n_static > 0 ? Cell(100.0 * t.n_false / t.n_static) : Cell(); }},
      {Column::count("n_dynamic", "dynamic"), &Test::n_dynamic},
      {Column::count("n_missed", "missed"), &Test::n_missed},
      {Column::count("n_missed_in_sight", "missed in sight"),
       [](const Test& t) { return t.has_limit ? Cell(t.n_missed_in_sight) : Cell(); }},
      {Column::number("area", 4), &Test::area}};
  return table_of(
      "Dynamic or static: the tests",
      "Detections within the gates, all seeds together. Area: under the receiver operating characteristic of "
      "the number that the test decides by. Missed in sight: dynamic ones called static although their true "
      "speed is above what their covariance lets the test find in half of the cases.",
      fields, tests);
}

std::vector<Figure> classification_figures(const std::vector<Record>& records) {
  std::map<std::pair<std::string, double>, std::map<std::string, std::map<std::string, RocCurve>>> curves;
  for (const auto& [key, decisions] : decisions_of(records)) {
    const auto& [dataset, sequence, level, estimator] = key;
    if (const auto curve = curve_of(decisions)) curves[{dataset, level}][sequence].emplace(estimator, *curve);
  }
  const SystemStyles systems = styles_of(records);
  std::vector<Figure> figures;
  for (const auto& [data, by_sequence] : curves) {
    Figure figure;
    figure.name = fmt::format("roc_{}_{}", file_stem(data.first), file_stem(fmt::format("{}", data.second)));
    figure.data = figure_data({"sequence", "estimator", "threshold", "false_positive_rate",
                               "true_positive_rate", "drawn_at", "area"});
    std::vector<Panel> panels;
    std::vector<std::string> all;
    for (const auto& [sequence, by_estimator] : by_sequence) {
      std::vector<std::string> estimators;
      for (const auto& [estimator, curve] : by_estimator) {
        estimators.push_back(estimator);
        add_distinct(estimator, all);
        for (const auto& [threshold, false_rate, true_rate] : curve.points) {
          figure.data.add_row({sequence, estimator, std::isfinite(threshold) ? Cell(threshold) : Cell(),
                               false_rate, true_rate, std::max(false_rate, min_false_alarms), curve.area});
        }
      }
      panels.push_back(panel_of(sequence, in_order(estimators), systems));
    }
    std::vector<LegendEntry> legend;
    for (const std::string& estimator : in_order(all)) {
      legend.push_back({estimator_title(estimator),
                        fmt::format("with lines lc rgb \"{}\" lw 2", systems.colour(estimator))});
    }
    const size_t columns = std::min<size_t>(3, panels.size());
    set_panels({.columns = columns, .width_cm = columns == 1 ? 8.8 : 18.0, .panel_height_cm = 4.8}, legend,
               panels, figure);
    figure.caption = fmt::format(
        "Dynamic or static, {}, delta_d {} px: share of the dynamic detections that are found against the "
        "share of the static ones called dynamic, over all thresholds.",
        data.first, data.second);
    figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
