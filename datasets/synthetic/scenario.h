#pragma once

// What happens in a synthetic sequence: the static scene, the cars and the motions, frame by frame.
//
//   s18           11 frames, driving ahead; three moving cars at about 8, 18 and 26 m, and parked ones
//   s01-turn      16 frames, turning left by 2.6 to 1.5 degrees a frame behind a car 13 m away
//   s01-crossing  12 frames, standing; a car 14 m away turns left

#include <string>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/datasets/synthetic/car.h"
#include "sextant/datasets/synthetic/street.h"
#include "sextant/geometry/se3.h"

namespace sextant::synthetic {

struct Actor {
  int id = 0;  ///< in masks; 1..
  CarShape shape;
  bool moving = false;
  std::vector<SE3> T_world_object;  ///< one a frame
};

struct Scenario {
  std::string name;
  StreetPlan street;
  std::vector<Actor> actors;        ///< in order of id
  std::vector<SE3> T_world_camera;  ///< one a frame; frame numbers start at 0

  int n_frames() const { return static_cast<int>(T_world_camera.size()); }
};

/// Throws Error on an unknown name, with the nearest one.
Scenario make_scenario(const std::string& name);

}  // namespace sextant::synthetic
