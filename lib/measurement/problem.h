#pragma once

// Correlation between the errors at two pixels of one frame and channel, as a function of their distance r
// (px):
//
//   rho(r) = sum_k share_k exp(-r^2 / (2 length_k^2)),   rho(0) = 1
//
// The rest, 1 - sum_k share_k, of the variance is independent from pixel to pixel. A mixture of Gaussians
// with shares >= 0 is positive definite in the plane for any set of pixels.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/geometry/camera.h"

namespace sextant {

struct SpatialCorrelation {
  struct Part {
    double length_px = 0;
    double share = 0;  ///< share of the variance
    bool operator==(const Part&) const = default;
  };
  std::vector<Part> parts;  ///< empty: all errors are independent

  double independent_share() const {
    double rest = 1;
    for (const Part& part : parts) rest -= part.share;
    return rest > 1e-12 ? rest : 0;  // a smaller rest is rounding error of the shares
  }
  double at(double distance_px) const {
    double rho = distance_px == 0 ? independent_share() : 0;
    for (const Part& part : parts) {
      const double r = distance_px / part.length_px;
      rho += part.share * std::exp(-0.5 * r * r);
    }
    return rho;
  }
  bool operator==(const SpatialCorrelation&) const = default;
};

// Declared noise of one body's measurements, as in the data sheet of a sensor: standard deviations, never the
// errors themselves. A standard deviation of 0 means that no noise is declared for the channel.
//
//   flow    N(0, diag(flow_x_px^2, flow_y_px^2))
//   depth   of both frames: N(0, sigma^2), sigma(z) = z^2 * inverse_depth_per_m; a disparity accuracy of
//           delta_d (px) corresponds to inverse_depth_per_m = delta_d / (f b)

struct MeasurementNoise {
  double flow_x_px = 0;
  double flow_y_px = 0;
  double inverse_depth_per_m = 0;  ///< 1/m
  double flow_outlier_share = 0;   ///< 0..1, share of flows with errors far beyond the deviations above
  SpatialCorrelation correlation;  ///< correlation of each channel's errors between points
  /// True if the errors are Gaussian and independent between points, i.e. without outliers, rounding, and
  /// errors that several points share or that are correlated over the image.
  bool independent_gaussian = true;
  bool gaussian = true;  ///< true if there are neither outliers nor rounding; errors may be correlated

  double depth_sigma_m(double depth_m) const { return depth_m * depth_m * inverse_depth_per_m; }
  bool operator==(const MeasurementNoise&) const = default;
};

// Point measurements between two frames as a structure of arrays. All arrays have the same length, except
// that before_noise may be empty.
//
//   pixel p = (u, v) in the previous image, depth there, flow phi = (flow_u, flow_v): the pixel in the
//   current image is p + phi. depth_curr is the depth measured at the pixel nearest to p + phi; NaN = none
//   (docs/method.md, "Frames, transforms and units").

struct Correspondences {
  std::vector<double> u;           ///< px
  std::vector<double> v;           ///< px
  std::vector<double> depth;       ///< m, previous frame
  std::vector<double> flow_u;      ///< px
  std::vector<double> flow_v;      ///< px
  std::vector<double> depth_curr;  ///< m, current frame; NaN = none
  /// Index of each point in the list to which noise was added, which also contains the points that the noise
  /// removed; empty if no noise was added.
  std::vector<size_t> before_noise;

  size_t size() const { return u.size(); }
  bool empty() const { return u.empty(); }
  /// Returns true if pixel and flow of point i, and their sum, are finite.
  bool has_pixels(size_t i) const { return std::isfinite(u[i] + v[i] + flow_u[i] + flow_v[i]); }
  /// Returns true if has_pixels(i), and the depth of point i in the previous frame and its inverse are
  /// positive and finite.
  bool is_measurement(size_t i) const {
    return has_pixels(i) && depth[i] >= std::numeric_limits<double>::min() && depth[i] < INFINITY;
  }
  void reserve(size_t n) {
    for (std::vector<double>* array : {&u, &v, &depth, &flow_u, &flow_v, &depth_curr}) array->reserve(n);
  }
  void push_back(double u_px, double v_px, double depth_m, double flow_u_px, double flow_v_px,
                 double depth_curr_m = NAN) {
    u.push_back(u_px);
    v.push_back(v_px);
    depth.push_back(depth_m);
    flow_u.push_back(flow_u_px);
    flow_v.push_back(flow_v_px);
    depth_curr.push_back(depth_curr_m);
  }
  /// Returns the points whose entry in `keep` is not 0; throws InternalError unless `keep` has one entry per
  /// point.
  Correspondences subset(const std::vector<unsigned char>& keep) const {
    SEXTANT_CHECK(keep.size() == size());
    std::vector<size_t> kept;
    kept.reserve(size());
    for (size_t i = 0; i < size(); ++i) {
      if (keep[i]) kept.push_back(i);
    }
    Correspondences out;
    const auto take = [&](auto column) {
      const auto& from = this->*column;
      auto& to = out.*column;
      if (from.empty()) return;
      to.resize(kept.size());
      for (size_t k = 0; k < kept.size(); ++k) to[k] = from[kept[k]];
    };
    using C = Correspondences;
    for (const auto column : {&C::u, &C::v, &C::depth, &C::flow_u, &C::flow_v, &C::depth_curr}) take(column);
    take(&C::before_noise);
    return out;
  }
};

// Measurements of one rigid body between two frames: the complete input of an estimator. Body 0 (the static
// background) and the objects share this type.

struct Problem {
  StereoCamera camera;
  Correspondences points;
  std::optional<MeasurementNoise> noise;  ///< as declared by the source; nullopt: unknown
};

// Measurements of one frame pair reduced to points: the input of the pipeline once the images are released.

/// One instance of the current frame's mask, with the sampled points of the previous frame whose flow ends on
/// this instance.
struct ObjectObservation {
  int instance = 0;                     ///< id in the current mask
  double area_fraction = 0;             ///< share of the current image that the instance covers, 0..1
  Correspondences points;               ///< points that belong to an instance of the previous mask
  std::vector<uint16_t> instance_prev;  ///< per point: id of the instance in the previous mask, never 0
  int n_background = 0;  ///< number of samples of the previous background that land there; not in `points`
};

struct FramePair {
  int prev = 0;  ///< frame number k-1
  int curr = 0;  ///< frame number k
  double dt_s = 0;
  int width = 0;
  int height = 0;
  StereoCamera camera;
  Correspondences background;              ///< static features
  std::vector<ObjectObservation> objects;  ///< in order of `instance`
  std::vector<int> lost_instances;         ///< ids of the previous mask that are not in the current one
  /// Declared noise by body: id in the previous mask, 0 = background. Empty: unknown.
  std::map<int, MeasurementNoise> noise;

  std::optional<MeasurementNoise> noise_of(int body) const {
    const auto declared = noise.find(body);
    return declared == noise.end() ? std::nullopt : std::optional(declared->second);
  }
};

}  // namespace sextant
