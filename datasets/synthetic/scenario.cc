#include "sextant/datasets/synthetic/scenario.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "sextant/base/registry.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

constexpr double kCameraHeight_m = 1.65;
constexpr double kDegree = std::numbers::pi / 180;

/// A place on the ground and a heading: 0 looks along z, positive turns right (towards x).
struct Stance {
  double x_m = 0;
  double z_m = 0;
  double heading_rad = 0;
};

/// One frame's way of a vehicle.
struct Advance {
  double ahead_m = 0;
  double turn_rad = 0;
};

using Drive = std::function<Advance(int frame)>;  ///< from this frame to the next

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

/// The camera on a car: it also nods and sways a little on its springs, in proportion to `bounce`.
std::vector<SE3> camera_on(const std::vector<Stance>& stances, double bounce) {
  std::vector<SE3> poses;
  for (size_t i = 0; i < stances.size(); ++i) {
    const auto t = static_cast<double>(i);
    const double pitch = bounce * 0.0012 * std::sin(0.9 * t + 0.4);
    const double roll = bounce * 0.0008 * std::sin(0.61 * t + 1.1);
    const Eigen::Quaterniond sway = so3_exp({pitch, 0, roll});
    poses.push_back(pose(stances[i], -kCameraHeight_m + bounce * 0.006 * std::sin(0.75 * t)) *
                    SE3(sway, Eigen::Vector3d::Zero()));
  }
  return poses;
}

const Eigen::Vector3f kRed(0.62F, 0.10F, 0.09F), kBlue(0.13F, 0.22F, 0.48F), kWhite(0.80F, 0.80F, 0.79F),
    kSilver(0.52F, 0.54F, 0.56F), kGreen(0.16F, 0.33F, 0.24F), kBlack(0.10F, 0.10F, 0.11F),
    kYellow(0.75F, 0.62F, 0.16F);

class Cast {
 public:
  explicit Cast(Scenario& scenario) : scenario_(scenario) {}

  void moving(CarShape shape, const Stance& start, const Drive& advance) {
    add(shape, true, drive(start, scenario_.n_frames(), advance));
  }
  void parked(CarShape shape, const Stance& at) {
    add(shape, false, std::vector<Stance>(scenario_.T_world_camera.size(), at));
  }

 private:
  void add(CarShape shape, bool moving, const std::vector<Stance>& stances) {
    Actor actor;
    actor.id = static_cast<int>(scenario_.actors.size()) + 1;
    actor.shape = shape;
    actor.shape.seed = 1000 + static_cast<uint32_t>(actor.id);
    actor.moving = moving;
    for (const Stance& stance : stances) actor.T_world_object.push_back(pose(stance, 0.0));
    scenario_.actors.push_back(std::move(actor));
  }

  Scenario& scenario_;
};

CarShape saloon(const Eigen::Vector3f& colour) { return {colour}; }
CarShape small(const Eigen::Vector3f& colour) { return {colour, 3.8, 1.68, 1.48, true}; }
CarShape wagon(const Eigen::Vector3f& colour) { return {colour, 4.5, 1.80, 1.50, true}; }

Scenario s18() {
  Scenario s;
  s.world = make_street({.z_to_m = 170, .seed = 18});
  const auto ego = drive({1.75, 0, 0.004}, 11, [](int k) {
    return Advance{0.605 + 0.065 * std::sin(0.7 * k + 0.5), 0.0015 * std::cos(0.5 * k)};
  });
  s.T_world_camera = camera_on(ego, 1.0);
  Cast cast(s);
  cast.moving(CarShape{kRed, 3.55, 1.52, 1.34}, {-1.65, 7.75, 0.01}, [](int k) {
    return Advance{0.66 + 0.03 * std::sin(0.8 * k), 0.004 * std::sin(0.6 * k)};
  });
  cast.moving(CarShape{kSilver, 4.1, 1.64, 1.38, true}, {1.60, 17.6, -0.01}, [](int k) {
    return Advance{0.64 + 0.05 * std::sin(0.5 * k + 2), 0.003 * std::cos(0.7 * k)};
  });
  cast.moving(CarShape{kYellow, 3.6, 1.56, 1.36, true}, {-1.70, 25.8, 0.0}, [](int k) {
    return Advance{0.67 - 0.006 * k, -0.004 * std::sin(0.4 * k + 1)};
  });
  cast.parked(wagon(kBlue), {4.75, 15.5, 0.01});
  cast.parked(saloon(kWhite), {4.80, 21.6, -0.01});
  cast.parked(small(kGreen), {-4.80, 22.5, std::numbers::pi});
  cast.parked(saloon(kBlack), {-4.75, 34.0, std::numbers::pi + 0.02});
  cast.parked(saloon(kSilver), {4.75, 36.5, 0.0});
  return s;
}

constexpr double kCrossing_m = 30;

StreetPlan crossroads(uint32_t seed) {
  StreetPlan plan;
  plan.z_to_m = 120;
  plan.crossing_z_m = kCrossing_m;
  plan.seed = seed;
  return plan;
}

Scenario s01_turn() {
  Scenario s;
  s.world = make_street(crossroads(11));
  const auto ego = drive({1.0, kCrossing_m - 8.5, -25 * kDegree}, 16, [](int k) {
    return Advance{0.73 - 0.19 * k / 14.0, -(2.6 - 1.1 * k / 14.0) * kDegree};
  });
  s.T_world_camera = camera_on(ego, 0.7);
  Cast cast(s);
  cast.moving(saloon(kRed), {-7.0, kCrossing_m + 1.9, -82 * kDegree}, [](int k) {
    return Advance{0.66 - 0.004 * k, -(0.9 - 0.05 * k) * kDegree};
  });
  cast.parked(wagon(kBlue), {-15.0, kCrossing_m + 4.8, -90 * kDegree});
  cast.parked(small(kWhite), {-21.5, kCrossing_m + 4.8, -91 * kDegree});
  cast.parked(saloon(kGreen), {-17.5, kCrossing_m - 4.8, 90 * kDegree});
  return s;
}

Scenario s01_crossing() {
  Scenario s;
  s.world = make_street(crossroads(12));
  s.T_world_camera = camera_on(std::vector<Stance>(12, {1.75, kCrossing_m - 14.5, 0.02}), 0.0);
  Cast cast(s);
  cast.moving(wagon(kBlue), {1.5, kCrossing_m - 2.2, -12 * kDegree}, [](int k) {
    return Advance{0.42 + 0.015 * k, -(4.8 + 0.3 * k) * kDegree};
  });
  cast.parked(saloon(kRed), {-12.0, kCrossing_m + 4.8, -90 * kDegree});
  cast.parked(small(kWhite), {-4.8, kCrossing_m + 16.0, std::numbers::pi});
  cast.parked(saloon(kSilver), {4.8, kCrossing_m + 14.0, 0.0});
  return s;
}

struct Entry {
  std::string name;
  std::function<Scenario()> make;
};

}  // namespace

Scenario make_scenario(const std::string& name) {
  static const std::vector<Entry> table = {
      {"s18", s18}, {"s01-turn", s01_turn}, {"s01-crossing", s01_crossing}};
  const std::span<const Entry> entries(table);
  Scenario scenario = find_entry(entries, name, "scenario").make();
  scenario.name = name;
  return scenario;
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
