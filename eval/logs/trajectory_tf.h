#pragma once

// The tree of frames that the topics /tf and /tf_static of a recording describe (tf2), and the path of one
// frame in another:
//
//   T_parent_child(t) = T_ancestor_parent(t)^-1 T_ancestor_child(t)
//
// the product of the transforms from each of both up to their nearest common ancestor. The stamps t are those
// of the moving transform nearest to the child. Other moving transforms on the way are interpolated at these,
// linearly in position and by slerp in rotation, as tf2 does; stamps before their first or after their last
// message are left out. A leading slash of a frame's name does not count.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/logs/pose_collector.h"

namespace sextant {

class TransformTree {
 public:
  /// A transform T_parent_child as message `number` of `path` gives it. Throws Error on names that are
  /// empty or equal, on a child with two parents, on one that is static and not, and on what is no pose.
  void add(const std::string& parent, const std::string& child, double stamp_s,
           const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position_m, bool is_static,
           const std::string& path, int64_t number);

  /// T_parent_child at its stamps for `frames` = "parent.child". Throws Error, which `where` begins, on
  /// frames that are not there or not connected, on cycles, and where no transform between them moves.
  PoseSeries path(const std::string& frames, const std::string& where, RepairLog& log) const;

  size_t size() const { return n_messages_; }  ///< transforms added
  /// "map.odom (40 transforms), base.camera (static), ..."
  std::string list() const;

 private:
  struct Edge {
    std::string parent;
    bool is_static = false;
    PoseSeries poses;  ///< T_parent_child, in the order of messages; of a static one the last
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
