#pragma once

// Poses from the messages of a recording's topics (trajectory_readers.h):
//
//   geometry_msgs  PoseStamped, PoseWithCovarianceStamped, TransformStamped
//   nav_msgs       Odometry                       (its pose and covariance; the twist is left out)
//   tf2_msgs, tf   TFMessage, tfMessage           PATH:/tf:PARENT.CHILD (below); static
//                  transforms are taken from the topic of the same name followed by _static
//   foxglove       PoseInFrame  in JSON, as `sextant export --format mcap` writes it
//
// ROS messages are in the serialisation of ROS 1 or in CDR (ROS 2; either byte order). The stamp is that of
// the header, not the time of recording. A topic with changing frame ids contains poses of several bodies,
// which is an Error, as are two poses without a stamp (0). Covariances follow pose_collector.h; if one of a
// topic is unknown (all zeros, or -1 as the first value), none of the topic is used. Limits and repairs are
// those of trajectory_files.h, with the message's number in the topic (from 1) instead of the line.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/logs/pose_collector.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {

// ---- Transforms (trajectory_tf.cc): the tree of frames described by the topics /tf and /tf_static of a
// recording (tf2), and the path of one frame in another:
//
//   T_parent_child(t) = T_ancestor_parent(t)^-1 T_ancestor_child(t)
//
// the product of the transforms from both frames to their nearest common ancestor. The stamps t come from
// the moving transform nearest to the child. Other moving transforms on the path are interpolated at these
// stamps, linearly in position and by slerp in rotation, as in tf2; stamps outside their range are left out.
// A leading slash of a frame's name is ignored.

class TransformTree {
 public:
  /// Adds the transform T_parent_child of message `number` of `path`. Throws Error if the names are empty or
  /// equal, if the child has two parents or is in both static and moving transforms, and on an invalid pose.
  void add(const std::string& parent, const std::string& child, double stamp_s,
           const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position_m, bool is_static,
           const std::string& path, int64_t number);

  /// Returns T_parent_child at the stamps defined above, for `frames` = "parent.child". Throws Error "WHERE:
  /// ..." if the frames do not exist or are not connected, if the transforms form a cycle, and if no
  /// transform between the frames moves or the moving ones have no time in common.
  PoseSeries path(const std::string& frames, const std::string& where, RepairLog& log) const;

  size_t size() const { return n_messages_; }  ///< number of transforms added
  /// Lists the first 20 transforms: "map.odom (40 transforms), base.camera (static), ...".
  std::string list() const;

 private:
  struct Edge {
    std::string parent;
    bool is_static = false;
    PoseSeries poses;  ///< T_parent_child, in the order of messages; for a static transform the last one
  };

  struct Pair {
    std::string parent, child;
  };

  Pair pair_of(const std::string& frames, const std::string& where) const;
  std::vector<std::string> way_up(const std::string& frame, const std::string& where) const;

  std::map<std::string, Edge> edges_;  // by child
  size_t n_messages_ = 0;
  RepairLog log_;
};

// ---- Messages (trajectory_message.cc).

/// Parts of "FILE:/TOPIC" or "FILE:TOPIC"; a path that exists as given has no topic.
struct TopicPath {
  std::string file, topic;
};
TopicPath split_topic(const std::string& path);

class TopicPoses {
 public:
  /// `topic`: the topic to read, with or without its leading slash; empty: the only one with poses;
  /// "/tf:PARENT.CHILD": the poses of the frame CHILD in the frame PARENT.
  TopicPoses(std::string file, const std::string& topic, const ReadRules& rules);

  /// Announces a topic; `type` with or without "/msg/", `encoding` as named by the container. Returns true if
  /// its messages are to be passed to add(). Throws Error if the topic was announced with another type or
  /// encoding.
  bool announce(const std::string& topic, const std::string& type, const std::string& encoding);
  /// Reads a message of an announced topic. Throws Error if it is damaged, or contains an invalid pose.
  void add(const std::string& topic, std::string_view message);
  /// Returns the poses of the requested topic, or of the only one. Throws Error that lists the topics if
  /// there is none, or if several have poses and none is requested.
  TrajectoryFile finish();

 private:
  struct Topic {
    std::string type;
    std::string encoding;
    bool readable = false;  ///< contains poses
    bool holds_transforms = false;
    PoseSeries poses;
    RepairLog log;
    std::string frame_ids;  ///< frame ids of the first message
    size_t n_without_stamp = 0;
    size_t n_messages = 0;  ///< number of messages with transforms
    size_t n_unknown_covariances = 0;
    int64_t first_unknown = 0;
  };
  void add_pose(Topic& topic, const std::string& path, std::string_view message);
  void add_transforms(Topic& topic, const std::string& path, std::string_view message, bool is_static);
  TrajectoryFile finish_transforms();
  std::string list(bool readable) const;

  std::optional<CovarianceConvention> covariance_;  ///< nullopt: as defined by the messages
  /// Parts of "FILE:/tf:PARENT.CHILD"; the topic as spelled in its messages, or empty.
  std::string file_, wanted_, frames_;
  TransformTree tree_;
  std::map<std::string, Topic> topics_;
};

}  // namespace sextant
