#pragma once

// Content of a synthetic sequence: the camera, the static scene, the cars and all motions, frame by frame.
// World axes: x right, y down, z ahead. Scenarios are built by code, or selected by name:
//
//   s18           11 frames, driving ahead; three moving cars at about 8, 18 and 26 m, and parked ones
//   s01-turn      16 frames, turning left by 2.6 to 1.5 degrees a frame behind a car 13 m away
//   s01-crossing  12 frames, standing; a car 14 m away turns left
//   city          160 frames: along a street, a stop at a crossing with traffic, then left into another
//                 street; parked and moving cars, some stop, some come and go
//   highway       40 frames in dense traffic: moving cars cover most of the road
//   stereo-drive  30 frames on a winding street with KITTI's camera

#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/synthetic/mesh.h"
#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"

namespace sextant::synthetic {

/// A car. Object axes: x right, y down, z ahead, origin in the middle of the box's bottom face.
struct Actor {
  int id = 0;  ///< id in masks and truth; 1..65535
  CarShape shape;
  std::string type = "Car";                        ///< type in the truth: "Car", "Van"
  std::vector<std::optional<SE3>> T_world_object;  ///< one per frame; nullopt while the car is absent

  /// Returns the `moving` flag of the truth, as in Virtual KITTI: true for a step of 1 cm or more to the next
  /// frame; in the last frame of the car, from the previous one.
  bool moves(int frame) const;
};

struct Scenario {
  std::string name;
  StereoCamera camera = virtual_kitti_camera();  ///< both cameras; the right one lies bf / fx along x
  int width = 1242;
  int height = 375;
  double rate_hz = 10;
  Mesh world;                       ///< everything static except the parked cars, world coordinates
  std::vector<Actor> actors;        ///< with distinct ids
  std::vector<SE3> T_world_camera;  ///< one per frame; frame numbers start at 0

  int n_frames() const { return static_cast<int>(T_world_camera.size()); }
  /// Throws Error if a frame, a pose or an id is missing or invalid.
  void check() const;

  static StereoCamera virtual_kitti_camera() { return {{725.0, 725.0, 620.5, 187.0}, 725.0 * 0.532725}; }
};

/// Returns a scenario of the frames 0, n, 2n, .. at the n-th part of the frame rate, with the name
/// "NAME/everyN"; the given scenario for n = 1. Throws Error if n < 1, or if fewer than two frames would be
/// left.
Scenario every_nth_frame(Scenario scenario, int n);

/// Returns the scenario of this name; throws Error with the nearest name if there is none.
Scenario make_scenario(const std::string& name);
std::vector<std::string> scenario_names();

}  // namespace sextant::synthetic
