#pragma once

// A drive of a camera, from which the tests of evaluate ego make reference and estimate.

#include <cmath>
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

/// Matchers of a warning, by its code and by a part of its text.
inline auto code(const std::string& name) { return testing::Field("code", &DataWarning::code, name); }
inline auto text(const std::string& part) {
  return testing::Field("text", &DataWarning::text, testing::HasSubstr(part));
}

}  // namespace sextant
