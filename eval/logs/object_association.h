#pragma once

// The truth of a data set for the objects of a log, whose ids may be its own.

#include <map>
#include <string>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// Returns T_world_object of the objects that are not declared static, in the frames with a camera pose.
std::map<ObjectFrame, SE3> true_object_poses(const SequenceTruth& truth);

/// take_truth() gives a logged object without a partner its own id plus this, so that it differs from all
/// true ids.
inline constexpr int unmatched_object = 1'000'000'000;
/// Formats the id of an object for readers: "3", or "3 of the log" without a partner.
std::string object_text(int id);

/// Replaces the log's truth by that of a data set. The log's world may differ: it is moved so that both agree
/// in their first common camera pose. Ids may differ as well: pairs of a logged and a true object are formed
/// in descending order of their agreement, summed over their common steps, and each object is used once. The
/// agreement of a step decreases from 1 to 0 over 3 m between the positions in the camera frame or, if the
/// log has no pose there, over 0.5 m between the motions in the body frame. A pair must agree (agreement
/// above 0) in at least 3 steps, or in as many as the longest logged object has, in more steps than those in
/// which the positions are too far apart, and at least half as well as the best pair of the same logged
/// object. Logged objects without a partner get no truth. A warning says so; if another logged object has
/// taken their true one, it names the change of identity or the object that is logged twice.
void take_truth(ObjectLog& log, const SequenceTruth& truth);

}  // namespace sextant
