#pragma once

// Tree of frames described by the topics /tf and /tf_static of a recording (tf2), and the path of one frame
// in another:
//
//   T_parent_child(t) = T_ancestor_parent(t)^-1 T_ancestor_child(t)
//
// the product of the transforms from both frames to their nearest common ancestor. The stamps t are those of
// the moving transform nearest to the child. Other moving transforms on the path are interpolated at these
// stamps, linearly in position and by slerp in rotation, as in tf2; stamps outside their range are left out.
// A leading slash of a frame's name is ignored.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/logs/pose_collector.h"

namespace sextant {

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

}  // namespace sextant
