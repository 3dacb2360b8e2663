#pragma once

// Tracks from above: x to the right, z ahead, metres, both axes in one scale.
//
//   showcase    fig. 1: camera and objects of one source, estimated over true, with each object's mean speed
//   top views   fig. 6: camera paths of several systems and the truth, one diagram a sequence

#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// `records` of the same run give the speeds. `title`: the source, for people. No figure without an estimate.
std::vector<Figure> showcase_figures(const std::string& title, const std::vector<BodyTrack>& tracks,
                                     const std::vector<Record>& records);

struct CameraPath {
  std::string system;  ///< "ground truth", "ORB-SLAM3", ..; the truth is drawn first, broad and grey
  std::vector<Eigen::Vector3d> positions_m;
};
inline constexpr const char* truth_path = "ground truth";

struct TopView {
  std::string title;  ///< of the diagram: "0003"
  std::vector<CameraPath> paths;
};

/// All views in one figure, up to three beside each other.
std::vector<Figure> top_view_figures(const std::vector<TopView>& views);

}  // namespace sextant
