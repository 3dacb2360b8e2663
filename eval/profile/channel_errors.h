#pragma once

// Statistics of the errors of one channel over all frames.
//
//   core         pixels whose error lies within 4 sigma of the offset on every axis; offset and sigma are
//                mean and standard deviation of the core, iterated from the densest quarter
//   tails        the other pixels: their share, and the radius of the disc over which uniform offsets have
//                the same mean length, 1.5 times the mean length
//   correlation  between the core's errors at two pixels, by their distance; intervals: 95 %, bootstrap over
//                frames
//   spatial      the mixture of Gaussians (measurement/problem.h) that fits the mean of the axes best:
//                non-negative least squares over fixed lengths; the rest is independent from pixel to pixel
//   dependence   sigma as 1.4826 MAD, and the share of tails, by |flow|, depth and distance to a mask's
//                border

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
  long n = 0;  ///< number of pixels, every third of rows and columns
  std::vector<double> offset_px, sigma_px, mean_abs_px;  ///< by axis; the last over core and tails
  double mean_px = 0;                                    ///< mean length of the error, over core and tails
  double tail_share = 0, tail_radius_px = 0;
  std::vector<CorrelationBin> correlation;
  SpatialCorrelation spatial;
  std::vector<Dependence> dependence;
};

/// Throws Error if fewer than 1000 pixels have an error, or if all errors are equal.
ChannelErrors channel_errors(const std::vector<ChannelField>& frames, const std::string& channel);

/// Returns the correlation as a function of distance, for errors that are centred and have unit variance.
std::vector<CorrelationBin> measure_correlation(const std::vector<std::vector<Image<float>>>& frames_by_axis);

/// Returns the best fitting mixture, as described above.
SpatialCorrelation fit_correlation(const std::vector<CorrelationBin>& bins);

/// Returns the chessboard distance of every pixel to the nearest pixel of another id, px; NaN above 60 px.
Image<float> border_distance(const Image<uint16_t>& mask);

}  // namespace sextant
