#pragma once

// What an estimate's own covariance says about its errors: the bands of a timeline and the ellipses of a top
// view. To first order, for an unbiased Gaussian estimate X = exp(e) Xhat with covariance C of e (left twist):
//
//   E_t, E_R   length of the two halves of the error's twist: e for the camera, -Ad(X^-1) e for an object
//              (metrics/crlb.h). The length of a Gaussian vector is taken as a scaled chi variable of the same mean
//              square and variance (Satterthwaite 1946)
//   E_v        n^T (H c - c) / dt along n, the direction of H c - c, from the covariances of both motions
//   position   steps are independent: covariances in the world add up

#include <map>
#include <string>

#include "sextant/estimator/pipeline.h"

namespace sextant {

/// 19 of 20 errors are smaller. NaN where there is no covariance.
struct ErrorBand {
  double Et_m;
  double ER_deg;
  double Ev_kmh;  ///< objects only
};

inline constexpr double band_probability = 0.95;

/// The q with P(|x| <= q) = p for x ~ N(0, covariance).
double length_quantile(const Eigen::Matrix3d& covariance, double p);

/// Of a body whose status is ok.
ErrorBand error_band(const BodyResult& body, const FrameResult& frame);

/// Covariance of a position in the world seen from above (m^2): x to the right, z ahead in the first camera.
struct TopViewCovariance {
  double xx = 0, xz = 0, zz = 0;
};

/// Adds up along a run. The camera's begins at its first pose; an object's where a stretch of estimates begins.
class PositionCovariances {
 public:
  /// T_world_camera and the objects' positions after the pair, as estimated; frames in order. What has no
  /// covariance in the result is left out.
  std::map<std::string, TopViewCovariance> add(const FrameResult& frame, const SE3& T_world_curr,
                                               const std::map<int, Eigen::Vector3d>& objects_m);

 private:
  Matrix6d camera_ = Matrix6d::Zero();
  struct Object {
    int last = 0;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  std::map<int, Object> objects_;
};

}  // namespace sextant
