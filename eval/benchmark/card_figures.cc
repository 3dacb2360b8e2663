#include "sextant/eval/benchmark/card_figures.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sextant/eval/report/figures/panels.h"

namespace sextant {
namespace {

constexpr const char* grey = "#B8B8B8";

/// One point of a figure; E_t in mm.
struct PlotPoint {
  std::string body, series;
  double level = 0, error_mm = 0;
  std::optional<Interval> interval{};
};

struct Series {
  std::string name;
  bool is_reference = false;
};

/// The points of a track by series; the references come first, so that they are drawn behind.
struct TrackPoints {
  std::vector<Series> series;
  std::vector<PlotPoint> points;

  void add(const Card& card, const std::string& track, bool is_reference) {
    for (const CurvePoint& p : card.curves) {
      if (p.track != track || !p.Et_m || p.Et_m->value <= 0) continue;
      const auto same = [&](const Series& s) {
        return s.name == p.estimator && s.is_reference == is_reference;
      };
      if (std::ranges::none_of(series, same)) series.push_back({p.estimator, is_reference});
      PlotPoint& point =
          points.emplace_back(PlotPoint{p.body, key(series.back()), p.level, 1e3 * p.Et_m->value});
      if (p.Et_m->interval) point.interval = {1e3 * p.Et_m->interval->low, 1e3 * p.Et_m->interval->high};
    }
  }
  static std::string key(const Series& s) { return (s.is_reference ? "reference " : "") + gp_cell(s.name); }
};

/// Names of the series that are no references.
std::vector<std::string> shown_names(const TrackPoints& of) {
  std::vector<std::string> names;
  for (const Series& series : of.series)
    if (!series.is_reference) names.push_back(series.name);
  return names;
}

Panel panel_of(const SuiteTrack& track, const std::string& body, const TrackPoints& of) {
  Panel panel{body == "camera" ? "camera" : "objects", "", {}};
  panel.settings = fmt::format(
      "set logscale y\nset format y \"%g\"\nset ylabel \"mean E_t [mm]\" noenhanced\n"
      "set xlabel {} noenhanced offset 0,0.4\n"
      "set arrow from first {},graph 0 to first {},graph 1 nohead lc rgb \"#404040\" dt 3 lw 0.7\n",
      gp_text(track.level_title), gp_number(track.nominal), gp_number(track.nominal));
  const std::vector<std::string> names = shown_names(of);
  for (const Series& series : of.series) {
    const std::string x =
        only_where({{"body", body}, {"series", TrackPoints::key(series)}}, "column(\"level\")");
    const std::string style = series.is_reference
                                  ? fmt::format("with lines lc rgb \"{}\" lw 1.2", grey)
                                  : estimator_style(series.name, distinct_colour(series.name, names));
    if (!series.is_reference)
      panel.plots.push_back(interval_plot(x, "low", "high", distinct_colour(series.name, names), 1));
    panel.plots.push_back(fmt::format("data using {}:(column(\"error_mm\")) {}", x, style));
  }
  return panel;
}

Figure figure_of(const SuiteTrack& track, const TrackPoints& of) {
  Figure figure{.name = "track_" + track.name};
  Fields<PlotPoint> fields = {{Column::text("body"), &PlotPoint::body},
                              {Column::text("series"), &PlotPoint::series},
                              {Column::text("level"), &PlotPoint::level},
                              {Column::text("error_mm"), &PlotPoint::error_mm}};
  fields.add_range({Column::text("low"), Column::text("high")}, &PlotPoint::interval);
  figure.data = table_of("", "", fields, of.points);
  std::vector<Panel> panels;
  for (const std::string_view body : names_of(BodyKind{})) {
    const auto has_body = [&](const PlotPoint& point) { return point.body == body; };
    if (std::ranges::any_of(of.points, has_body)) panels.push_back(panel_of(track, std::string(body), of));
  }
  std::vector<LegendEntry> legend;
  bool has_references = false;
  for (const Series& series : of.series) {
    has_references |= series.is_reference;
    if (!series.is_reference)
      legend.push_back({estimator_title(series.name),
                        estimator_style(series.name, distinct_colour(series.name, shown_names(of)))});
  }
  if (has_references) legend.push_back({"references", fmt::format("with lines lc rgb \"{}\" lw 1.2", grey)});
  set_panels({.columns = panels.size(), .width_cm = 9.0 * static_cast<double>(panels.size())}, legend, panels,
             figure);
  figure.caption = fmt::format(
      "{}: mean E_t with 95 % intervals; the dotted line is the nominal level. A point is missing where "
      "nothing was estimated.",
      track.title);
  return figure;
}

}  // namespace

std::vector<Figure> curve_figures(const Suite& suite, const std::vector<const Card*>& cards,
                                  const std::vector<const Card*>& references) {
  std::set<std::string> shown;
  for (const Card* card : cards) shown.insert(card->results.begin(), card->results.end());
  std::vector<Figure> figures;
  for (const SuiteTrack& track : suite.tracks) {
    TrackPoints of;
    for (const Card* card : references) {
      const bool is_shown =
          std::ranges::any_of(card->results, [&](const auto& r) { return shown.contains(r); });
      if (!is_shown) of.add(*card, track.name, /*is_reference=*/true);
    }
    for (const Card* card : cards) of.add(*card, track.name, /*is_reference=*/false);
    std::set<double> levels;
    for (const PlotPoint& point : of.points) levels.insert(point.level);
    if (levels.size() > 1) figures.push_back(figure_of(track, of));
  }
  return figures;
}

Figure profile_figure(const std::vector<ProfileRow>& rows) {
  constexpr double largest = 16;
  struct Step {
    std::string estimator;
    double tau, share;
  };
  std::vector<Step> steps;
  for (const ProfileRow& row : rows) {
    steps.push_back({gp_cell(row.estimator), 1, row.share_within(1)});
    for (const double ratio : row.ratios) {
      if (ratio > 1 && ratio <= largest)
        steps.push_back({gp_cell(row.estimator), ratio, row.share_within(ratio)});
    }
    steps.push_back({gp_cell(row.estimator), largest, row.share_within(largest)});
  }
  Figure figure{.name = "performance_profile"};
  figure.data = table_of("", "",
                         Fields<Step>{{Column::text("estimator"), &Step::estimator},
                                      {Column::text("tau"), &Step::tau},
                                      {Column::text("share"), &Step::share}},
                         steps);
  Panel panel{"",
              "set logscale x 2\nset xrange [1:16]\nset yrange [0:1.02]\nset ylabel \"share of cases\"\n"
              "set xlabel \"tau: mean E_t over that of the best estimator\" noenhanced\n",
              {}};
  std::vector<LegendEntry> legend;
  std::vector<std::string> names;
  for (const ProfileRow& row : rows) names.push_back(row.estimator);
  for (const ProfileRow& row : rows) {
    const std::string style =
        fmt::format("with steps lc rgb \"{}\" lw 2", distinct_colour(row.estimator, names));
    panel.plots.push_back(fmt::format("data using {}:(column(\"share\")) {}",
                                      only_where({{"estimator", gp_cell(row.estimator)}}, "column(\"tau\")"),
                                      style));
    legend.push_back({estimator_title(row.estimator), style});
  }
  set_panels({.columns = 1, .width_cm = 16, .panel_height_cm = 7}, legend, {panel}, figure);
  figure.caption =
      "Performance profile: the share of cases (track, kind of body, level) in which the error of an "
      "estimator is at most tau times that of the best one.";
  return figure;
}

}  // namespace sextant
