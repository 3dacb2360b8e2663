#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/claims/paper_claims.h"

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
  static const std::vector<Claim> table = [] {
    std::vector<Claim> claims;
    const auto add = [&](const char* name, const auto& check) {
      claims.push_back({paper().statement(name), name, check});
    };
    add("joint_camera", check_joint_camera);
    add("joint_objects", check_joint_objects);
    add("gain_is_selection", check_gain_is_selection);
    add("joint_is_matched", check_joint_is_matched);
    add("epe_falls", check_epe_falls);
    add("depth_noise_low", on_noise_parts(check_depth_noise_low));
    add("depth_noise_gradual", on_noise_parts(check_depth_noise_gradual));
    add("flow_noise_far_objects", on_noise_parts(check_flow_noise_far_objects));
    add("flow_noise_highest", on_noise_parts(check_flow_noise_highest));
    add("independent_noise_is_kind", check_independent_noise_is_kind);
    add("classification", check_classification);
    add("velocity", check_velocity);
    add("ahead_of_orb_slam", check_ahead_of_orb_slam);
    add("within_floor", check_within_floor);
    add("rotation_floor", check_rotation_floor);
    add("frame_rate", check_frame_rate);
    return claims;
  }();
  return table;
}

}  // namespace sextant
