#pragma once

// Poses of a topic in a recording, or the path of a frame in its transforms (trajectory_message.h). Records
// are read sequentially, so no index is needed. Memory: one chunk, compressed and decompressed (256 MB each
// at most), and 104 bytes per pose.
//
//   bag      ROS 1, format 2.0 (wiki.ros.org/Bags/Format/2.0), chunks uncompressed, bz2 or lz4; a file that
//            ends within a record is an Error
//   mcap     (mcap.dev/spec), chunks uncompressed, lz4 or zstd, checked by their CRC if present; a file
//            without its end of data is an Error
//   rosbag2  the SQLite file .db3 of a rosbag2 (ROS 2): the tables topics(id, name, type,
//            serialization_format, ..) and messages(id, topic_id, timestamp, data), messages in CDR,
//            optionally compressed one by one with zstd. metadata.yaml is not needed. A file that is
//            truncated or was not closed is an Error; nothing in it is executed or written

#include <string>

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

}  // namespace sextant
