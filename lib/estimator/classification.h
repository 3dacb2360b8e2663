#pragma once

// Dynamic or static, from scene flow (paper eq. (12)):  f = m_prev - T_prev_curr * m_curr  per point, with
// m_curr from the current depth at p + phi. An object is dynamic when more than `min_moving_share` of its
// points move faster than `min_speed_mps`.
//
// The vertical component is left out by default, as in the published code: cars move on the ground plane,
// and the vertical scene flow adds depth noise only.

#include "sextant/base/options.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"

namespace sextant {

struct ClassificationOptions {
  double min_speed_mps = 1.2;
  double min_moving_share = 0.7;
  bool use_vertical = false;

  void visit(auto& v) {
    v("min_speed_mps", min_speed_mps, "m/s", "scene flow of a moving point (0.12 m per frame at 10 Hz)");
    v("min_moving_share", min_moving_share, "fraction", "a dynamic object has more moving points than this");
    v("use_vertical", use_vertical, "", "use the vertical scene flow too");
  }
  void check() const;
};

struct MotionClass {
  double moving_share = 0;  ///< NaN when no point has both depths
  int n_points = 0;         ///< points with both depths
  bool is_dynamic = false;  ///< true when moving_share is unknown: nothing says that it stands still
};

MotionClass classify_motion(const Problem& object, const SE3& T_curr_prev_background, double dt_s,
                            const ClassificationOptions& options);

}  // namespace sextant
