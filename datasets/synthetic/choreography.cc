#include "sextant/datasets/synthetic/choreography.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

constexpr double camera_height_m = 1.65;

/// Moves along the chord of an arc.
Stance moved(Stance at, double ahead_m, double turn_rad) {
  const double half = turn_rad / 2;
  const double chord_m = std::abs(half) < 1e-9 ? ahead_m : ahead_m * std::sin(half) / half;
  at.x_m += chord_m * std::sin(at.heading_rad + half);
  at.z_m += chord_m * std::cos(at.heading_rad + half);
  at.heading_rad += turn_rad;
  return at;
}

double speed_at(const Speeds& speeds, int frame) {
  const auto next = std::ranges::find_if(speeds, [&](const auto& s) { return s.first > frame; });
  if (next == speeds.begin()) return next->second;
  const auto last = std::prev(next);
  if (next == speeds.end()) return last->second;
  const double part = static_cast<double>(frame - last->first) / (next->first - last->first);
  return last->second + part * (next->second - last->second);
}

}  // namespace

std::vector<Stance> drive(Stance at, int n_frames, const Drive& advance) {
  std::vector<Stance> stances;
  for (int frame = 0; frame < n_frames; ++frame) {
    stances.push_back(at);
    const auto [ahead_m, turn_rad] = advance(frame);
    const double chord = at.heading_rad + turn_rad / 2;
    at.x_m += ahead_m * std::sin(chord);
    at.z_m += ahead_m * std::cos(chord);
    at.heading_rad += turn_rad;
  }
  return stances;
}

SE3 pose(const Stance& at, double y_m) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(at.heading_rad, Eigen::Vector3d::UnitY())),
          {at.x_m, y_m, at.z_m}};
}

std::vector<SE3> camera_on(const std::vector<Stance>& stances, double bounce) {
  std::vector<SE3> poses;
  for (size_t i = 0; i < stances.size(); ++i) {
    const auto t = static_cast<double>(i);
    const double pitch = bounce * 0.0012 * std::sin(0.9 * t + 0.4);
    const double roll = bounce * 0.0008 * std::sin(0.61 * t + 1.1);
    const Eigen::Quaterniond sway = so3_exp({pitch, 0, roll});
    poses.push_back(pose(stances[i], -camera_height_m + bounce * 0.006 * std::sin(0.75 * t)) *
                    SE3(sway, Eigen::Vector3d::Zero()));
  }
  return poses;
}

Stance Route::at(double way_m) const {
  Stance stance = start;
  for (size_t i = 0; i < legs.size(); ++i) {
    const Leg& leg = legs[i];
    if (i + 1 == legs.size()) return moved(stance, way_m, 0);
    const double part = std::min(way_m, leg.length_m);
    stance = moved(stance, part, leg.turn_rad * part / leg.length_m);
    way_m -= part;
    if (way_m <= 0) break;
  }
  return stance;
}

std::vector<Stance> drive(const Route& route, double way_m, int n_frames, const Speeds& speeds) {
  std::vector<Stance> stances;
  for (int frame = 0; frame < n_frames; ++frame) {
    stances.push_back(route.at(way_m));
    way_m += speed_at(speeds, frame);
  }
  return stances;
}

CarShape saloon(const Eigen::Vector3f& colour) { return {colour}; }
CarShape small(const Eigen::Vector3f& colour) { return {colour, 3.8, 1.68, 1.48, true}; }
CarShape wagon(const Eigen::Vector3f& colour) { return {colour, 4.5, 1.80, 1.50, true}; }
CarShape delivery_van(const Eigen::Vector3f& colour) { return {colour, 5.2, 1.95, 2.25, true}; }

void Cast::moving(const CarShape& shape, const Stance& start, const Drive& advance) {
  add(shape, drive(start, scenario_.n_frames(), advance), 0, scenario_.n_frames());
}

void Cast::moving(const CarShape& shape, const std::vector<Stance>& stances, int from, int to) {
  add(shape, stances, from, to);
}

void Cast::parked(const CarShape& shape, const Stance& at) {
  add(shape, std::vector<Stance>(scenario_.T_world_camera.size(), at), 0, scenario_.n_frames());
}

void Cast::add(CarShape shape, const std::vector<Stance>& stances, int from, int to) {
  Actor actor{.id = static_cast<int>(scenario_.actors.size()) + 1,
              .type = shape.height_m > 1.9 ? "Van" : "Car"};
  shape.seed = 1000 + static_cast<uint32_t>(actor.id);
  actor.shape = shape;
  for (int frame = 0; frame < static_cast<int>(stances.size()); ++frame) {
    const bool there = frame >= from && frame <= to;
    actor.T_world_object.push_back(there ? std::optional(pose(stances[frame], 0.0)) : std::nullopt);
  }
  scenario_.actors.push_back(std::move(actor));
}

namespace {

using Eigen::Vector3d;

constexpr double usual_camera_height_m = 1.65;  // camera height of KITTI and Virtual KITTI
constexpr double near_ground_m = 25;  // the wheels of nearer objects determine the height of the camera
constexpr double sight_m = 60;        // more distant objects may be hidden by houses

/// Returns the usual width, height, length (m) of a labelled type.
Vector3d usual_size_m(const std::string& type) {
  static const std::map<std::string, Vector3d> sizes = {
      {"Van", {1.9, 2.2, 5.0}},         {"Truck", {2.6, 3.2, 10.0}},        {"Tram", {2.6, 3.5, 16.0}},
      {"Pedestrian", {0.7, 1.75, 0.8}}, {"Person", {0.7, 1.3, 0.8}},        {"Cyclist", {0.6, 1.75, 1.8}},
      {"Bus", {2.6, 3.2, 11.0}},        {"Person_sitting", {0.6, 1.3, 0.8}}};
  const auto it = sizes.find(type);
  return it == sizes.end() ? Vector3d(1.65, 1.5, 3.9) : it->second;
}

Eigen::Vector3f paint_of(int id) {
  static const std::vector<Eigen::Vector3f> colours = {red,   silver, blue,   white,
                                                       black, green,  yellow, {0.35F, 0.33F, 0.30F}};
  return colours[hash3(5, 9, static_cast<uint32_t>(id)) % colours.size()];
}

Actor make_actor(const ObjectTruth& object, int n_frames) {
  const Vector3d size_m = object.size_m.value_or(usual_size_m(object.type));
  Actor actor{.id = object.id, .type = object.type.empty() ? "Car" : object.type};
  actor.shape = {paint_of(object.id), size_m.z(),
                 size_m.x(),          size_m.y(),
                 actor.type != "Car",
                 /*fills_box=*/true,  1000 + static_cast<uint32_t>(object.id)};
  actor.T_world_object.resize(static_cast<size_t>(n_frames));
  return actor;
}

std::vector<Actor> make_actors(const SequenceTruth& truth, int first, int last,
                               const std::vector<SE3>& T_world_camera) {
  const int n_frames = last - first + 1;
  std::map<int, Actor> actors;
  for (int frame = first; frame <= last; ++frame) {
    const auto it = truth.objects.find(frame);
    if (it == truth.objects.end()) continue;
    const auto at = static_cast<size_t>(frame - first);
    for (const ObjectTruth& object : it->second) {
      Actor& actor = actors.try_emplace(object.id, make_actor(object, n_frames)).first->second;
      actor.T_world_object[at] = T_world_camera[at] * object.T_camera_object;
    }
  }
  std::vector<Actor> list;
  for (auto& [id, actor] : actors) list.push_back(std::move(actor));
  return list;
}

/// Returns the median height of the camera over the wheels of nearby objects, or the usual height.
double median_camera_height_m(const Scenario& scenario) {
  std::vector<double> heights_m;
  for (const Actor& actor : scenario.actors) {
    for (size_t i = 0; i < actor.T_world_object.size(); ++i) {
      if (!actor.T_world_object[i]) continue;
      const Vector3d d = actor.T_world_object[i]->translation() - scenario.T_world_camera[i].translation();
      if (d.norm() < near_ground_m) heights_m.push_back(d.y());
    }
  }
  if (heights_m.size() < 5) return usual_camera_height_m;
  return std::clamp(upper_median(heights_m), 1.0, 3.0);
}

/// Returns the middle and the corners of the bottom face.
std::vector<Vector3d> footprint(const Actor& actor, const SE3& T_world_object) {
  std::vector<Vector3d> points = {T_world_object.translation()};
  for (const double x : {-0.5, 0.5}) {
    for (const double z : {-0.5, 0.5}) {
      points.push_back(T_world_object * Vector3d(x * actor.shape.width_m, 0, z * actor.shape.length_m));
    }
  }
  return points;
}

Mesh make_world(const Scenario& scenario) {
  StreetWay way;
  way.seed = 7;
  const double height_m = median_camera_height_m(scenario);
  for (const SE3& camera : scenario.T_world_camera) {
    way.points.push_back(
        {camera.translation() + Vector3d(0, height_m, 0), camera.rotation() * Vector3d::UnitZ()});
  }
  for (const Actor& actor : scenario.actors) {
    for (size_t i = 0; i < actor.T_world_object.size(); ++i) {
      if (!actor.T_world_object[i]) continue;
      std::ranges::move(footprint(actor, *actor.T_world_object[i]), std::back_inserter(way.keep_free));
      const Vector3d from = scenario.T_world_camera[i].translation();
      const Vector3d to = actor.T_world_object[i]->translation();
      if ((to - from).norm() < sight_m) way.sight.push_back({from, to});
    }
  }
  return make_street_along(way);
}

}  // namespace

Scenario replay_scenario(const SequenceTruth& truth, int first, int last, Scenario shape) {
  Scenario scenario = std::move(shape);
  scenario.T_world_camera.clear();
  for (int frame = first; frame <= last; ++frame) {
    const std::optional<SE3> pose = truth.camera.pose(frame);
    if (!pose) fail("{}: frame {} has no camera pose", scenario.name, frame);
    scenario.T_world_camera.push_back(*pose);
  }
  const Vector3d down = scenario.T_world_camera.front().rotation() * Vector3d::UnitY();
  if (down.y() < std::cos(std::numbers::pi / 6)) {
    fail(
        "{}: the camera's down axis points to ({:.2f}, {:.2f}, "
        "{:.2f}) in the world, expected (0, 1, 0) within 30 degrees",
        scenario.name, down.x(), down.y(), down.z());
  }
  const SE3 T_ours_world(Eigen::Quaterniond::Identity(), -scenario.T_world_camera.front().translation());
  for (SE3& pose : scenario.T_world_camera) pose = T_ours_world * pose;
  scenario.actors = make_actors(truth, first, last, scenario.T_world_camera);
  scenario.world = make_world(scenario);
  return scenario;
}

}  // namespace sextant::synthetic
