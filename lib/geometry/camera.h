#pragma once

// Rectified pinhole and stereo cameras: x right, y down, z forward; pixel centres at integers.
//
//   project:      u = fx x/z + cx,  v = fy y/z + cy                    (px; defined for z > 0)
//   backproject:  p = z * ray(u, v),  ray = [(u-cx)/fx, (v-cy)/fy, 1]  (m; z is the depth, not the range)
//   stereo:       disparity = bf / z,  bf = focal length * baseline    (px m)
//   depth noise:  sigma(z) = z^2 / bf * delta_d                        (m; delta_d = disparity accuracy, px)

#include <Eigen/Core>

namespace sextant {

struct PinholeCamera {
  double fx = 0;  ///< px
  double fy = 0;  ///< px
  double cx = 0;  ///< px
  double cy = 0;  ///< px

  Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
  }
  /// Jacobian d project / d p, 2x3 (px per m).
  Eigen::Matrix<double, 2, 3> project_jacobian(const Eigen::Vector3d& p) const {
    const double iz = 1.0 / p.z();
    Eigen::Matrix<double, 2, 3> j;
    j << fx * iz, 0, -fx * p.x() * iz * iz, 0, fy * iz, -fy * p.y() * iz * iz;
    return j;
  }

  Eigen::Vector3d ray(double u, double v) const { return {(u - cx) / fx, (v - cy) / fy, 1.0}; }
  Eigen::Vector3d backproject(double u, double v, double z) const { return z * ray(u, v); }

  /// Throws Error unless fx and fy lie in [1e-6, 1e9] px and cx and cy in [-1e9, 1e9] px.
  void check() const;
};

struct StereoCamera {
  PinholeCamera left;
  double bf = 0;  ///< focal length times baseline, px m

  double depth_m(double disparity_px) const { return bf / disparity_px; }
  double disparity_px(double z_m) const { return bf / z_m; }
  double depth_sigma_m(double z_m, double delta_d_px) const { return z_m * z_m / bf * delta_d_px; }

  /// Checks `left`; throws Error also unless bf lies in [1e-6, 1e9] px m.
  void check() const;
};

}  // namespace sextant
