#include "sextant/datasets/synthetic/choreography.h"

#include <algorithm>
#include <cmath>

namespace sextant::synthetic {
namespace {

constexpr double camera_height_m = 1.65;

/// By the chord of an arc.
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

}  // namespace sextant::synthetic
