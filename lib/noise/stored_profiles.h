#pragma once

// Noise profiles, fitted to the errors of real flow and depth (`sextant noise fit`, docs/noise.md). The
// options
//
//   {"profile": "pwc_net_kitti03", "scale": 1}
//
// stand for the options under "noise" of that profile: of results/profiles/NAME.json, which is compiled into
// the program, or of a file if the name ends in .json. `scale` multiplies every magnitude: EPE, delta_d and
// the radius of outliers. Further keys override those of the profile.

#include <string>
#include <vector>

#include "sextant/base/json.h"

namespace sextant {

std::vector<std::string> noise_profile_names();

/// Replaces `profile` and `scale` by the options that they stand for; options without a profile are returned
/// unchanged. Throws Error for an unknown name (with the nearest), for a file that is not a profile, for a
/// scale without a profile and for a negative scale.
Json without_profile(const Json& noise_options);

}  // namespace sextant
