#include "sextant/datasets/synthetic/replay_scenario.h"

#include <algorithm>
#include <map>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"
#include "sextant/datasets/synthetic/street_along.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

constexpr double usual_camera_height_m = 1.65;  // KITTI's; also that of Virtual KITTI
constexpr double near_ground_m = 25;    // an object's wheels nearer than that tell the height of the camera
constexpr double sight_m = 60;          // objects farther away may be hidden by houses

/// Usual width, height, length (m) of what labels name.
Vector3d usual_size_m(const std::string& type) {
  static const std::map<std::string, Vector3d> sizes = {
      {"Van", {1.9, 2.2, 5.0}},         {"Truck", {2.6, 3.2, 10.0}},        {"Tram", {2.6, 3.5, 16.0}},
      {"Pedestrian", {0.7, 1.75, 0.8}}, {"Person", {0.7, 1.3, 0.8}},        {"Cyclist", {0.6, 1.75, 1.8}},
      {"Bus", {2.6, 3.2, 11.0}},        {"Person_sitting", {0.6, 1.3, 0.8}}};
  const auto it = sizes.find(type);
  return it == sizes.end() ? Vector3d(1.65, 1.5, 3.9) : it->second;
}

Eigen::Vector3f paint(int id) {
  static const std::vector<Eigen::Vector3f> colours = {
      {0.62F, 0.10F, 0.09F}, {0.52F, 0.54F, 0.56F}, {0.13F, 0.22F, 0.48F}, {0.80F, 0.80F, 0.79F},
      {0.10F, 0.10F, 0.11F}, {0.16F, 0.33F, 0.24F}, {0.75F, 0.62F, 0.16F}, {0.35F, 0.33F, 0.30F}};
  return colours[hash3(5, 9, static_cast<uint32_t>(id)) % colours.size()];
}

Actor make_actor(const ObjectTruth& object, int n_frames) {
  const Vector3d size_m = object.size_m.value_or(usual_size_m(object.type));
  Actor actor{.id = object.id, .type = object.type.empty() ? "Car" : object.type};
  actor.shape = {paint(object.id),    size_m.z(),
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

/// How high the camera is over the wheels of what drives near it, or the usual height.
double camera_height_m(const Scenario& scenario) {
  std::vector<double> heights_m;
  for (const Actor& actor : scenario.actors) {
    for (size_t i = 0; i < actor.T_world_object.size(); ++i) {
      if (!actor.T_world_object[i]) continue;
      const Vector3d d = actor.T_world_object[i]->translation() - scenario.T_world_camera[i].translation();
      if (d.norm() < near_ground_m) heights_m.push_back(d.y());
    }
  }
  if (heights_m.size() < 5) return usual_camera_height_m;
  return std::clamp(middle_of(heights_m), 1.0, 3.0);
}

/// The middle and the corners of the bottom face.
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
  const double height_m = camera_height_m(scenario);
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
