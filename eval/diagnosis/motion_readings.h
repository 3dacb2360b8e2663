#pragma once

// Readings of logged rigid motions of objects: in another frame, inverse, in centimetres and so on.
//
// A motion from frame k-1 to k is written in one of three frames (geometry/object_motion.h), with L =
// T_world_object at k-1 and C = T_world_camera:
//
//   world    H                            p_k = H p_{k-1} of the object's points in the world
//   body     inverse(L) H L
//   camera   inverse(C_k) H C_{k-1}       p_k = X p_{k-1} in camera coordinates
//
// A reading is compared with reference motions: the truth, or the steps of a path of poses, with which the
// motions of a log must agree as well. The residual of one motion is the mean squared distance between the
// places to which the motion and the reference move the points of the object, whose RMS distance r from the
// axis of rotation is rms_radius_m:
//
//   e^2 = |t|^2 + (2 r sin(theta / 2))^2        [R(theta) t] = inverse(M) M_reference, in the body frame
//
// The residual of an object is the trimmed mean of e^2 over its steps; the largest fifth is left out, because
// outliers do not depend on conventions. The rule of hypothesis.h applies to each object and to all together;
// in the null reading no object moves.

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <ranges>
#include <set>
#include <utility>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/eval/diagnosis/frame_shift.h"
#include "sextant/geometry/se3.h"

namespace sextant {

/// Objects with fewer steps have no residual.
inline constexpr size_t fewest_steps = 3;

enum class MotionFrame { world, body, camera };
constexpr Names<3> names_of(MotionFrame) { return {"world", "body", "camera"}; }

/// Object id and frame k (the current one of a motion).
using ObjectFrame = std::pair<int, int>;
/// Returns the same object in the frame before.
inline ObjectFrame previous(ObjectFrame key) { return {key.first, key.second - 1}; }

/// Returns the ids of the objects of a map with keys ObjectFrame.
std::set<int> ids_of(const auto& by_object_frame) {
  std::set<int> ids;
  for (const auto& [key, value] : by_object_frame) ids.insert(key.first);
  return ids;
}

/// The entries of one object in a map with keys ObjectFrame, in order of frames. (clang 14 cannot compile
/// std::ranges::subrange of libstdc++ 12.)
template <typename Map>
struct EntriesOfObject {
  typename Map::const_iterator first, last;

  auto begin() const { return first; }
  auto end() const { return last; }
};

template <typename Map>
EntriesOfObject<Map> entries_of(const Map& by_object_frame, int id) {
  return {by_object_frame.lower_bound({id, 0}),
          by_object_frame.upper_bound({id, std::numeric_limits<int>::max()})};
}

/// Returns the pose or motion of an object in a frame; nullopt if it is not known.
inline std::optional<SE3> find_pose(const std::map<ObjectFrame, SE3>& poses, ObjectFrame key) {
  const auto it = poses.find(key);
  return it == poses.end() ? std::nullopt : std::optional(it->second);
}

/// Returns the motion in the world from the pose in the frame before to the pose of this frame, P_k
/// inverse(P_{k-1}); nullopt if either is not known.
inline std::optional<SE3> world_step(const std::map<ObjectFrame, SE3>& poses, ObjectFrame key) {
  const auto before = find_pose(poses, previous(key)), after = find_pose(poses, key);
  return before && after ? std::optional(*after * before->inverse()) : std::nullopt;
}

/// RMS distance of an object's points from the axis of a rotation, m; it weighs rotations against
/// translations.
inline constexpr double rms_radius_m = 1;

/// Returns the factor that takes the place of explains_times for a residual over n steps. It is larger for
/// few steps, which may agree by chance: 4.3 times as large for three steps, twice for ten.
double explains_times_of(size_t n_steps);

/// Squared residual of a step between poses or of a motion in the body frame, m^2.
double squared_residual(const SE3& given, const SE3& reference);

/// Mean of the smallest four fifths of the values, of `fewest` values at least; empty if there are fewer.
std::optional<double> trimmed_mean(std::vector<double> values, size_t fewest);

/// Motion and poses that are known at one step, in one world.
struct MotionSample {
  ObjectFrame key;
  SE3 given;                                      ///< as logged, in the declared frame
  SE3 reference;                                  ///< in the declared frame
  std::optional<SE3> T_world_object;              ///< at k-1
  std::optional<SE3> T_world_prev, T_world_curr;  ///< T_world_camera at k-1 and k
};

struct MotionData {
  MotionFrame declared = MotionFrame::world;
  std::vector<MotionSample> samples;  ///< motions that have a reference
  std::map<ObjectFrame, SE3> logged;  ///< all motions of the log, for readings that need neighbours
  /// References of steps for which nothing is logged, for readings with other ids; `given` is not used
  std::vector<MotionSample> not_logged = {};
  /// T_world_world' from the world of the estimated camera to that of the true camera, which makes their
  /// poses equal in the first frame that both have; empty if they agree or either is not known
  std::optional<SE3> T_true_estimated = std::nullopt;
  bool quaternions = true;  ///< as PoseData::quaternions
};

/// Converts `motion` from the frame `from` to the frame `to`; empty if a pose that this needs is not known.
std::optional<SE3> change_frame(const SE3& motion, MotionFrame from, MotionFrame to, const MotionSample& at);

/// Converts `motion` from the frame `declared` to the body frame. Without the object's pose it is taken about
/// the camera, which is nearer to the object than the origin of the world.
SE3 in_body_frame(const SE3& motion, MotionFrame declared, const MotionSample& sample);

/// Returns a sample with the camera poses of each step, by its frame k.
std::map<int, MotionSample> cameras_of(const std::vector<MotionSample>& samples);

/// Residual over all samples of `data`, m^2; empty for fewer than three.
std::optional<double> motion_residual(const MotionData& data);

/// Residual of the null reading, in which the given motions are the identity.
std::optional<double> null_of_motions(MotionData data);
/// Residual of the given motions, as declared, against objects that stand still in the world; empty if a pose
/// that this needs is not known.
std::optional<double> stillness_residual(MotionData data);

/// Returns false for a reading in another frame unless its residual is smaller, by the factor `times`, than
/// `still`, the stillness_residual() of the declared motions: in another frame, an object that stands still
/// looks like one that follows the camera. If `still` is not known, every reading is plausible.
bool is_plausible(const Reading& reading, std::optional<double> still, double times);

/// Every hypothesis about logged motions, for motions declared in `declared`:
///
///   frame_world, frame_body, frame_camera, frame_camera_axes   another frame than the declared one
///   inverse            from frame k to k-1
///   inverse_frame_world, inverse_frame_body, inverse_frame_camera   from k to k-1, and in another frame
///   centimetres .. mirrored_z     all readings of number_readings.h
///   absolute           poses, or motions since the first frame, in place of motions from frame to frame
///   displacement       the translation is the displacement of the object's origin, in the world
///   other_world        in the world of the estimated camera, which is not that of the true one
///   per_second, velocity   the motion, or its translation alone, per second instead of per frame
///   two_frames         motions from frame k-2 to k, at a constant velocity
///   lag_-3 .. lag_3    the motion of frame k is logged at frame k + lag
///   camera_lag_-3 .. camera_lag_3   the same of the motion in camera coordinates, T_curr_prev, for logs that
///                      were converted to the world
std::vector<Hypothesis<MotionData>> motion_hypotheses(MotionFrame declared);

/// Returns the hypothesis that a log numbers the objects differently from its truth: exchanged ids, or ids
/// off by one (code `ids`); nullopt if it does not. explain_motions() tries it besides motion_hypotheses().
///
/// With r(a, t) the residual (motion_readings.h) of the motions logged for the id a against the reference of
/// the object t, over the steps that both have, the motions of a are taken for those of t if
///
///   n r(a, t) < r(a, a),    n r(a, t) < r(t, t),    n r(a, t) < the residual of an object that stands still
///
/// with n twice the factor of explains_times_of(). The second condition leaves out a logged object that
/// resembles another one which is logged correctly, the third one resting objects, which are all alike.
std::optional<Hypothesis<MotionData>> exchanged_ids_hypothesis(const MotionData& data);

/// Finds readings that explain the motions of all objects, or of single ones, better than the declared
/// reading. If there is none, transposed rotations are searched by the rotations alone, then
/// explain_hidden_shift().
std::vector<ObjectExplanation> explain_motions(const MotionData& data);

/// Detects a common shift of the frame numbers of all objects by find_frame_shift(), for data for
/// which explain_motions() finds no explanation.
std::optional<Explanation> explain_hidden_shift(const MotionData& data);

/// Explains the rotations of the motions alone, without a reference: motions between successive frames turn
/// an object by far less than 90 degrees, whereas quaternions in another order turn it by about 180.
std::optional<Explanation> explain_rotations(const std::map<ObjectFrame, SE3>& motions);

/// Returns the bodies that seem to drive backwards: in their body frame the motions point against one of
/// the axes `forward` within 30 degrees, in all but a twentieth of at least ten steps of 0.1 m or more. Empty
/// if a body with ten such steps does not seem to do so.
std::vector<int> bodies_that_reverse(const std::map<ObjectFrame, SE3>& body_motions,
                                     const std::vector<Eigen::Vector3d>& forward);

// ---- Poses T_world_object of the objects of a log that contains motions only (object_pose_fit.cc),
// estimated from two descriptions of the same motions. For each stretch of eight or more successive steps of
// one object, the first pose L_0 minimises in least squares the error of
//
//   H_k L_{k-1} = L_{k-1} B_k
//
// with H_k the motion in the world and B_k that in the body frame. The reference motions then give the other
// poses of the stretch. Samples of shorter stretches get no pose.

/// Function that returns the motion of a sample in the world frame; empty if a pose that this needs is not
/// known.
using WorldMotion = std::function<std::optional<SE3>(const MotionSample&)>;

/// Fits the poses with B_k the reference and H_k = in_world(), so that L_k = L_{k-1} B_k.
void fit_poses_to_body_reference(MotionData& data, const WorldMotion& in_world);
/// Fits the poses with H_k the reference and B_k the given motion, so that L_k = H_k L_{k-1}.
void fit_poses_to_world_reference(MotionData& data);

}  // namespace sextant
