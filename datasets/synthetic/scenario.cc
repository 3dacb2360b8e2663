#include "sextant/datasets/synthetic/scenario.h"

#include <functional>
#include <set>
#include <span>

#include "sextant/base/registry.h"
#include "sextant/datasets/codec/vkitti_box.h"
#include "sextant/datasets/synthetic/choreography.h"

namespace sextant::synthetic {
namespace {

struct Entry {
  std::string name;
  std::function<Scenario()> make;
};

std::span<const Entry> entries() {
  static const std::vector<Entry> table = {
      {"s18", s18},   {"s01-turn", s01_turn}, {"s01-crossing", s01_crossing},
      {"city", city}, {"highway", highway},   {"stereo-drive", stereo_drive}};
  return table;
}

/// m; empty where the actor is missing in one of the frames.
std::optional<double> step_m(const Actor& actor, int from, int to) {
  const int n = static_cast<int>(actor.T_world_object.size());
  if (from < 0 || to >= n) return std::nullopt;
  const auto& before = actor.T_world_object[static_cast<size_t>(from)];
  const auto& after = actor.T_world_object[static_cast<size_t>(to)];
  if (!before || !after) return std::nullopt;
  return (after->translation() - before->translation()).norm();
}

}  // namespace

bool Actor::moves(int frame) const {
  const auto ahead = step_m(*this, frame, frame + 1);
  return (ahead ? *ahead : step_m(*this, frame - 1, frame).value_or(0)) >= moving_step_m;
}

Scenario make_scenario(const std::string& name) {
  Scenario scenario = find_entry(entries(), name, "scenario").make();
  scenario.name = name;
  return scenario;
}

std::vector<std::string> scenario_names() {
  std::vector<std::string> names;
  for (const Entry& entry : entries()) names.push_back(entry.name);
  return names;
}

void Scenario::check() const {
  camera.check();
  if (width <= 0 || height <= 0 || !(rate_hz > 0)) {
    fail("scenario '{}': images of {}x{} at {} Hz: expected positive numbers", name, width, height, rate_hz);
  }
  if (T_world_camera.empty()) fail("scenario '{}': it has no camera poses", name);
  for (const SE3& pose : T_world_camera) {
    if (!pose.is_finite()) fail("scenario '{}': a camera pose is not finite", name);
  }
  std::set<int> ids;
  for (const Actor& actor : actors) {
    if (actor.id < 1 || actor.id > 65535) {
      fail("scenario '{}': object id {}: expected 1..65535, which masks can hold", name, actor.id);
    }
    if (!ids.insert(actor.id).second) fail("scenario '{}': object id {} is given twice", name, actor.id);
    if (actor.T_world_object.size() != T_world_camera.size()) {
      fail("scenario '{}': object {} has {} poses, the camera {}: expected one a frame", name, actor.id,
           actor.T_world_object.size(), T_world_camera.size());
    }
    for (const auto& pose : actor.T_world_object) {
      if (pose && !pose->is_finite())
        fail("scenario '{}': a pose of object {} is not finite", name, actor.id);
    }
  }
}

}  // namespace sextant::synthetic
