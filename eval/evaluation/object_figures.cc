#include "sextant/eval/evaluation/object_report.h"

#include <algorithm>
#include <limits>
#include <set>

#include "sextant/eval/logs/object_association.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

constexpr const char* not_drawn = "NaN";  // gnuplot interrupts the line here
constexpr int black_line = 7;             // the colour of the camera, as in the other figures

/// Colours of the states, in the order of StepState.
constexpr std::array<const char*, 5> state_colours = {"#009E73", "#56B4E9", "#D55E00", "#E69F00", "#B9BDC4"};

/// Returns the records of the first run of each system, in order of first appearance.
std::vector<std::pair<std::string, RecordRefs>> first_runs(const std::vector<Record>& records) {
  std::vector<std::pair<std::string, RecordRefs>> systems;
  for (const Record& record : records) {
    auto system =
        std::ranges::find(systems, record.estimator.str(), &std::pair<std::string, RecordRefs>::first);
    if (system == systems.end()) system = systems.insert(systems.end(), {record.estimator.str(), {}});
    if (system->second.empty() || system->second.front()->seed == record.seed)
      system->second.push_back(&record);
  }
  return systems;
}

std::vector<const ObjectTracks*> first_runs(const std::vector<ObjectTracks>& tracks) {
  std::vector<const ObjectTracks*> first;
  for (const ObjectTracks& of_run : tracks) {
    if (std::ranges::none_of(first,
                             [&](const ObjectTracks* other) { return other->system == of_run.system; }))
      first.push_back(&of_run);
  }
  return first;
}

BodyTrack track_of(const std::string& body, const std::map<int, SE3>& estimate,
                   const std::map<int, SE3>& truth) {
  std::map<int, TrackPoint> points;
  for (const auto& [frame, pose] : estimate) points[frame].set_estimate(pose);
  for (const auto& [frame, pose] : truth) points[frame].set_truth(pose);
  BodyTrack track{body, {}};
  for (auto& [frame, point] : points) {
    point.frame = frame;
    track.points.push_back(point);
  }
  return track;
}

StepState state_of(const Record& record, int first, int last) {
  if (record.status == Status::ok) return StepState::estimated;
  if (record.status == Status::no_truth) return StepState::without_truth;
  if (record.status == Status::gated) return StepState::gated;
  return record.frame > first && record.frame < last ? StepState::gap : StepState::missed;
}

/// Lengths of the stretches of successive estimated frames of each object.
std::vector<int> tracklet_lengths(const RecordRefs& records) {
  std::map<int, std::set<int>> frames;
  for (const Record* record : records) {
    if (record->status == Status::ok || record->status == Status::no_truth)
      frames[body_order(record->body)].insert(record->frame);
  }
  std::vector<int> lengths;
  for (const auto& [object, of_object] : frames) {
    int last = std::numeric_limits<int>::min();
    for (const int frame : of_object) {
      if (lengths.empty() || frame != last + 1 || frame == *of_object.begin()) lengths.push_back(0);
      ++lengths.back();
      last = frame;
    }
  }
  return lengths;
}

/// Returns the title of a body of a log, with the log's own id for an object without a partner.
std::string title_of(const std::string& body) {
  return body == "ego" ? body_title(body) : "object " + object_text(body_order(body));
}

struct Position {
  std::string body;
  TrackPoint at;
};

Cell coordinate(const std::optional<Eigen::Vector3d>& p, int axis) {
  return p ? Cell((*p)[axis]) : Cell(not_drawn);
}

/// Numbers of the bodies, which have the same colours in all figures of a page: 0 for the camera, objects
/// from 1 in order of first appearance.
using BodyNumbers = std::map<std::string, int>;

BodyNumbers body_numbers(const std::vector<const ObjectTracks*>& tracks) {
  BodyNumbers numbers = {{"ego", 0}};
  for (const ObjectTracks* of_run : tracks) {
    for (const BodyTrack& track : of_run->bodies)
      numbers.try_emplace(track.body, static_cast<int>(numbers.size()));
  }
  return numbers;
}

Figure path_figure(const ObjectTracks& tracks, const BodyNumbers& numbers) {
  Figure figure;
  figure.name = "paths_" + file_stem(tracks.system);
  EqualAxes axes;
  for (const BodyTrack& track : tracks.bodies) {
    for (const TrackPoint& point : track.points) {
      for (const auto& p : {point.estimate_m, point.truth_m}) {
        if (p) axes.include({p->x(), p->z()});
      }
    }
  }
  const bool lying = axes.longer_than_wide();
  const std::string across = lying ? "z" : "x", up = lying ? "x" : "z";  // axes of the figure
  figure.caption = fmt::format("{}: paths of the camera and the objects from above ({}); dashed: true.",
                               tracks.system, lying ? "z to the right, x down" : "x to the right, z up");
  std::vector<Position> positions;
  std::vector<LegendEntry> legend;
  std::string labels;
  Panel panel;
  for (const BodyTrack& track : tracks.bodies) {
    const std::string colour = line_colour(static_cast<size_t>(numbers.at(track.body)));
    const std::string dashed = fmt::format("with lines lc rgb \"{}\" dt 2 lw 1", colour);
    const std::string solid = fmt::format("with lines lc rgb \"{}\" lw 1.8", colour);
    const std::string dots = fmt::format("with points lc rgb \"{}\" pt 7 ps 0.2", colour);
    for (const auto& [end, style] :
         {std::pair("_gt_m", dashed), std::pair("_m", solid), std::pair("_m", dots)}) {
      const std::string first = fmt::format("column(\"{}{}\")", across, end);
      panel.plots.push_back(fmt::format("data using {}:(column(\"{}{}\")) {}",
                                        only_where({{"body", track.body}}, first), up, end, style));
    }
    legend.push_back({title_of(track.body), solid});
    const auto last = std::ranges::find_if(track.points.rbegin(), track.points.rend(),
                                           [](const TrackPoint& p) { return p.estimate_m.has_value(); });
    // Colours repeat after seven bodies, so the end of each path has the object's number.
    if (numbers.size() > 7 && track.body != "ego" && last != track.points.rend())
      labels += fmt::format("set label \"{}\" at {},{} left offset 0.4,0.3 textcolor rgb \"{}\" front\n",
                            object_text(body_order(track.body)),
                            gp_number(lying ? last->estimate_m->z() : last->estimate_m->x()),
                            gp_number(lying ? last->estimate_m->x() : last->estimate_m->z()), colour);
    for (const TrackPoint& point : track.points) {
      if (!positions.empty() && positions.back().body == track.body &&
          positions.back().at.frame + 1 < point.frame)
        positions.push_back({track.body, {positions.back().at.frame + 1, {}, {}}});
      positions.push_back({track.body, point});
    }
  }
  if (positions.empty()) return figure;
  const bool has_truth =
      std::ranges::any_of(positions, [](const Position& p) { return p.at.truth_m.has_value(); });
  if (has_truth) legend.push_back({"true", "with lines lc rgb \"#404040\" dt 2 lw 1"});
  PanelLayout layout{.width_cm = 18, .left_cm = 1.7, .bottom_cm = 1.1, .top_cm = 0.3};
  layout.panel_height_cm =
      layout.bottom_cm + layout.top_cm + axes.height_cm(layout.plot_width_cm(), lying, 12);
  panel.settings = axes.settings(layout.plot_width_cm(), layout.plot_height_cm(), lying) + labels;
  Fields<Position> fields = {{Column::text("body"), &Position::body},
                             {Column::count("frame"), [](const Position& p) { return p.at.frame; }}};
  fields.add(Column::text("x_m"), [](const Position& p) { return coordinate(p.at.estimate_m, 0); });
  fields.add(Column::text("z_m"), [](const Position& p) { return coordinate(p.at.estimate_m, 2); });
  fields.add(Column::text("x_gt_m"), [](const Position& p) { return coordinate(p.at.truth_m, 0); });
  fields.add(Column::text("z_gt_m"), [](const Position& p) { return coordinate(p.at.truth_m, 2); });
  figure.data = table_of("", "", fields, positions);
  set_panels(layout, legend, {panel}, figure);
  return figure;
}

Figure state_figure(const std::string& system, const RecordRefs& records) {
  Figure figure;
  figure.name = "states_" + file_stem(system);
  figure.caption = fmt::format(
      "{}: steps of each object. Gap: no estimate between two estimates of the object; missed: no estimate "
      "before the first or after the last one.",
      system);
  const std::vector<StateSpan> spans = state_spans(records);
  if (spans.empty()) return figure;
  struct Box {
    StateSpan span;
    size_t row;
  };
  std::map<int, size_t> rows;
  for (const StateSpan& span : spans) rows.try_emplace(span.object, rows.size());
  std::vector<Box> boxes;
  int first = spans.front().first, last = spans.front().last;
  for (const StateSpan& span : spans) {
    boxes.push_back({span, rows.at(span.object)});
    first = std::min(first, span.first);
    last = std::max(last, span.last);
  }
  std::string tics;
  Tics longest;
  for (const auto& [object, row] : rows) {
    const std::string label = object_text(object);
    tics += fmt::format("{}\"{}\" {}", tics.empty() ? "" : ", ", label, row);
    longest.n_characters = std::max(longest.n_characters, label.size());
  }
  Panel panel{
      "",
      fmt::format(
          "set xrange [{}:{}]\nset yrange [{}:-0.7]\nset ytics ({})\nset xlabel \"frame\" offset 0,0.4\n"
          "set ylabel \"object\"\n",
          first - 0.5, last + 0.5, static_cast<double>(rows.size()) - 0.3, tics),
      {}};
  std::vector<LegendEntry> legend;
  for (size_t i = 0; i < state_colours.size(); ++i) {
    const auto state = static_cast<StepState>(i);
    if (std::ranges::count(spans, state, &StateSpan::state) == 0) continue;
    const std::string fill = fmt::format("fc rgb \"{}\" fs solid 1 noborder", state_colours[i]);
    panel.plots.push_back(
        fmt::format("data using {}:(column(\"row\")):(column(\"first\")-0.5):(column(\"last\")+0.5):"
                    "(column(\"row\")-0.38):(column("
                    "\"row\")+0.38) with boxxyerror {}",
                    only_where({{"state", std::string(to_string(state))}}, "column(\"first\")"), fill));
    legend.push_back({std::string(to_string(state)), "with boxes " + fill});
  }
  figure.data =
      table_of<Box>("", "",
                    {{Column::count("row"), &Box::row},
                     {Column::text("object"), [](const Box& box) { return object_text(box.span.object); }},
                     {Column::count("first"), [](const Box& box) { return box.span.first; }},
                     {Column::count("last"), [](const Box& box) { return box.span.last; }},
                     {Column::text("state"), [](const Box& box) { return to_string(box.span.state); }}},
                    boxes);
  const double height_cm = 1.6 + 0.32 * static_cast<double>(rows.size());
  set_panels(
      {.width_cm = 18, .panel_height_cm = height_cm, .left_cm = 1.7 + longest.more_cm(4), .top_cm = 0.2},
      legend, {panel}, figure);
  return figure;
}

constexpr double unknown_number = std::numeric_limits<double>::quiet_NaN();

double number_or_nan(const Record* record, const NumberMap map, const std::string& key) {
  if (record == nullptr) return unknown_number;
  const auto number = find_number(map == NumberMap::errors ? record->errors : record->values, key);
  return number ? *number : unknown_number;
}

}  // namespace

ObjectTracks object_tracks(const ObjectLog& log, uint64_t run) {
  ObjectTracks tracks{log.estimator, run, {}};
  if (!log.camera.empty() || !log.true_camera.empty())
    tracks.bodies.push_back(track_of("ego", log.camera.poses(), log.true_camera.poses()));
  const std::map<ObjectFrame, SE3> estimates = log.poses.empty() ? chained_poses(log) : log.poses;
  std::map<int, std::pair<std::map<int, SE3>, std::map<int, SE3>>> objects;
  for (const auto& [key, pose] : estimates) objects[key.first].first.emplace(key.second, pose);
  for (const auto& [key, pose] : log.true_poses) objects[key.first].second.emplace(key.second, pose);
  for (const auto& [id, poses] : objects)
    tracks.bodies.push_back(track_of(object_body(id), poses.first, poses.second));
  return tracks;
}

std::vector<StateSpan> state_spans(const std::vector<const Record*>& records) {
  std::map<int, std::map<int, const Record*>> objects;
  for (const Record* record : records) {
    if (!record->is_ego()) objects[body_order(record->body)][record->frame] = record;
  }
  std::vector<StateSpan> spans;
  for (const auto& [object, steps] : objects) {
    int first = std::numeric_limits<int>::max(), last = std::numeric_limits<int>::min();
    for (const auto& [frame, record] : steps) {
      if (record->status != Status::ok && record->status != Status::no_truth) continue;
      first = std::min(first, frame);
      last = std::max(last, frame);
    }
    for (const auto& [frame, record] : steps) {
      const StepState state = state_of(*record, first, last);
      const bool continues = !spans.empty() && spans.back().object == object && spans.back().state == state &&
                             spans.back().last + 1 == frame;
      if (!continues) spans.push_back({object, frame, frame, state});
      spans.back().last = frame;
    }
  }
  return spans;
}

std::vector<Figure> object_path_figures(const std::vector<ObjectTracks>& tracks) {
  std::vector<Figure> figures;
  const std::vector<const ObjectTracks*> shown = first_runs(tracks);
  const BodyNumbers numbers = body_numbers(shown);
  for (const ObjectTracks* of_run : shown) {
    Figure figure = path_figure(*of_run, numbers);
    if (!figure.data.rows.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

std::vector<Figure> object_state_figures(const std::vector<Record>& records) {
  std::vector<Figure> figures;
  for (const auto& [system, of_run] : first_runs(records)) {
    Figure figure = state_figure(system, of_run);
    if (!figure.data.rows.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

Figure tracklet_figure(const std::vector<Record>& records) {
  Figure figure;
  figure.name = "tracklets";
  figure.caption =
      "Number of tracklets (successive estimated steps of one object) that have at least x steps.";
  const SystemStyles styles = styles_of(records);
  struct Step {
    size_t series;
    std::string system;
    int length;
    size_t n;
  };
  std::vector<Step> steps;
  std::vector<LegendEntry> legend;
  Panel panel{
      "",
      "set xlabel \"steps\" offset 0,0.4\nset ylabel \"tracklets\"\nset xrange [0:*]\nset yrange [0:*]\n",
      {}};
  for (const auto& [system, of_run] : first_runs(records)) {
    std::vector<int> lengths = tracklet_lengths(of_run);
    if (lengths.empty()) continue;
    std::ranges::sort(lengths);
    const size_t series = legend.size();
    steps.push_back({series, system, 0, lengths.size()});
    for (size_t i = 0; i < lengths.size(); ++i)
      steps.push_back({series, system, lengths[i], lengths.size() - i});
    steps.push_back({series, system, lengths.back(), 0});
    const std::string line =
        fmt::format("with fsteps lc rgb \"{}\" dt {} lw 1.5", styles.colour(system), styles.dash(system));
    panel.plots.push_back(fmt::format(
        "data using (column(\"series\") == {} ? column(\"steps\") : NaN):(column(\"n\")) {}", series, line));
    legend.push_back({system, line});
  }
  if (steps.empty()) return figure;
  figure.data = table_of<Step>("", "",
                               {{Column::count("series"), &Step::series},
                                {Column::text("system"), &Step::system},
                                {Column::count("steps"), &Step::length},
                                {Column::count("n"), &Step::n}},
                               steps);
  set_panels({.width_cm = 11, .panel_height_cm = 5}, legend, {panel}, figure);
  return figure;
}

Explorer object_explorer(const std::vector<ObjectTracks>& tracks, const std::vector<Record>& records,
                         const std::string& Et_key, const std::string& ER_key) {
  Explorer explorer{
      .name = "walk", .time_title = "frame", .curves = {"E_t [m]", "E_R [deg]", "speed [km/h]"}};
  const std::vector<const ObjectTracks*> shown = first_runs(tracks);
  const BodyNumbers numbers = body_numbers(shown);
  for (size_t system = 0; system < shown.size(); ++system) {
    const ObjectTracks* of_run = shown[system];
    std::map<std::pair<std::string, int>, const Record*> by_step;
    for (const Record& record : records) {
      if (record.estimator == of_run->system && record.seed == of_run->run)
        by_step.emplace(std::pair(record.body.str(), record.frame), &record);
    }
    for (const BodyTrack& track : of_run->bodies) {
      const int number = numbers.at(track.body);
      const std::string label =
          shown.size() > 1 ? of_run->system + ", " + title_of(track.body) : title_of(track.body);
      for (const bool is_true : {true, false}) {
        ExploredPath path{.label = label,
                          .is_reference = is_true,
                          .colour = number == 0 ? black_line : number,
                          .dash = static_cast<int>(system),
                          .time = {},
                          .frame = {},
                          .position_m = {},
                          .begins = {},
                          .values = {}};
        std::vector<double> Et, ER, speed;
        for (const TrackPoint& point : track.points) {
          const auto& position = is_true ? point.truth_m : point.estimate_m;
          if (!position) continue;
          const auto step = by_step.find({track.body, point.frame});
          const Record* record = step == by_step.end() ? nullptr : step->second;
          path.begins.push_back(path.time.empty() || path.time.back() + 1 < point.frame);
          path.time.push_back(point.frame);
          path.position_m.push_back(*position);
          Et.push_back(number_or_nan(record, NumberMap::errors, Et_key));
          ER.push_back(number_or_nan(record, NumberMap::errors, ER_key));
          speed.push_back(number_or_nan(record, NumberMap::values, is_true ? "v_gt_kmh" : "v_kmh"));
        }
        if (path.time.empty()) continue;
        const bool has_errors = !is_true && track.body != "ego", has_speed = track.body != "ego";
        path.values = {has_errors ? Et : std::vector<double>(), has_errors ? ER : std::vector<double>(),
                       has_speed ? speed : std::vector<double>()};
        explorer.paths.push_back(std::move(path));
      }
    }
  }
  return explorer;
}

}  // namespace sextant
