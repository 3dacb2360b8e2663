#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/claims/noise_claims.h"

namespace sextant {

std::span<const Claim> claims() {
  static const std::vector<Claim> table = {
      {"depth_noise_low", "under depth noise E_t < 0.02 m and E_R < 0.04 deg for camera and objects",
       "sec. V-A, fig. 4 left", check_depth_noise_low},
      {"depth_noise_gradual", "E_t grows gradually with the depth error", "sec. V-A, fig. 4 left",
       check_depth_noise_gradual},
      {"flow_noise_far_objects", "objects 2 and 3 are more sensitive to flow noise than camera and object 1",
       "sec. V-A, fig. 4 right", check_flow_noise_far_objects},
      {"flow_noise_highest", "errors of objects 2 and 3 reach nearly 0.09 m and 0.2 deg",
       "sec. V-A, fig. 4 right", check_flow_noise_highest},
  };
  return table;
}

}  // namespace sextant
