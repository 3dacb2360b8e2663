#include "sextant/datasets/synthetic/view.h"

namespace sextant::synthetic {
namespace {

std::vector<std::optional<SE3>> poses(const Scenario& scenario, int frame, const SE3& T_camera_world) {
  std::vector<std::optional<SE3>> T_camera_body = {T_camera_world};
  for (const Actor& actor : scenario.actors) {
    const std::optional<SE3>& T_world_object = actor.T_world_object[frame];
    T_camera_body.push_back(T_world_object ? std::optional(T_camera_world * *T_world_object) : std::nullopt);
  }
  return T_camera_body;
}

}  // namespace

View::View(const Scenario& scenario, const Bodies& bodies, int frame_number, double right_m)
    : frame(frame_number),
      T_world_camera(scenario.T_world_camera[frame_number] *
                     SE3(Eigen::Quaterniond::Identity(), {right_m, 0, 0})),
      T_camera_body(poses(scenario, frame, T_world_camera.inverse())),
      surfaces(bodies, T_camera_body, scenario.camera.left, scenario.width, scenario.height),
      seen(surfaces.seen()) {}

}  // namespace sextant::synthetic
