#pragma once

// Recorded camera trajectories of other systems. To add a format, write a reader below, one line in the table
// of trajectory_files.cc, and a file in trajectory_files_test.cc.
//
//   tum      t tx ty tz qx qy qz qw                                  s, m; blanks or commas between them
//   tum_ns   as tum with t in ns, as written by ORB-SLAM3 for EuRoC
//            both optionally followed by 12, 21 or 36 numbers of a covariance (pose_collector.h)
//   positions  t x y z                                             s, m; no rotations: GNSS, a prism
//   kitti    r11 r12 r13 tx r21 .. tz, or a frame number before them
//   euroc    t[ns],px,py,pz,qw,qx,qy,qz[,...]                        ground truth and state estimates
//   table    the eight columns, or the four of positions only, by the names in the header
//            (number_file.h), among any others
//   tartanair  tx ty tz qx qy qz qw                                no time: the row number, or --rate
//   vdo      frame and 16 values of T_world_camera
//   dynosam  <m>_camera_pose_log.csv: frame_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,..,gt_qw; also contains the truth
//   vdo_xml  front end of VDO-SLAM, boost serialisation; also contains the truth
//   bag      ROS 1 bag, PATH:/TOPIC (trajectory_readers.h)
//   mcap     MCAP, PATH:/TOPIC (trajectory_readers.h)
//   rosbag2  SQLite file of a rosbag2, PATH:/TOPIC (trajectory_readers.h)
//
// If a header names the columns, it determines the format; requesting another one (except table) is an Error.
// Without names, a file that fits two formats is an Error if no format is requested.
//
// Treatment of damaged files (messages about a line contain its number):
//   not a finite number, too few or too many values, no pose at all     Error
//   quaternion        normalised; a warning when its norm is off 1 by more than 1e-3, Error > 0.02
//   rotation matrix   used unchanged; a warning when R R' is off I by more than 1e-5, Error > 1e-2
//   stamps or frames out of order, or repeated     Error; in recordings: sorted, the first is kept, a warning
//   stamps beyond 1e11 s           Error: another unit
// Positions must be within 1e7 m of 0.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/logs/number_file.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

struct TrajectoryFile {
  PoseSeries poses;                   ///< the estimate, if the file contains both
  std::optional<PoseSeries> truth;    ///< the log's own ground truth, as long as `poses`
  std::vector<std::string> warnings;  ///< repairs
  std::string comments;  ///< comments and header of a text file, or topic of a recording, in lower case
  std::string format;    ///< name in the table
  bool has_quaternions = true;  ///< as that of the format
};

struct TrajectoryFormat {
  std::string name;
  std::string description;
  std::function<TrajectoryFile(const std::string& path, const ReadRules& rules)> read;
  bool has_quaternions = true;  ///< false: rotations are written as matrices
};

std::span<const TrajectoryFormat> trajectory_formats();

/// Reads a file in the format of this name; "auto" or empty: detect_trajectory_format(). Throws Error if the
/// file is not in that format.
TrajectoryFile read_trajectory(const std::string& path, const std::string& format = "auto",
                               const ReadRules& rules = {});

/// Decodes the content of a file, for fuzzers and tests. Messages name recordings "bytes", and text files by
/// the path of a file in memory.
TrajectoryFile decode_trajectory(std::string_view bytes, const std::string& format,
                                 const std::string& topic = "");

/// Formats that fit the first record of a file and the names of its columns; no names if none fits.
struct FittingFormats {
  std::vector<std::string> names;
  std::string problem;  ///< reason why none or several fit; empty if exactly one fits
};
FittingFormats fitting_formats(const std::string& path, const ReadRules& rules = {});

/// Returns the only fitting format. Throws Error if none fits, or several, with their names and the flag.
std::string detect_trajectory_format(const std::string& path, const ReadRules& rules = {});

/// Encodes lines t tx ty tz qx qy qz qw with 17 digits. t is taken from `times` if these are given, one per
/// pose. Otherwise t is the time stamp or, without stamps, the frame number or, without these, the row from
/// 0. Without rotations the lines are t x y z.
std::string encode_tum(const PoseSeries& poses, std::span<const double> times = {});

}  // namespace sextant
