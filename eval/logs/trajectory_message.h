#pragma once

// Poses from the messages of a recording's topics (trajectory_recordings.h).
//
//   geometry_msgs  PoseStamped, PoseWithCovarianceStamped, TransformStamped
//   nav_msgs       Odometry                       (its pose and covariance; the twist is left out)
//   tf2_msgs, tf   TFMessage, tfMessage           PATH:/tf:PARENT.CHILD (trajectory_tf.h); the static
//                                                 transforms are those of the topic of the same name and
//                                                 _static
//
//   foxglove       PoseInFrame                    in JSON, as `sextant export --format mcap` writes it
//
// The messages of ROS are in ROS 1's serialisation or in CDR (ROS 2; either byte order). The stamp is the header's, not the time of
// recording. A topic on which the frame ids change holds the poses of several bodies: an Error, as are two
// poses without a stamp (0). Covariances are those of pose_covariance.h; where a topic has some that are all
// zeros or begin with -1 (unknown), none is used. Limits and repairs as in trajectory_files.h, the message's
// number in the topic (from 1) in place of the line.

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "sextant/eval/logs/pose_collector.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/logs/trajectory_tf.h"

namespace sextant {

/// "FILE:/TOPIC" or "FILE:TOPIC" in its parts; a path that exists as it is has no topic. The slash with which
/// a topic may begin does not count.
struct TopicPath {
  std::string file, topic;
};
TopicPath split_topic(const std::string& path);

enum class MessageEncoding { ros1, cdr };

class TopicPoses {
 public:
  /// `topic` may be empty: the only one with poses; "/tf:PARENT.CHILD": the path of a frame.
  TopicPoses(std::string file, const std::string& topic, const ReadRules& rules);

  /// Tells of a topic; `type` with or without "/msg/", `encoding` as the container calls it. Whether its
  /// messages are to be given to add().
  bool announce(const std::string& topic, const std::string& type, const std::string& encoding);
  /// Throws Error on a message that is damaged.
  void add(const std::string& topic, std::string_view message);
  /// Of the topic asked for, or of the only one. Throws Error that lists the topics where there is none.
  TrajectoryFile finish();

 private:
  struct Topic {
    std::string type;
    std::string encoding;
    bool readable = false;  ///< holds poses
    bool holds_transforms = false;
    PoseSeries poses;
    RepairLog log;
    std::string frame_ids;  ///< of the first message
    size_t n_without_stamp = 0;
    size_t n_messages = 0;  ///< of transforms
    size_t n_unknown_covariances = 0;
    int64_t first_unknown = 0;
  };
  void add_pose(Topic& topic, const std::string& path, std::string_view message);
  void add_transforms(Topic& topic, const std::string& path, std::string_view message, bool is_static);
  TrajectoryFile finish_transforms();
  std::string list(bool readable) const;

  std::optional<CovarianceConvention> covariance_;  ///< empty: as the messages define it
  std::string file_, wanted_,
      frames_;  ///< of "FILE:/tf:PARENT.CHILD"; the topic as its messages have it, or empty
  TransformTree tree_;
  std::map<std::string, Topic> topics_;
};

}  // namespace sextant
