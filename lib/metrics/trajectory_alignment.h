#pragma once

// Moves an estimated path onto the reference before absolute errors are taken.
//
//   none     as it is
//   origin   p <- T p with T = T_ref,0 inverse(T_est,0): the first poses agree
//   se3      p <- R p + t of Umeyama's similarity with s = 1
//   sim3     positions <- s positions, then R, t, of the similarity with scale
//   scale    positions <- s positions alone, s as in sim3
//   yaw      p <- R p + t nearest in the sense of least squares with R a rotation about `up` alone:
//            for systems that know gravity, whose roll and pitch are part of what they claim
//
// se3, sim3, scale and yaw look at the positions of the first `first_n` poses (0: all).
// As evo defines them (yaw: ours).

#include "sextant/base/names.h"
#include "sextant/geometry/pose_series.h"
#include "sextant/geometry/umeyama.h"

namespace sextant {

enum class Alignment { none, origin, se3, sim3, scale, yaw };
constexpr Names<6> names_of(Alignment) { return {"none", "origin", "se3", "sim3", "scale", "yaw"}; }

struct AlignmentResult {
  Similarity ref_from_est;  ///< what was applied: scale first, then rotation and translation
  double flatness = 1;      ///< UmeyamaResult::flatness, where Umeyama was used
};

/// Both of one length, >= 1. `up`: unit vector of both worlds, for yaw alone. Throws Error where the
/// positions determine no rotation.
AlignmentResult align(PoseSeries& estimate, const PoseSeries& reference, Alignment alignment, int first_n = 0,
                      const Eigen::Vector3d& up = Eigen::Vector3d::Zero());

}  // namespace sextant
