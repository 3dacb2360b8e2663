#pragma once

// Readers of trajectory files that are not lines of numbers: recordings, and the log of VDO-SLAM's front end.
//
// Recordings (trajectory_recordings.cc): poses of a topic in a recording, or the path of a frame in its
// transforms (trajectory_message.h). Records are read sequentially, so no index is needed. Memory: one chunk,
// compressed and decompressed (256 MB each at most), and 104 bytes per pose.
//
//   bag      ROS 1, format 2.0 (wiki.ros.org/Bags/Format/2.0), chunks uncompressed, bz2 or lz4; a file that
//            ends within a record, or before the place of its index, is an Error; one that was not closed
//            (the place of the index is 0) has a warning
//   mcap     (mcap.dev/spec), chunks uncompressed, lz4 or zstd, checked by their CRC if present; a file
//            without its end of data is an Error
//   rosbag2  the SQLite file .db3 of a rosbag2 (ROS 2): the tables topics(id, name, type,
//            serialization_format, ..) and messages(id, topic_id, timestamp, data), messages in CDR,
//            optionally compressed one by one with zstd. metadata.yaml is not needed. A file that is
//            truncated or was not closed is an Error; nothing in it is executed or written

#include <string>

#include "sextant/eval/logs/pose_collector.h"
#include "sextant/eval/logs/trajectory_bytes.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {

bool is_bag(std::string_view first_bytes);
bool is_mcap(std::string_view first_bytes);
bool is_rosbag2(std::string_view first_bytes);

/// Read the poses of `topic`, which may be empty if only one topic has poses. Throw Error that names the
/// file, and lists the topics if there is no such topic.
TrajectoryFile read_bag(ByteSource& bytes, const std::string& topic, const ReadRules& rules = {});
TrajectoryFile read_mcap(ByteSource& bytes, const std::string& topic, const ReadRules& rules = {});
TrajectoryFile read_rosbag2(ByteSource& bytes, const std::string& topic, const ReadRules& rules = {});

// ---- The log of VDO-SLAM's front end (vdo_xml.cc): its frames in boost serialisation as XML,
//
//   <item><pose><R_><rot11>..<rot33></R_><t_><data><item>x</item>..</data></t_></pose><gt_pose>...</gt_pose>
//         <timestamp>s</timestamp><frame_id>n</frame_id> ...</item>
//
// `pose` and `gt_pose` are T_world_camera (m). The time stamps are ignored, because they have steps of 0.05 s
// where KITTI has 0.1 s; poses have frame numbers instead.

/// Appends the estimated and the true pose of every frame to `estimate` and `truth`. Throws Error "PATH:LINE:
/// ..." on any other content.
void read_vdo_frontend_xml(const std::string& path, const FileKind& kind, PoseSeries& estimate,
                           PoseSeries& truth, RepairLog& log);

}  // namespace sextant
