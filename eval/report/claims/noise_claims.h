#pragma once

// What the paper says of its fig. 4. Its bodies are the camera and the three nearest objects of a sequence;
// objects are told by their mean true distance. Intervals: bootstrap over seeds.
//
//   depth_noise_low         the largest mean error over the levels, once for delta_d <= 0.2 px (an industrial
//                           stereo camera, in the paper's words) and once for all levels of the sweep
//   depth_noise_gradual     slope of E_t > 0
//   flow_noise_far_objects  the smaller slope of objects 2 and 3 minus the larger one of camera and object 1 > 0
//   flow_noise_highest      the larger mean error of objects 2 and 3 at the highest level. "Nearly" is read as
//                           within 25 % of the stated value

#include <vector>

#include "sextant/eval/report/claims/claim.h"

namespace sextant {

std::vector<ClaimResult> check_depth_noise_low(const NoiseSweep& sweep);
std::vector<ClaimResult> check_depth_noise_gradual(const NoiseSweep& sweep);
std::vector<ClaimResult> check_flow_noise_far_objects(const NoiseSweep& sweep);
std::vector<ClaimResult> check_flow_noise_highest(const NoiseSweep& sweep);

}  // namespace sextant
