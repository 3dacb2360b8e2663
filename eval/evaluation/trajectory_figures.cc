#include "sextant/eval/evaluation/trajectory_series.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "sextant/base/new_file.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/stats/summary.h"

namespace sextant {

namespace {

constexpr const char* interrupted = "NaN";  // gnuplot interrupts the line here
constexpr const char* reference_colour = "#B0B0B0";
constexpr size_t n_line_colours = 7;

Cell number_cell(double value) { return std::isfinite(value) ? Cell(value) : Cell(interrupted); }

/// Returns curve k of a figure: 0 is the reference, k + 1 is run k.
const TrajectoryCurve& curve_of(const EgoCurves& curves, size_t k) {
  return k == 0 ? curves.reference : curves.runs[k - 1];
}

std::string style_of(size_t k) {
  if (k == 0) return fmt::format("with lines lc rgb \"{}\" lw 3.5", reference_colour);
  return fmt::format("with lines lc rgb \"{}\" dt {} lw 1.3", line_colour(k), (k - 1) / n_line_colours + 1);
}

std::vector<LegendEntry> legend_of(const EgoCurves& curves, bool with_reference) {
  std::vector<LegendEntry> legend;
  for (size_t k = with_reference ? 0 : 1; k <= curves.runs.size(); ++k)
    legend.push_back({curve_of(curves, k).name, style_of(k)});
  return legend;
}

constexpr int n_error_colours = 24;
/// Colours from small to large errors, distinct in greyscale as well.
constexpr const char* error_palette =
    "set palette defined (0 \"#30123b\", 1 \"#4686fb\", 2 \"#1ae4b6\", 3 \"#a4fc3c\", 4 \"#fbb938\", "
    "5 \"#e3440a\", 6 \"#7a0403\")\n";

using CurveColumns = Fields<std::pair<const TrajectoryCurve*, size_t>>;

/// Adds a column with one value per pose; it is "NaN" for a curve whose `list` is empty.
template <typename List, typename Number>
void add_column(const std::string& key, List TrajectoryCurve::*list, const Number& number,
                CurveColumns& columns) {
  columns.add(Column::text(key), [list, number](const auto& pose) {
    const List& values = pose.first->*list;
    return values.empty() ? Cell(interrupted) : number_cell(number(values[pose.second]));
  });
}

void add_number(const std::string& key, std::vector<double> TrajectoryCurve::*list, CurveColumns& columns) {
  add_column(
      key, list, [](double value) { return value; }, columns);
}

void add_vector(const std::array<std::string, 3>& keys, std::vector<Eigen::Vector3d> TrajectoryCurve::*list,
                CurveColumns& columns) {
  for (int k = 0; k < 3; ++k)
    add_column(
        keys[static_cast<size_t>(k)], list, [k](const Eigen::Vector3d& v) { return v[k]; }, columns);
}

/// Selects the poses of a curve to draw.
using Selection = std::function<std::vector<size_t>(const TrajectoryCurve&)>;

/// Fills the data of a figure: a row for each drawn pose of each curve, and a row without numbers before each
/// gap; the column "curve" holds the number of the curve. The caption says how many poses are drawn if not
/// all are, followed by `which`, which says what the drawn ones are.
void set_data(const EgoCurves& curves, const CurveColumns& columns, const Selection& selected,
              const std::string& which, Figure& figure) {
  figure.data.columns = {Column::count("curve"), Column::text("name")};
  for (const auto& field : columns) figure.data.columns.push_back(field.column);
  size_t n_drawn = 0, n_poses = 0;
  for (size_t k = 0; k <= curves.runs.size(); ++k) {
    const TrajectoryCurve& curve = curve_of(curves, k);
    const std::vector<size_t> kept = selected(curve);
    n_drawn += kept.size();
    n_poses += curve.size();
    for (const size_t i : kept) {
      if (curve.begins[i] && i > 0) {
        std::vector<Cell> gap = {k, curve.name};
        gap.resize(figure.data.columns.size(), interrupted);
        figure.data.add_row(std::move(gap));
      }
      std::vector<Cell> row = {k, curve.name};
      for (const auto& field : columns) row.push_back(field.of({&curve, i}));
      figure.data.add_row(std::move(row));
    }
  }
  if (n_drawn < n_poses)
    figure.caption += fmt::format(" Drawn are {} of {} poses{}. The files in curves/ contain all poses.",
                                  n_drawn, n_poses, which);
}

/// Number of poses of each curve that are drawn without a selection.
size_t most_drawn(const EgoCurves& curves) {
  return std::min(drawn_poses, std::max<size_t>(60, 4 * drawn_poses / (curves.runs.size() + 1)));
}

/// Fills the data of a figure of quantities along the path.
void set_data_along(const EgoCurves& curves, const CurveColumns& columns, Figure& figure) {
  const auto selected = [&](const TrajectoryCurve& curve) { return thinned(curve, most_drawn(curves)); };
  set_data(curves, columns, selected, ", among them those with the largest errors", figure);
}

/// Fills the data of a figure of paths with a scale of `m_per_cm`. The omitted poses are closer to the lines
/// than 0.1 mm in print, a quarter of a line's width. If errors up to `colour_end` give the colours, they are
/// also less than one colour away.
void set_path_data(const EgoCurves& curves, const CurveColumns& columns, double m_per_cm,
                   const std::optional<double>& colour_end, Figure& figure) {
  const double tolerance_m = 0.01 * m_per_cm;
  const auto selected = [&](const TrajectoryCurve& curve) {
    if (curve.size() <= most_drawn(curves)) return thinned(curve, curve.size());
    std::vector<Eigen::Vector3d> points;
    for (size_t i = 0; i < curve.size(); ++i) {
      const Eigen::Vector3d& p = curve.position_m[i];
      double colour = 0;
      if (colour_end && !curve.error.empty())
        colour = std::isfinite(curve.error[i]) ? std::min(curve.error[i] / *colour_end, 1.0) : -1;
      points.emplace_back(p[curves.axes.right], p[curves.axes.up], n_error_colours * colour * tolerance_m);
    }
    return simplified(points, curve.begins, tolerance_m);
  };
  set_data(curves, columns, selected,
           fmt::format("; the others are at most {:.2g} m away from the lines", tolerance_m), figure);
}

std::string column_of(size_t k, const std::string& key) {
  return fmt::format("(column(\"curve\") == {} ? column(\"{}\") : NaN)", k, key);
}

/// Returns true if a pose lies between two gaps: a line does not show it, so the curve needs points as well.
bool has_single_pose(const TrajectoryCurve& curve) {
  for (size_t i = 0; i < curve.size(); ++i) {
    if (curve.begins[i] && (i + 1 == curve.size() || curve.begins[i + 1])) return true;
  }
  return false;
}

std::string line_plot(const EgoCurves& curves, size_t k, const std::string& x, const std::string& y) {
  std::string plot = fmt::format("data using {}:(column(\"{}\")) {}", column_of(k, x), y, style_of(k));
  if (has_single_pose(curve_of(curves, k)))
    plot.replace(plot.find("with lines"), 10, "with linespoints pt 7 ps 0.4");
  return plot;
}

/// Returns the marks at start and end of the reference; a single one if both would overlap.
std::string end_marks(const TrajectoryCurve& reference, const ViewAxes& axes, double m_per_cm) {
  std::string marks;
  const Eigen::Vector3d &start = reference.position_m.front(), &end = reference.position_m.back();
  const bool apart =
      std::hypot(end[axes.right] - start[axes.right], end[axes.up] - start[axes.up]) > 0.5 * m_per_cm;
  std::vector<std::tuple<Eigen::Vector3d, const char*, int>> ends = {
      {start, apart ? "start" : "start, end", 7}};
  if (apart) ends.emplace_back(end, "end", 5);
  const auto right_of = [&](const Eigen::Vector3d& p) { return p[axes.right]; };
  const auto ends_right = std::ranges::minmax_element(reference.position_m, {}, right_of);
  const double low = right_of(*ends_right.min), high = right_of(*ends_right.max);
  for (const auto& [p, name, type] : ends) {
    // The text of a point in the right third is to its left, because it would be cut at the border.
    const bool is_right = p[axes.right] > low + (high - low) * 2 / 3;
    marks += fmt::format(
        "set label \"{}\" at {},{} {} point pt {} ps 0.9 lc rgb \"#404040\" offset {},0.5 front\n", name,
        gp_number(p[axes.right]), gp_number(p[axes.up]), is_right ? "right" : "left", type,
        is_right ? "-0.7" : "0.7");
  }
  return marks;
}

EqualAxes equal_axes(const EgoCurves& curves) {
  const auto title = [](int axis) { return fmt::format("{} [m]", axis_names[static_cast<size_t>(axis)]); };
  EqualAxes axes({title(curves.axes.right), title(curves.axes.up)}, 0.01);
  for (size_t k = 0; k <= curves.runs.size(); ++k) {
    for (const Eigen::Vector3d& p : curve_of(curves, k).position_m)
      axes.include({p[curves.axes.right], p[curves.axes.up]});
  }
  return axes;
}

CurveColumns path_columns(const ViewAxes& axes) {
  CurveColumns columns;
  const std::vector<Eigen::Vector3d> TrajectoryCurve::*position = &TrajectoryCurve::position_m;
  add_column(
      "right_m", position, [axis = axes.right](const Eigen::Vector3d& p) { return p[axis]; }, columns);
  add_column(
      "up_m", position, [axis = axes.up](const Eigen::Vector3d& p) { return p[axis]; }, columns);
  return columns;
}

std::string plane_text(const ViewAxes& axes) {
  const auto name = [](int axis) { return axis_names[static_cast<size_t>(axis)]; };
  return fmt::format("{} to the right, {} up", name(axes.right), name(axes.up));
}

Figure path_figure(const EgoCurves& curves, const EqualAxes& axes) {
  Figure figure;
  figure.name = "path";
  figure.caption = fmt::format("Paths from above ({}), after the alignment.", plane_text(curves.axes));
  PanelLayout layout{.width_cm = 14, .left_cm = 1.7, .bottom_cm = 1.1, .top_cm = 0.3};
  layout.panel_height_cm =
      layout.bottom_cm + layout.top_cm + axes.height_cm(layout.plot_width_cm(), false, 14);
  Panel panel{"",
              axes.settings(layout.plot_width_cm(), layout.plot_height_cm(), false) +
                  axes.scale_bar(layout.plot_width_cm(), layout.plot_height_cm()) +
                  end_marks(curves.reference, curves.axes,
                            axes.m_per_cm(layout.plot_width_cm(), layout.plot_height_cm())),
              {}};
  for (size_t k = 0; k <= curves.runs.size(); ++k)
    panel.plots.push_back(line_plot(curves, k, "right_m", "up_m"));
  set_path_data(curves, path_columns(curves.axes),
                axes.m_per_cm(layout.plot_width_cm(), layout.plot_height_cm()), std::nullopt, figure);
  set_panels(layout, legend_of(curves, true), {panel}, figure);
  return figure;
}

/// Upper end of the colour scale: the 99 % quantile of the errors; larger errors have the same colour.
double colour_end(const EgoCurves& curves) {
  std::vector<double> errors;
  for (const TrajectoryCurve& run : curves.runs)
    std::ranges::copy_if(run.error, std::back_inserter(errors), [](double e) { return std::isfinite(e); });
  const double end = errors.empty() ? 1 : quantile(errors, 0.99);
  return end > 0 ? end : 1;
}

Figure coloured_figure(const EgoCurves& curves, const EqualAxes& axes) {
  Figure figure;
  figure.name = "path_error";
  figure.caption = fmt::format(
      "Paths coloured by {}, one scale for all; errors above the 99 % quantile have its colour. "
      "Grey: reference.",
      curves.error_title);
  PanelLayout layout{.columns = std::min<size_t>(curves.runs.size(), 3),
                     .width_cm = 18,
                     .left_cm = 1.9,
                     .right_cm = 1.9,
                     .bottom_cm = 1.1,
                     .top_cm = 0.6};
  if (layout.columns == 1) layout.width_cm = 14;
  const double end = colour_end(curves);
  const Tics tics = tics_between(0, end, 8);
  const double wider_cm = tics.more_cm(5);
  layout.right_cm += wider_cm;
  const std::string colour_tics = wider_cm > 0 ? gp_number(tics.step) : "autofreq";
  const double room_cm = axes.height_cm(layout.plot_width_cm(), false, layout.columns == 1 ? 12 : 8);
  layout.panel_height_cm = layout.bottom_cm + layout.top_cm + room_cm;
  CurveColumns columns = path_columns(curves.axes);
  add_number("error", &TrajectoryCurve::error, columns);
  std::vector<Panel> panels;
  for (size_t k = 1; k <= curves.runs.size(); ++k) {
    Panel panel{shortened(curves.runs[k - 1].name, static_cast<size_t>(layout.plot_width_cm() / 0.17)),
                axes.settings(layout.plot_width_cm(), layout.plot_height_cm(), false) +
                    fmt::format("set palette maxcolors {}\n{}set cbrange [0:{}]\nset colorbox\n"
                                "set cbtics scale 0.5 {}\n",
                                n_error_colours, error_palette, gp_number(end), colour_tics),
                {}};
    panel.plots.push_back(fmt::format("data using {}:(column(\"up_m\")) with lines lc rgb \"{}\" lw 1",
                                      column_of(0, "right_m"), reference_colour));
    panel.plots.push_back(fmt::format(
        "data using {}:(column(\"up_m\")):(column(\"error\")) with {} lc palette lw 2.5",
        column_of(k, "right_m"), has_single_pose(curves.runs[k - 1]) ? "linespoints pt 7 ps 0.4" : "lines"));
    panels.push_back(std::move(panel));
  }
  set_path_data(curves, columns, axes.m_per_cm(layout.plot_width_cm(), layout.plot_height_cm()), end, figure);
  set_panels(
      layout,
      {{"reference", style_of(0)}, {"colour: " + curves.error_title, "with lines lc rgb \"#1AE4B6\" lw 3.5"}},
      panels, figure);
  return figure;
}

struct Along {
  std::string x, y;   ///< columns of the data
  std::string title;  ///< title of y
  bool with_reference = false;
};

/// Returns the tics of the numbers in a column, at most about n; nullopt if the numbers agree in the digits
/// that a tic shows.
std::optional<Tics> tics_of(const Table& data, const std::string& key, double n) {
  const size_t place = data.place(key);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const std::vector<Cell>& row : data.rows) {
    if (const double* number = row[place].number()) {
      low = std::min(low, *number);
      high = std::max(high, *number);
    }
  }
  const bool differ = high - low > 1e-5 * std::max(std::abs(low), std::abs(high));
  return differ ? std::optional(tics_between(low, high, n)) : std::nullopt;
}

/// Makes panels over time or path length, with an x range from the first to the last pose. The space to the
/// left of the panels fits the longest number at their tics.
void set_along(const EgoCurves& curves, const std::vector<Along>& what, size_t columns,
               double panel_height_cm, Figure& figure) {
  PanelLayout layout{.columns = columns,
                     .width_cm = 18,
                     .panel_height_cm = panel_height_cm,
                     .left_cm = 1.75,
                     .top_cm = 0.35};
  std::vector<std::optional<Tics>> tics;
  double wider_cm = 0;
  for (const Along& along : what) {
    tics.push_back(tics_of(figure.data, along.y, layout.plot_height_cm() / 0.5));
    if (tics.back()) wider_cm = std::max(wider_cm, tics.back()->more_cm(5));
  }
  layout.left_cm += wider_cm;
  std::vector<Panel> panels;
  bool with_reference = false;
  for (const Along& along : what) {
    const bool over_path = along.x == "path_m";
    const std::vector<double>& x = over_path ? curves.reference.path_m : curves.reference.time;
    const double end = x.back() > x.front() ? x.back() : x.front() + 1;
    Panel panel{
        "",
        fmt::format(
            "set xrange [{}:{}]\nset xtics {}\nset xlabel \"{}\" offset 0,0.4\nset ylabel {} noenhanced "
            "offset 0.6,0\n",
            gp_number(x.front()), gp_number(end),
            gp_number(tic_step(end - x.front(), layout.plot_width_cm() / 1.3)),
            over_path ? "path [m]" : curves.time_title(), gp_text(along.title)),
        {}};
    if (const auto& at = tics[panels.size()])
      panel.settings += fmt::format("set ytics {}\n", gp_number(at->step));
    for (size_t k = along.with_reference ? 0 : 1; k <= curves.runs.size(); ++k)
      panel.plots.push_back(line_plot(curves, k, along.x, along.y));
    panels.push_back(std::move(panel));
    with_reference |= along.with_reference;
  }
  set_panels(layout, legend_of(curves, with_reference), panels, figure);
}

CurveColumns along_columns() {
  CurveColumns columns;
  add_number("time", &TrajectoryCurve::time, columns);
  return columns;
}

Figure error_figure(const EgoCurves& curves) {
  Figure figure;
  figure.name = "error_along";
  figure.caption =
      fmt::format("{} over {}{}.", curves.error_title, curves.has_time ? "time" : "the frames",
                  curves.reference.path_m.back() > 0 ? " and over the length of the reference's path"
                                                     : "; the reference does not move");
  CurveColumns columns = along_columns();
  add_number("path_m", &TrajectoryCurve::path_m, columns);
  add_number("error", &TrajectoryCurve::error, columns);
  set_data_along(curves, columns, figure);
  std::vector<Along> panels = {{"time", "error", curves.error_title}};
  if (curves.reference.path_m.back() > 0) panels.push_back({"path_m", "error", curves.error_title});
  set_along(curves, panels, 1, 4.6, figure);
  return figure;
}

/// Figure with three quantities in the first row and their errors in the second.
Figure axes_figure(const EgoCurves& curves, const std::string& name, const std::string& caption,
                   const std::array<std::string, 3>& names, const std::string& unit,
                   std::vector<Eigen::Vector3d> TrajectoryCurve::*values,
                   std::vector<Eigen::Vector3d> TrajectoryCurve::*errors) {
  Figure figure;
  figure.name = name;
  figure.caption = caption;
  std::array<std::string, 3> keys, error_keys;
  std::vector<Along> upper, lower;
  for (size_t k = 0; k < 3; ++k) {
    keys[k] = fmt::format("{}_{}", names[k], unit);
    error_keys[k] = fmt::format("error_{}_{}", names[k], unit);
    upper.push_back({"time", keys[k], fmt::format("{} [{}]", names[k], unit), true});
    lower.push_back({"time", error_keys[k], fmt::format("error of {} [{}]", names[k], unit)});
  }
  CurveColumns columns = along_columns();
  add_vector(keys, values, columns);
  add_vector(error_keys, errors, columns);
  set_data_along(curves, columns, figure);
  upper.insert(upper.end(), lower.begin(), lower.end());
  set_along(curves, upper, 3, 4.4, figure);
  return figure;
}

/// Table of every pose of a curve, with a column for each quantity that the curve has.
Table curve_table(const TrajectoryCurve& curve, const EgoCurves& curves) {
  CurveColumns columns;
  add_number(curves.has_time ? "time_s" : "time_frames", &TrajectoryCurve::time, columns);
  add_column(
      "frame", &TrajectoryCurve::frame, [](int frame) { return static_cast<double>(frame); }, columns);
  add_number("path_m", &TrajectoryCurve::path_m, columns);
  add_vector({"x_m", "y_m", "z_m"}, &TrajectoryCurve::position_m, columns);
  add_vector({"roll_deg", "pitch_deg", "yaw_deg"}, &TrajectoryCurve::angles_deg, columns);
  add_number("speed", &TrajectoryCurve::speed, columns);
  if (!curve.error.empty()) {
    add_number("error", &TrajectoryCurve::error, columns);
    add_vector({"error_x_m", "error_y_m", "error_z_m"}, &TrajectoryCurve::position_error_m, columns);
    add_vector({"error_roll_deg", "error_pitch_deg", "error_yaw_deg"}, &TrajectoryCurve::angle_error_deg,
               columns);
  }
  std::vector<std::pair<const TrajectoryCurve*, size_t>> poses;
  for (size_t i = 0; i < curve.size(); ++i) poses.emplace_back(&curve, i);
  return table_of(curve.name, "", columns, poses);
}

template <typename Value>
std::vector<Value> of_kept(const std::vector<Value>& all, const std::vector<size_t>& kept) {
  std::vector<Value> list;
  for (const size_t i : kept) {
    if (!all.empty()) list.push_back(all[i]);
  }
  return list;
}

ExploredPath explored(const TrajectoryCurve& curve, int colour, size_t most) {
  const std::vector<size_t> kept = thinned(curve, most);
  std::array<std::vector<double>, 3> angles;
  for (const Eigen::Vector3d& of_pose : of_kept(curve.angles_deg, kept)) {
    for (int k = 0; k < 3; ++k) angles[static_cast<size_t>(k)].push_back(of_pose[k]);
  }
  return {
      .label = curve.name,
      .is_reference = colour == 0,
      .colour = colour,
      .time = of_kept(curve.time, kept),
      .frame = of_kept(curve.frame, kept),
      .position_m = of_kept(curve.position_m, kept),
      .begins = of_kept(curve.begins, kept),
      .values = {of_kept(curve.error, kept), angles[0], angles[1], angles[2], of_kept(curve.speed, kept)}};
}

}  // namespace

std::vector<Figure> path_figures(const EgoCurves& curves) {
  const EqualAxes axes = equal_axes(curves);
  return {path_figure(curves, axes), coloured_figure(curves, axes)};
}

std::vector<Figure> along_figures(const EgoCurves& curves) {
  std::vector<Figure> figures = {error_figure(curves)};
  figures.push_back(axes_figure(curves, "position",
                                "Position per axis, below the estimate minus the reference.", {"x", "y", "z"},
                                "m", &TrajectoryCurve::position_m, &TrajectoryCurve::position_error_m));
  if (std::ranges::any_of(curves.runs, [](const TrajectoryCurve& run) { return !run.angles_deg.empty(); })) {
    const auto name = [](int axis) { return axis_names[static_cast<size_t>(axis)]; };
    const int out = curves.axes.out;
    figures.push_back(axes_figure(
        curves, "rotation",
        fmt::format("Angles of the rotation R = R_{0}(yaw) R_{1}(pitch) R_{2}(roll) about the world's axes "
                    "{0}, {1}, {2}; below, their differences to the reference.",
                    name(out), name((out + 2) % 3), name((out + 1) % 3)),
        {"roll", "pitch", "yaw"}, "deg", &TrajectoryCurve::angles_deg, &TrajectoryCurve::angle_error_deg));
  }
  Figure speed;
  speed.name = "speed";
  speed.caption = "Distance between neighbouring poses divided by the time between them.";
  CurveColumns columns = along_columns();
  add_number("speed", &TrajectoryCurve::speed, columns);
  set_data_along(curves, columns, speed);
  set_along(curves, {{"time", "speed", curves.speed_title(), true}}, 1, 5, speed);
  figures.push_back(std::move(speed));
  return figures;
}

OutputFiles curve_files(const EgoCurves& curves) {
  std::vector<std::string> names = {"reference"};
  for (const TrajectoryCurve& run : curves.runs) names.push_back(file_stem(run.name));
  names = distinct_names(std::move(names));
  OutputFiles files;
  for (size_t k = 0; k < names.size(); ++k)
    files[fmt::format("curves/{}.csv", names[k])] = to_csv(curve_table(curve_of(curves, k), curves));
  return files;
}

Explorer ego_explorer(const EgoCurves& curves) {
  Explorer explorer{
      .name = "walk",
      .time_title = curves.time_title(),
      .axes = {curves.axes.right, curves.axes.up, curves.axes.out},
      .curves = {curves.error_title, "roll [deg]", "pitch [deg]", "yaw [deg]", curves.speed_title()}};
  size_t n_poses = curves.reference.size();
  for (const TrajectoryCurve& run : curves.runs) n_poses += run.size();
  const size_t most = n_poses <= explored_poses ? n_poses : explored_poses / (curves.runs.size() + 1);
  explorer.paths.push_back(explored(curves.reference, 0, most));
  for (const TrajectoryCurve& run : curves.runs)
    explorer.paths.push_back(explored(run, static_cast<int>(explorer.paths.size()), most));
  size_t n_shown = 0;
  for (const ExploredPath& path : explorer.paths) n_shown += path.time.size();
  if (n_shown < n_poses)
    explorer.note = fmt::format(
        "{} of {} poses are shown here, among them those with the largest errors; the files in curves/ "
        "contain all.",
        n_shown, n_poses);
  return explorer;
}

}  // namespace sextant
