#pragma once

// Estimated and true paths of the camera (body "ego") and of objects ("object:ID") in the world, as a run
// writes them to tracks.csv:
//
//   body,frame,x_m,y_m,z_m,x_gt_m,y_gt_m,z_gt_m      world coordinates; empty: not estimated, no truth
//
//   ego         centre of the camera; the estimate is accumulated from the motions, from the true pose on
//   object:ID   origin of the true box, moved by the estimated H_world: the path starts at the truth at
//               the beginning of each sequence of consecutive estimates, and drifts with their errors
//
// `evaluate objects --out` writes them to tracks/, where each line continues with the orientations (unit
// quaternions) of the estimate and of the truth,
//
//   ..,qx,qy,qz,qw,qx_gt,qy_gt,qz_gt,qw_gt
//
// and the estimates are the poses of the log. Objects of a log without poses are chained from its motions as
// above.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "sextant/geometry/se3.h"

namespace sextant {

struct TrackPoint {
  int frame = 0;
  std::optional<Eigen::Vector3d> estimate_m;
  std::optional<Eigen::Vector3d> truth_m;
  /// Orientation of the body in the world where the position is known. A run's tracks.csv does not contain
  /// it.
  std::optional<Eigen::Quaterniond> estimate_rotation{};
  std::optional<Eigen::Quaterniond> truth_rotation{};

  void set_estimate(const SE3& T_world_body);
  void set_truth(const SE3& T_world_body);
  /// Return T_world_body; nullopt unless position and orientation are known.
  std::optional<SE3> estimate() const;
  std::optional<SE3> truth() const;
};

struct BodyTrack {
  std::string body;                ///< "ego" or "object:ID", as in records
  std::vector<TrackPoint> points;  ///< ordered by frame

  /// Returns the point of a frame; null if there is none.
  const TrackPoint* find(int frame) const;
};

/// Returns the path of the tracks of a system's run below a folder of `evaluate objects --out`. Different
/// systems have different files, whatever their names are.
std::string tracks_file(const std::string& system, uint64_t run);

std::string write_tracks(const std::vector<BodyTrack>& tracks, bool with_orientations = false);
/// Parses a file of either form. Throws Error that begins with "NAME:LINE" if a line is malformed.
std::vector<BodyTrack> parse_tracks(const std::string& text, const std::string& name);

}  // namespace sextant
