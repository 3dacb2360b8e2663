#pragma once

// Moves an estimated path onto the reference before absolute errors are taken.
//
//   none     as it is
//   origin   p <- T p with T = T_ref,0 inverse(T_est,0): the first poses agree
//   se3      p <- R p + t of Umeyama's similarity with s = 1
//   sim3     positions <- s positions, then R, t, of the similarity with scale
//   scale    positions <- s positions alone, s as in sim3
//
// se3, sim3 and scale look at the positions of the first `first_n` poses (0: all). As evo defines them.

#include <string_view>

#include "sextant/geometry/pose_series.h"
#include "sextant/geometry/umeyama.h"

namespace sextant {

enum class Alignment { none, origin, se3, sim3, scale };
std::string_view to_string(Alignment alignment);
/// Throws Error on an unknown name.
Alignment alignment_from_string(std::string_view name);

struct AlignmentResult {
  Similarity ref_from_est;  ///< what was applied: scale first, then rotation and translation
  double flatness = 1;      ///< UmeyamaResult::flatness, where Umeyama was used
};

/// Both of one length, >= 1. Throws Error where the positions determine no rotation.
AlignmentResult align(PoseSeries& estimate, const PoseSeries& reference, Alignment alignment,
                      int first_n = 0);

}  // namespace sextant
