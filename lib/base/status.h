#pragma once

// Outcome of one body in one frame pair. Every object in the ground truth or in the detections gets a status;
// none is silently skipped.

#include "sextant/base/names.h"

namespace sextant {

enum class Status {
  ok,              ///< estimated
  no_truth,        ///< estimated, but there is no ground truth to compare with
  not_detected,    ///< ground truth exists, no mask does
  lost,            ///< nothing connects the two frames, e.g. a mask in only one of them
  diverged,        ///< the solver did not reach a finite optimum
  too_few_points,  ///< fewer points (or inliers) than the options require
  gated,           ///< left out on purpose: too far, too small, or static (see Gate)
  collinear,       ///< all points on a line: the rotation about it is unobservable
  at_infinity,     ///< all points too far away to observe a translation
  no_parallax,     ///< some other component of the motion is unobservable
};

constexpr Names<10> names_of(Status) {
  return {"ok",    "no_truth",  "not_detected", "lost",       "diverged", "too_few_points",
          "gated", "collinear", "at_infinity",  "no_parallax"};
}

/// Reason for which an object is `gated`; `none` for other objects.
enum class Gate { none, distance, area, is_static };

constexpr Names<4> names_of(Gate) { return {"none", "distance", "area", "static"}; }

}  // namespace sextant
