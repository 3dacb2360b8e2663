#pragma once

// Errors of whole flow and disparity images against the truth, as in the KITTI benchmarks of 2015 (Menze and
// Geiger, Object Scene Flow for Autonomous Vehicles, CVPR 2015):
//
//   EPE         mean of |flow - truth|                                              (px)
//   outlier     a pixel whose error exceeds 3 px and 5 % of the true magnitude
//   Fl, D1      share of outliers, flow and disparity
//   coverage    share of the pixels with truth that have an estimate
//
// Means and outlier shares are taken over the pixels that have both truth and an estimate; the KITTI
// benchmarks also interpolate pixels without an estimate.

#include <span>

#include "sextant/measurement/image.h"

namespace sextant {

struct DenseFlowError {
  double epe_px = 0;         ///< NaN when n == 0, like the next three fields
  double x_px = 0;           ///< mean |u - true u|
  double y_px = 0;           ///< mean |v - true v|
  double outlier_share = 0;  ///< Fl, 0..1
  int n = 0;                 ///< pixels with an estimate and truth
  int n_truth = 0;           ///< pixels with truth
  double coverage = 0;       ///< 0..1; NaN without truth
};

struct DenseDisparityError {
  double mean_px = 0;        ///< mean |d - true d| over all n pixels; NaN when n == 0
  double shift_px = 0;       ///< mean d - true d over the pixels that are no outliers; NaN without any
  double outlier_share = 0;  ///< D1, 0..1; NaN when n == 0
  int n_outliers = 0;
  int n = 0;
  int n_truth = 0;
  double coverage = 0;  ///< 0..1; NaN without truth
};

/// Compares flow images of equal size.
DenseFlowError dense_flow_error(const Image<Flow>& estimate, const Image<Flow>& truth);
/// Compares depth images of equal size (m; not finite or <= 0: no value) as disparities bf / z. An error of
/// exactly 3 px is no outlier, although depths in single precision return it with a rounding error.
DenseDisparityError dense_disparity_error(const Image<float>& depth_m, const Image<float>& true_depth_m,
                                          double bf);

/// Return the errors over the pixels of all images together; for an empty list all counts are 0.
DenseFlowError pooled(std::span<const DenseFlowError> images);
DenseDisparityError pooled(std::span<const DenseDisparityError> images);

// ---- Errors of whole depth images z against the truth z* (m; not finite or <= 0: no value), over the pixels
// that have both:
//
//   mean |z - z*|, RMSE, mean |z - z*| / z*, mean (z - z*) / z*, share of max(z / z*, z* / z) < 1.25
//
// Source: Eigen, Puhrsch, Fergus, Depth map prediction from a single image, NIPS 2014.

struct DepthError {
  double mean_m = 0, rmse_m = 0;  ///< NaN when n == 0, like the next three fields
  double relative = 0, bias = 0;  ///< mean |z - z*| / z*, mean (z - z*) / z*
  double within_125 = 0;          ///< 0..1
  int64_t n = 0, n_truth = 0;
  double coverage = 0;  ///< n / n_truth; NaN without truth
};

/// Compares depth images; truths_m[i] belongs to estimates_m[i] and has the same size.
DepthError depth_error(std::span<const Image<float>> estimates_m, std::span<const Image<float>> truths_m);

}  // namespace sextant
