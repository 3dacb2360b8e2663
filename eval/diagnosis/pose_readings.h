#pragma once

// Readings of recorded poses T_world_object, or T_world_camera, by frame: inverse, in centimetres, in the
// camera frame. Steps between successive frames are compared with the steps of reference poses, because drift
// would hide every mistake in the positions themselves; the residual is that of motion_readings.h. Two kinds
// of poses:
//
//   one body    the same body and origin on both sides, worlds may differ (cameras):  inverse(P_{k-1}) P_k
//   one world   the same world, bodies may have other axes and origins (objects):     P_k inverse(P_{k-1})

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/motion_readings.h"

namespace sextant {

enum class SharedFrame { body, world };

struct PoseData {
  SharedFrame shared = SharedFrame::body;
  std::map<ObjectFrame, SE3> given, reference;  ///< object id and frame k -> pose; the camera has one id
  std::map<int, SE3> T_world_camera;            ///< needed for readings of objects only; may be empty
  std::optional<SE3> T_true_estimated = std::nullopt;  ///< as in MotionData
  bool quaternions = true;  ///< false: the file contains matrices, so no order of quaternions explains them
};

/// Trimmed mean of the squared residuals of the steps that both sides have, m^2; empty for fewer than three.
std::optional<double> pose_residual(const PoseData& data);

/// Residual of the null reading, in which no body moves.
std::optional<double> null_of_poses(const PoseData& data);

/// Returns true for a step of 1 cm or 0.001 rad or more, in which a lost tracker repeats its pose.
bool moves(const SE3& step);

/// Returns true for a motion that is the identity up to the last digits of a file, 1e-6.
bool is_identity(const SE3& motion);

/// Number of steps of the camera, whose id is 0, and the frames in which the given pose equals the one before
/// exactly although the reference moves.
struct RepeatedCameraPoses {
  size_t n_steps = 0;
  std::vector<int> frames;

  /// Formats "repeats its pose exactly in 3 of 10 steps ...", with the first frame and the remedy.
  std::string text() const;
};
RepeatedCameraPoses repeated_camera_poses(const PoseData& data);

/// Every hypothesis about recorded poses:
///   inverse, centimetres .. mirrored_z, lag_-3 .. lag_3   as in motion_hypotheses()
///   scale          one factor on all positions, which is fitted; only for the same body on both sides
///   inverse_steps  the poses are chained from motions of frame k to k-1; on a plane nearly like axes_opengl
///   per_step       the values are motions from frame to frame instead of poses
///   frame_camera   the poses of objects are in the camera frame
///   other_world    the poses of objects are in the world of the estimated camera, as in motion_hypotheses()
///   every_2, every_3, every_5, every_10   every n-th frame was used, and these were numbered 0, 1, 2, ...
std::vector<Hypothesis<PoseData>> pose_hypotheses();

/// Explains wrong poses of all bodies together, or of single bodies, by the rule of hypothesis.h; if there is
/// no explanation, by explain_hidden_shift().
std::vector<ObjectExplanation> explain_poses(const PoseData& data);

/// Detects a common shift of the frame numbers of all bodies by find_frame_shift(), for data for
/// which explain_poses() finds no explanation.
std::optional<Explanation> explain_hidden_shift(const PoseData& data);

}  // namespace sextant
