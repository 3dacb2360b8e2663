#include "sextant/eval/report/figures/record_figures.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

/// x and z of a point: to the right and ahead of the first camera.
Eigen::Vector2d ground(const Eigen::Vector3d& p) { return {p.x(), p.z()}; }

// ---- fig. 1

/// Returns the mean estimated speed of an object over the frames of its track.
std::optional<double> mean_speed_kmh(const RecordRefs& records, const BodyTrack& track) {
  double sum = 0;
  int n = 0;
  for (const Record* record : records) {
    const auto speed = find_number(record->values, "v_kmh");
    const bool is_drawn =
        record->frame >= track.points.front().frame && record->frame <= track.points.back().frame;
    if (record->body != track.body || record->status != Status::ok || !speed || !is_drawn) continue;
    sum += *speed;
    ++n;
  }
  return n > 0 ? std::optional(sum / n) : std::nullopt;
}

bool is_estimated(const BodyTrack& track) {
  return std::ranges::any_of(track.points, [](const TrackPoint& p) { return p.estimate_m.has_value(); });
}

/// Label above the last estimate of the track.
std::string speed_label(const BodyTrack& track, double speed_kmh, const std::string& colour, bool lying) {
  const auto last = std::ranges::find_if(track.points.rbegin(), track.points.rend(),
                                         [](const TrackPoint& p) { return p.estimate_m.has_value(); });
  const double x = last->estimate_m->x(), z = last->estimate_m->z();
  return fmt::format("set label \"{:.1f} km/h\" at {},{} right offset 0,0.8 textcolor rgb \"{}\"\n",
                     speed_kmh, gp_number(lying ? z : x), gp_number(lying ? x : z), colour);
}

EqualAxes axes_of(const std::vector<BodyTrack>& tracks) {
  EqualAxes axes;
  for (const BodyTrack& track : tracks) {
    for (const TrackPoint& p : track.points) {
      if (is_estimated(track) && p.estimate_m) axes.include(ground(*p.estimate_m));
      if (is_estimated(track) && p.truth_m) axes.include(ground(*p.truth_m));
    }
  }
  return axes;
}

// ---- fig. 6

/// A system with its colour, by order of first appearance in all views; the truth is grey.
struct System {
  std::string name;
  std::string colour;
};

std::vector<System> systems_of(const std::vector<TopView>& views) {
  std::vector<System> systems;
  for (const TopView& view : views) {
    for (const CameraPath& path : view.paths) {
      if (path.system == truth_path ||
          std::ranges::find(systems, path.system, &System::name) != systems.end())
        continue;
      systems.push_back({path.system, line_colour(systems.size() + 1)});
    }
  }
  systems.insert(systems.begin(), {truth_path, "#B0B0B0"});
  return systems;
}

/// The truth is a broad line below the others.
std::string system_style(const System& system) {
  return fmt::format("with lines lc rgb \"{}\" lw {}", system.colour, system.name == truth_path ? 4.5 : 1.5);
}

}  // namespace

RecordRefs records_of_tracks(const std::vector<Record>& records, const std::string& dataset,
                             const std::string& sequence) {
  RecordRefs of_source;
  for (const Record& record : records) {
    if (record.dataset == dataset && record.sequence == sequence) of_source.push_back(&record);
  }
  if (of_source.empty()) return {};
  const Record& first = **std::ranges::min_element(of_source, {}, [](const Record* r) { return r->seed; });
  return records_where(
      of_source, [&](const Record& r) { return r.seed == first.seed && r.estimator == first.estimator; });
}

std::vector<Figure> showcase_figures(const std::string& title, const std::vector<BodyTrack>& tracks,
                                     const RecordRefs& records) {
  Figure figure;
  figure.name = "fig1_tracks";
  figure.data = figure_data({"body", "frame", "x_m", "z_m", "x_gt_m", "z_gt_m"});
  Panel panel;
  panel.title = title;
  std::vector<LegendEntry> legend;
  const EqualAxes axes = axes_of(tracks);
  const bool lying = axes.longer_than_wide();
  for (const BodyTrack& track : tracks) {
    if (!is_estimated(track)) continue;
    const bool is_camera = track.body == "ego";
    const std::string colour = line_colour(legend.size());
    const std::string style = fmt::format("with linespoints lc rgb \"{}\" lw 1.5 pt {} ps 0.35", colour,
                                          filled_point(legend.size()));
    for (const TrackPoint& p : track.points) {
      const auto x = [](const auto& at_m) { return at_m ? Cell(at_m->x()) : Cell(); };
      const auto z = [](const auto& at_m) { return at_m ? Cell(at_m->z()) : Cell(); };
      figure.data.add_row(
          {track.body, p.frame, x(p.estimate_m), z(p.estimate_m), x(p.truth_m), z(p.truth_m)});
    }
    const auto points = [&](const std::string& x, const std::string& z) {
      return fmt::format("data using {}:(column(\"{}\"))",
                         only_where({{"body", track.body}}, fmt::format("column(\"{}\")", lying ? z : x)),
                         lying ? x : z);
    };
    panel.plots.push_back(points("x_gt_m", "z_gt_m") + " with lines lc rgb \"#B0B0B0\" lw 4.5");
    panel.plots.push_back(points("x_m", "z_m") + " " + style);
    legend.push_back({body_title(track.body), style});
    const auto speed = mean_speed_kmh(records, track);
    if (!is_camera && speed) panel.settings += speed_label(track, *speed, colour, lying);
  }
  if (legend.empty()) return {};
  legend.push_back({"ground truth", "with lines lc rgb \"#B0B0B0\" lw 4.5"});
  PanelLayout layout;
  layout.panel_height_cm = layout.top_cm + layout.bottom_cm + axes.height_cm(layout.plot_width_cm(), lying);
  panel.settings += axes.settings(layout.plot_width_cm(), layout.plot_height_cm(), lying);
  set_panels(layout, legend, {panel}, figure);
  figure.caption = fmt::format(
      "Fig. 1, tracks of camera and objects from above, {}. Estimates begin at the truth; objects: the "
      "origin of the true box, moved by the estimated motions. Numbers: mean estimated speed.",
      title);
  return {figure};
}

std::vector<Figure> top_view_figures(const std::vector<TopView>& views) {
  if (views.empty()) return {};
  Figure figure;
  figure.name = "fig6_top_views";
  figure.data = figure_data({"sequence", "system", "x_m", "z_m"});
  PanelLayout layout;
  layout.columns = std::min<size_t>(3, views.size());
  layout.width_cm = layout.columns == 1 ? 8.8 : 18.0;
  layout.panel_height_cm = 5.6;
  layout.bottom_cm = 1.15;
  const std::vector<System> systems = systems_of(views);
  std::vector<LegendEntry> legend;
  for (const System& system : systems) legend.push_back({system.name, system_style(system)});
  std::vector<Panel> panels;
  for (const TopView& view : views) {
    Panel panel{view.title, "", {}};
    EqualAxes axes;
    for (const System& system : systems) {
      const auto path = std::ranges::find(view.paths, system.name, &CameraPath::system);
      if (path == view.paths.end() || path->positions_m.empty()) continue;
      for (const Eigen::Vector3d& p : path->positions_m) {
        figure.data.add_row({view.title, system.name, p.x(), p.z()});
        axes.include(ground(p));
      }
      panel.plots.push_back(
          fmt::format("data using {}:(column(\"z_m\")) {}",
                      only_where({{"sequence", view.title}, {"system", system.name}}, "column(\"x_m\")"),
                      system_style(system)));
    }
    if (panel.plots.empty()) continue;
    panel.settings += axes.settings(layout.plot_width_cm(), layout.plot_height_cm(), false);
    panels.push_back(std::move(panel));
  }
  if (panels.empty()) return {};
  set_panels(layout, legend, panels, figure);
  figure.caption = "Fig. 6, camera paths from above, in the coordinates of the first camera; no alignment.";
  return {figure};
}

}  // namespace sextant
