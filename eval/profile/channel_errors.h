#pragma once

// Statistics of the errors of one channel over all frames.
//
//   core         pixels whose error lies within 4 sigma of the offset on every axis; offset and sigma are
//                mean and standard deviation of the core, iterated 20 times from the shortest interval that
//                contains a quarter of the errors
//   tails        the other pixels: their share, and the radius of the disc over which uniform offsets have
//                the same mean length, 1.5 times the mean length
//   correlation  between the core's errors at two pixels, by their distance; intervals: 95 %, bootstrap over
//                frames
//   spatial      the mixture of Gaussians (measurement/problem.h) that fits the mean of the axes best:
//                non-negative least squares over fixed lengths, without shares below 0.02; the remaining
//                share is independent from pixel to pixel
//   dependence   sigma as 1.4826 MAD, and the share of tails, by |flow|, depth and distance to a mask's
//                border, for each range of values with at least 200 pixels

#include <optional>
#include <string>
#include <vector>

#include "sextant/measurement/image.h"
#include "sextant/measurement/problem.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// Errors of one frame; all rasters have the same size.
struct ChannelField {
  std::vector<Image<float>> error_px;  ///< by axis; NaN: unknown
  struct Property {
    std::string name;  ///< "flow_px", "depth_m", "border_px"
    Image<float> value;
  };
  std::vector<Property> properties;  ///< quantities on which the errors may depend
};

struct CorrelationBin {
  double low_px = 0, high_px = 0;
  double distance_px = 0;                         ///< root mean square distance of the pairs
  long n = 0;                                     ///< number of pairs
  std::vector<double> value;                      ///< by axis
  std::vector<std::optional<Interval>> interval;  ///< nullopt for fewer than three frames
};

struct Dependence {
  std::string on;
  double low = 0, high = 0;
  long n = 0;
  std::vector<double> sigma_px;
  double tail_share = 0;
};

struct ChannelErrors {
  int n_frames = 0;
  long n = 0;  ///< number of pixels with an error, in every third row and column
  /// by axis; offset and sigma of the core, the mean absolute error over core and tails
  std::vector<double> offset_px, sigma_px, mean_abs_px;
  std::vector<double> robust_sigma_px;  ///< by axis; 1.4826 MAD of the core, which is sigma if it is Gaussian
  double mean_px = 0;                   ///< mean length of the error, over core and tails
  double tail_share = 0, tail_radius_px = 0;
  std::vector<CorrelationBin> correlation;
  SpatialCorrelation spatial;
  std::vector<Dependence> dependence;
};

/// Returns the statistics of all frames. Throws Error, which begins with the name `channel`, if fewer than
/// 1000 of the sampled pixels (every third row and column) have an error, or if a quarter of these errors or
/// more are equal, so that sigma is 0.
ChannelErrors channel_errors(const std::vector<ChannelField>& frames, const std::string& channel);

/// Returns the correlation as a function of distance, from 0.9 to 600 px, for errors that are centred and
/// have unit variance. Bins with fewer than 500 pairs are left out.
std::vector<CorrelationBin> measure_correlation(const std::vector<std::vector<Image<float>>>& frames_by_axis);

/// Returns the best fitting mixture, as described above.
SpatialCorrelation fit_correlation(const std::vector<CorrelationBin>& bins);

/// Returns the chessboard distance of every pixel to the nearest pixel of another id, px; NaN from 60 px on.
Image<float> border_distance(const Image<uint16_t>& mask);

}  // namespace sextant
