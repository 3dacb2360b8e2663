#pragma once

// Paths of the camera and of objects in the world, estimated and true, as a run leaves them in tracks.csv:
//
//   body,frame,x_m,y_m,z_m,x_gt_m,y_gt_m,z_gt_m      world coordinates; empty: not estimated, no truth
//
//   camera   its centre; the estimate is accumulated and starts at the true pose
//   objects  the origin of the true box. The estimate moves it by the estimated H_world: it starts at the
//            truth where a stretch of estimates begins, and drifts as the motions err

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace sextant {

struct TrackPoint {
  int frame = 0;
  std::optional<Eigen::Vector3d> estimate_m;
  std::optional<Eigen::Vector3d> truth_m;
  /// Orientation of the body in the world where the position is known. Not in tracks.csv: absent when read.
  std::optional<Eigen::Quaterniond> estimate_rotation{};
  std::optional<Eigen::Quaterniond> truth_rotation{};
};

struct BodyTrack {
  std::string body;                ///< "ego" or "object:ID", as in records
  std::vector<TrackPoint> points;  ///< by frame
};

std::string write_tracks(const std::vector<BodyTrack>& tracks);
/// Throws Error that begins with "NAME:LINE".
std::vector<BodyTrack> parse_tracks(const std::string& text, const std::string& name);

}  // namespace sextant
