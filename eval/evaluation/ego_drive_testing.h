#pragma once

// A drive of a camera, from which the tests of evaluate ego make reference and estimate.

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/ego_evaluation.h"

namespace sextant {

/// A drive with varying speeds and turns, sampled at the times t = i / rate + shift.
inline PoseSeries drive(int n, double rate_hz, double shift_s = 0, double scale = 1) {
  PoseSeries s;
  for (int i = 0; i < n; ++i) {
    const double t = i / rate_hz + shift_s;
    const double yaw = 0.6 * std::sin(0.7 * t) + 0.3 * std::sin(1.9 * t);
    s.add(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix(),
          scale * Eigen::Vector3d(5 * std::sin(0.5 * t), 0.2 * std::sin(t), 8 * t + 3 * std::sin(1.3 * t)));
    s.stamps_s.push_back(100 + i / rate_hz);
  }
  return s;
}

inline EgoReference reference_of(PoseSeries poses, const std::string& name = "a.txt") {
  EgoReference reference;
  reference.poses = std::move(poses);
  reference.side.name = name;
  return reference;
}

inline EgoResult evaluate(PoseSeries reference, PoseSeries estimate, const EgoOptions& options = {}) {
  TrajectoryFile file;
  file.poses = std::move(estimate);
  return evaluate_ego(reference_of(std::move(reference)), std::move(file), "b.txt", options);
}

inline PoseSeries noisy(PoseSeries s) {
  for (size_t i = 0; i < s.size(); ++i) s.positions_m[i][0] += 0.01 * std::sin(37.0 * static_cast<double>(i));
  return s;
}

/// A path of a vehicle with the given speed (m/s) and yaw rate (rad/s) as functions of time.
template <typename Speed, typename YawRate>
PoseSeries vehicle(int n, double rate_hz, const Speed& speed, const YawRate& yaw_rate) {
  PoseSeries s;
  double yaw = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int i = 0; i < n; ++i) {
    const double t = i / rate_hz;
    yaw += yaw_rate(t) / rate_hz;
    p += speed(t) / rate_hz * Eigen::Vector3d(std::sin(yaw), 0.02 * std::sin(t / 3), std::cos(yaw));
    s.add(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix(), p);
    s.stamps_s.push_back(100 + t);
  }
  return s;
}

/// A car in traffic: speed and yaw rate change within several seconds.
inline PoseSeries car(int n, double rate_hz, double phase) {
  return vehicle(
      n, rate_hz, [=](double t) { return 8 + 3 * std::sin(t / 7 + phase); },
      [=](double t) { return 0.25 * std::sin(t / 5 + 2 * phase); });
}

/// A car that stops for several seconds.
inline PoseSeries stop_and_go(int n, double rate_hz, double phase) {
  const auto speed = [=](double t) { return std::max(0.0, 8 * std::sin(t / 6 + phase)); };
  return vehicle(n, rate_hz, speed,
                 [=](double t) { return speed(t) > 0 ? 0.3 * std::sin(t / 9 + 2 * phase) : 0.0; });
}

/// An odometry whose steps have independent errors of translation, as a share of their length, and of
/// rotation.
inline PoseSeries with_step_errors(const PoseSeries& truth, unsigned seed, double share = 0.01,
                                   double scale = 1) {
  constexpr double rotation_rad = 0.0005, least_m = 0.01;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto error = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  PoseSeries out = truth;
  SE3 P = truth.pose(0);
  for (size_t i = 1; i < truth.size(); ++i) {
    const SE3 step = truth.pose(i - 1).inverse() * truth.pose(i);
    const double length_m = std::max(least_m, step.translation().norm());
    P = P * SE3(step.rotation() * so3_exp(rotation_rad * error()),
                scale * step.translation() + share * length_m * error());
    out.rotations[i] = P.rotation().toRotationMatrix();
    out.positions_m[i] = P.translation();
  }
  return out;
}

/// Matchers of a warning, by its code and by a part of its text.
inline auto code(const std::string& name) { return testing::Field("code", &DataWarning::code, name); }
inline auto text(const std::string& part) {
  return testing::Field("text", &DataWarning::text, testing::HasSubstr(part));
}

}  // namespace sextant
