#pragma once

// Noise as a profile, measured from the errors of real flow and depth (`sextant noise fit`, docs/noise.md):
//
//   {"profile": "pwc_net_kitti03", "scale": 1}
//
// stands for the options under "noise" of that profile: those of results/profiles/NAME.json, which come with
// the program, or of a file, where the name ends in .json. `scale` multiplies every size: EPE, delta_d and
// the radius of outliers. Other keys beside them replace the profile's.

#include <string>
#include <vector>

#include "sextant/base/json.h"

namespace sextant {

std::vector<std::string> noise_profile_names();

/// Options without `profile` and `scale`; those without a profile as they are. Throws Error on an unknown
/// name (with the nearest), a file that is no profile, and a scale without a profile or not 0 or more.
Json without_profile(const Json& noise_options);

}  // namespace sextant
