#pragma once

// Noise profiles, fitted to the errors of real flow and depth (`sextant noise fit`, docs/noise.md). The
// options
//
//   {"profile": "pwc_net_kitti03", "scale": 1}
//
// stand for the options that the profile stores under "noise". A profile is results/profiles/NAME.json, which
// is compiled into the program, or a file if the name ends in .json. `scale` multiplies every magnitude: EPE,
// delta_d and the radius of outliers; 0 also removes the outliers. Further keys, such as "depth", replace
// those of the profile.

#include <string>
#include <vector>

#include "sextant/base/json.h"

namespace sextant {

std::vector<std::string> noise_profile_names();

/// Replaces `profile` and `scale` by the options that they stand for; options with neither key are returned
/// unchanged. Throws Error for an unknown name (with the nearest known one), for a file that is not a
/// profile, with its name for a value in it that is no option of noise, and for a scale that is not a number
/// >= 0 or has no profile.
Json without_profile(const Json& noise_options);

}  // namespace sextant
