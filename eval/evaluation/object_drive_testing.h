#pragma once

// Cars in front of a moving camera, whose logs the tests of object motions write.

#include <cmath>
#include <map>
#include <random>
#include <string>

#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

inline SE3 about_y(double angle, const Eigen::Vector3d& t) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())), t};
}

/// Two cars in front of a moving camera; estimates have errors of 5 %.
struct Drive {
  static constexpr int n_frames = 30;
  std::map<ObjectFrame, SE3> L;         // T_world_object
  std::map<ObjectFrame, SE3> estimate;  // H in the world, of k-1 to k
  Trajectory camera;

  explicit Drive(double slow = 1) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    SE3 C = about_y(0.2, {1, 0, 0});
    for (int k = 0; k < n_frames; ++k) {
      camera.set(k, C);
      C = C * about_y(0.01 * std::sin(0.3 * k), {0, 0, 0.8 + 0.2 * std::sin(0.4 * k)});
    }
    for (const int id : {1, 4}) {
      SE3 pose = about_y(0.7 * id, {-2.0 + 2 * id, 1, 10.0 + 3 * id});
      for (int k = 0; k < n_frames; ++k) {
        L[{id, k}] = pose;
        const double speed = slow * (0.5 + 0.1 * id) * (1 + 0.5 * std::sin(0.9 * k + id));
        const SE3 step = about_y(0.02 * std::cos(0.5 * k), {0, 0, speed});
        Vector6d xi;
        for (int i = 0; i < 6; ++i) xi[i] = 0.05 * speed * normal(random) * (i < 3 ? 0.6 : 0.1);
        const SE3 next = pose * step;
        if (k + 1 < n_frames) estimate[{id, k + 1}] = pose * (step * SE3::exp(xi)) * pose.inverse();
        pose = next;
      }
    }
  }
  SE3 truth(ObjectFrame key) const { return world_step(L, key).value(); }
};

/// Formats a pose as in the logs of dynosam.
inline std::string csv(const SE3& T) {
  const Eigen::Vector3d& t = T.translation();
  const Eigen::Quaterniond& q = T.rotation();
  return fmt::format("{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g}", t.x(), t.y(), t.z(), q.x(),
                     q.y(), q.z(), q.w());
}

/// Writes the logs of dynosam, m_*, of a drive with these estimated poses, and returns the files to evaluate.
inline ObjectFiles write_dynosam(const Drive& drive, const std::map<ObjectFrame, SE3>& poses,
                                 const TempFolder& folder) {
  std::string of_motions, of_poses;
  for (const auto& [key, L] : poses)
    of_poses += fmt::format("{},{},{},{}\n", key.second, key.first, csv(L), csv(drive.L.at(key)));
  for (const auto& [key, H] : drive.estimate)
    of_motions += fmt::format("{},{},{},{}\n", key.second, key.first, csv(H), csv(drive.truth(key)));
  folder.write("m_object_motion_log.csv", of_motions);
  folder.write("m_object_pose_log.csv", of_poses);
  ObjectFiles files;
  files.folders = {folder.path()};
  files.format = LogFormat::dynosam;
  return files;
}

}  // namespace sextant
