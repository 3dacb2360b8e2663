#pragma once

// Readings of flow and of depth that were decoded in another way than they were stored. The check of sources
// and the evaluation of flow and depth images try the same readings.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sextant {

struct FlowReading {
  const char* cause;   ///< "flow has u and v swapped"
  const char* remedy;  ///< "exchange u and v"; empty if the format of the files is wrong
  /// Returns the flow (px) that was meant by the given one, in images of width x height px.
  Eigen::Vector2d (*read)(const Eigen::Vector2d& given, double width, double height);
  /// Formats of flow files: the reading applies to files that are read as `read_as`. Empty: applies to all.
  std::string_view read_as = {}, stored_as = {};
};

std::span<const FlowReading> flow_readings();

struct DepthReading {
  std::string cause;      ///< "depth looks like centimetres: the files are read as disparity * 256"
  std::string stored_as;  ///< kind of depth files that has this meaning; empty if no reader has it
  /// Returns the depth (m) that was meant by the given one; `bf` is focal length times baseline, px m.
  std::function<double(double z_m, double bf)> read;
};

/// Returns the other meanings of the integers of depth files of a kind ("disparity256", "depth256", "cm");
/// empty for other kinds.
std::vector<DepthReading> depth_readings(std::string_view kind);

}  // namespace sextant
