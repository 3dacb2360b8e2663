#pragma once

// Warnings about flow and depth images that differ from the truth: another reading of the estimate or of the
// truth explains the errors by the rule of diagnosis/hypothesis.h. Residuals are means over up to 2000 pixels
// of every image:
//
//   flow    squared length of the error, px^2; the null reading is no flow
//   depth   (ln z - ln z_true)^2; the null reading is one depth everywhere, the geometric mean of the truth
//
// The readings are those of diagnosis/dense_readings.h and: flow that holds target coordinates; an estimate
// that is one factor times the truth (its median over the pixels), or flow with a factor for each of u and v;
// depth that is the distance along the viewing ray. Other warnings: an estimate that is hardly better than
// the null reading, and flow that is exactly (0, 0) in a quarter of the pixels, although the true flow is
// not.

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/measurement/image.h"

namespace sextant {

/// Return true for valid flow, and for a finite depth above 0.
inline bool has_value(const Flow& flow) { return flow.valid(); }
inline bool has_value(float z_m) { return std::isfinite(z_m) && z_m > 0; }

/// An estimate and the truth of one pixel: flow (px), or ln z (m) in x.
struct DensePair {
  Eigen::Vector2d estimate, truth;
  double width = 0, height = 0;  ///< size of the image, px
  Eigen::Vector2d pixel;         ///< coordinates x, y
};
using DensePairs = std::vector<DensePair>;

/// Add up to 2000 pixels of an image that have an estimate and truth.
void add_pairs(const Image<Flow>& estimate, const Image<Flow>& truth, DensePairs& pairs);
void add_pairs(const Image<float>& estimate_m, const Image<float>& truth_m, DensePairs& pairs);

/// Names of the formats in which the images were read, as --est-format and --gt-format take them.
struct DenseFormats {
  std::string_view estimate, truth;
};

/// Append the warnings about the pixels of all images, which must not be empty. `bf` is focal length times
/// baseline (px m); 0: unknown.
void explain_flow(const DensePairs& pairs, const DenseFormats& formats, std::vector<std::string>& warnings);
void explain_depth(const DensePairs& pairs, const DenseFormats& formats, double bf,
                   std::vector<std::string>& warnings);

}  // namespace sextant
