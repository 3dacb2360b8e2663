#pragma once

// Conventions of recorded covariances, with R = R_world_body:
//
//   convention  order               position error in   rotation error
//   ros         position, rotation  world               world   R_true = exp(e) R      PoseWithCovariance
//   openvins    rotation, position  world               body    R_true = R exp(e)
//   gtsam       rotation, position  body                body    T_true = T exp(e)      Pose3's marginals

#include "sextant/base/names.h"

namespace sextant {

enum class CovarianceConvention { ros, openvins, gtsam };
constexpr Names<3> names_of(CovarianceConvention) { return {"ros", "openvins", "gtsam"}; }

}  // namespace sextant
