#pragma once

// Motions of the vehicles of scenarios: on the ground, frame by frame, by parametric rules.

#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/truth/truth.h"

namespace sextant::synthetic {

inline constexpr double degree = std::numbers::pi / 180;

/// A position on the ground and a heading: 0 is along z, positive turns right (towards x).
struct Stance {
  double x_m = 0;
  double z_m = 0;
  double heading_rad = 0;
};

/// Motion of a vehicle over one frame.
struct Advance {
  double ahead_m = 0;
  double turn_rad = 0;
};

using Drive = std::function<Advance(int frame)>;  ///< from this frame to the next
/// Returns the stances of a vehicle that begins at `at`, frame by frame.
std::vector<Stance> drive(Stance at, int n_frames, const Drive& advance);

/// A path of straight lines and arcs.
struct Route {
  struct Leg {
    double length_m = 0;
    double turn_rad = 0;  ///< heading change over the length of the leg
  };
  Stance start;
  std::vector<Leg> legs;  ///< the last leg goes straight on without end; its length and turn are ignored

  /// Returns the stance `way_m` after the start.
  Stance at(double way_m) const;
};

/// Speed (m per frame) at some frames, in order; linear interpolation in between, constant outside.
using Speeds = std::vector<std::pair<int, double>>;
/// Returns the stances along a route, frame by frame, beginning `way_m` after its start.
std::vector<Stance> drive(const Route& route, double way_m, int n_frames, const Speeds& speeds);

SE3 pose(const Stance& at, double y_m);
/// Returns the poses of a camera on a car, which also pitches and rolls slightly on its springs, in
/// proportion to `bounce`.
std::vector<SE3> camera_on(const std::vector<Stance>& stances, double bounce);

inline const Eigen::Vector3f red(0.62F, 0.10F, 0.09F), blue(0.13F, 0.22F, 0.48F), white(0.80F, 0.80F, 0.79F),
    silver(0.52F, 0.54F, 0.56F), green(0.16F, 0.33F, 0.24F), black(0.10F, 0.10F, 0.11F),
    yellow(0.75F, 0.62F, 0.16F);
CarShape saloon(const Eigen::Vector3f& colour);
CarShape small(const Eigen::Vector3f& colour);
CarShape wagon(const Eigen::Vector3f& colour);
CarShape delivery_van(const Eigen::Vector3f& colour);

/// Adds cars to a scenario with camera poses; ids are assigned in order from 1.
class Cast {
 public:
  explicit Cast(Scenario& scenario) : scenario_(scenario) {}

  void moving(const CarShape& shape, const Stance& start, const Drive& advance);
  /// Adds a car that exists in frames `from`..`to` (inclusive) only.
  void moving(const CarShape& shape, const std::vector<Stance>& stances, int from = 0, int to = 1 << 30);
  void parked(const CarShape& shape, const Stance& at);

 private:
  void add(CarShape shape, const std::vector<Stance>& stances, int from, int to);

  Scenario& scenario_;
};

// The scenarios of scenario.h.
Scenario s18();
Scenario s01_turn();
Scenario s01_crossing();
Scenario city();
Scenario highway();
Scenario stereo_drive();

// A scenario from true motions: cars replace the labelled boxes, and a street is built along the path of the
// camera; houses and trees keep clear of the objects.

/// Returns a scenario in which frames first..last of `truth` are frames 0..last - first. World axes are
/// translated (not rotated), so that the first camera is at the origin. Objects without a size get the usual
/// one of their type. `shape` provides name, camera, image size and rate. Throws Error if a frame has no
/// camera pose, or if the first camera's y axis is more than 30 degrees off the y axis of the world, which
/// must point down.
Scenario replay_scenario(const SequenceTruth& truth, int first, int last, Scenario shape);

}  // namespace sextant::synthetic
