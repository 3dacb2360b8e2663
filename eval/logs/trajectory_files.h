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
//   bag      ROS 1 bag, PATH:/TOPIC (trajectory_recordings.h)
//   mcap     MCAP, PATH:/TOPIC (trajectory_recordings.h)
//   rosbag2  SQLite file of a rosbag2, PATH:/TOPIC (trajectory_recordings.h)
//
// If a header names the columns, it determines the format; another requested format is an Error. Without
// names, a file that fits two formats is an Error too.
//
// Treatment of damaged files (all messages have line numbers):
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
  std::string comments;               ///< comments in the first lines, lower case
  std::string format;                 ///< name in the table
};

struct TrajectoryFormat {
  std::string name;
  std::string description;
  std::function<TrajectoryFile(const std::string& path, const ReadRules& rules)> read;
};

std::span<const TrajectoryFormat> trajectory_formats();

/// Reads a file; `format` is a name of the table; "auto" or empty: detect_trajectory_format(). Throws Error.
TrajectoryFile read_trajectory(const std::string& path, const std::string& format = "auto",
                               const ReadRules& rules = {});

/// Decodes bytes in memory, with "bytes" as the path in messages; also the entry point of the fuzzers.
TrajectoryFile decode_trajectory(std::string_view bytes, const std::string& format,
                                 const std::string& topic = "");

/// The formats that fit the first record and the names of the columns; empty with the reason if none fits.
struct FittingFormats {
  std::vector<std::string> names;
  std::string problem;  ///< reason unless exactly one fits
};
FittingFormats fitting_formats(const std::string& path, const ReadRules& rules = {});

/// Returns the only fitting format. Throws Error if none fits, or several, with their names and the flag.
std::string detect_trajectory_format(const std::string& path, const ReadRules& rules = {});

/// Encodes t tx ty tz qx qy qz qw with 17 digits; without stamps the frame number or row replaces t, without
/// rotations the line is t x y z.
std::string encode_tum(const PoseSeries& poses);

}  // namespace sextant
