#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/claims/paper_claims.h"
#include "sextant/eval/report/fetch_lines.h"

namespace sextant {
namespace {

/// A check of sweeps, applied to every part that varies noise.
template <typename Check>
auto on_noise_parts(Check check) {
  return [check](const Evidence& evidence) {
    std::vector<ClaimResult> results;
    for (const EvidencePart* part : evidence.with(PartRole::noise)) {
      for (ClaimResult& result : check(part->sweep)) {
        result.records = part->name;
        results.push_back(std::move(result));
      }
    }
    return results;
  };
}

}  // namespace

std::span<const Claim> claims() {
  static const std::vector<Claim> table = {
      {"joint_camera", "Joint improves camera motion over Motion only by about 300 %", "sec. V-A, tab. III",
       check_joint_camera},
      {"joint_objects", "Joint improves object motion over Motion only by 10-20 %", "sec. V-A, tab. III",
       check_joint_objects},
      {"gain_is_selection", "the gain is the choice of points: on equal points Joint gains nothing",
       "ours, docs/reproduction.md", check_gain_is_selection},
      {"joint_is_matched", "Joint equals Motion only with the matched kernel", "ours, docs/method.md",
       check_joint_is_matched},
      {"epe_falls", "the optical flow error is reduced by the optimisation", "sec. V-A, fig. 5",
       check_epe_falls},
      {"depth_noise_low", "under depth noise E_t < 0.02 m and E_R < 0.04 deg for camera and objects",
       "sec. V-A, fig. 4 left", on_noise_parts(check_depth_noise_low)},
      {"depth_noise_gradual", "E_t grows gradually with the depth error", "sec. V-A, fig. 4 left",
       on_noise_parts(check_depth_noise_gradual)},
      {"flow_noise_far_objects", "objects 2 and 3 are more sensitive to flow noise than camera and object 1",
       "sec. V-A, fig. 4 right", on_noise_parts(check_flow_noise_far_objects)},
      {"flow_noise_highest", "errors of objects 2 and 3 reach nearly 0.09 m and 0.2 deg",
       "sec. V-A, fig. 4 right", on_noise_parts(check_flow_noise_highest)},
      {"independent_noise_is_kind", "independent noise understates the error of camera and objects",
       "ours, docs/noise.md", check_independent_noise_is_kind},
      {"classification", "dynamic and static objects are told apart with the errors of tab. I",
       "sec. IV-C, tab. I", check_classification, fetch_vkitti1_text},
      {"velocity", "velocity errors are 2-5 km/h", "sec. V-B, tab. V", check_velocity, fetch_kitti},
      {"ahead_of_orb_slam", "the camera motion is better than that of ORB-SLAM2 (here: ORB-SLAM3)",
       "sec. V-B, tab. IV", check_ahead_of_orb_slam, fetch_peers},
      {"within_floor", "the difference to ORB-SLAM lies within the ground truth's own floor", "ours, tab. IV",
       check_within_floor, fetch_peers},
      {"rotation_floor", "the published E_R lies at the ground truth's own floor", "ours, tab. IV",
       check_rotation_floor, fetch_peers},
      {"frame_rate", "about 6 frames per second", "sec. V-B", check_frame_rate},
  };
  return table;
}

}  // namespace sextant
