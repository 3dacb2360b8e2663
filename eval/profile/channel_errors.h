#pragma once

// What the errors of one channel look like, over all frames.
//
//   core         pixels whose error lies within 4 sigma of the offset on every axis; offset and sigma are
//                mean and
//                standard deviation of the core, iterated from the densest quarter
//   tails        the others: their share, and the radius of the disc over which uniform offsets are as long
//                on
//                average, 1.5 mean length
//   correlation  of the core's errors at two pixels, by their distance; intervals: 95 %, bootstrap over
//                frames
//   spatial      the mixture of Gaussians (measurement/problem.h) that fits the mean of the axes
//                best:
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

/// Of one frame; every raster has the same size.
struct ChannelField {
  std::vector<Image<float>> error_px;  ///< by axis; NaN: none
  struct Property {
    std::string name;  ///< "flow_px", "depth_m", "border_px"
    Image<float> value;
  };
  std::vector<Property> properties;  ///< what the errors may depend on
};

struct CorrelationBin {
  double low_px = 0, high_px = 0;
  double distance_px = 0;                         ///< root mean square of the pairs'
  long n = 0;                                     ///< pairs
  std::vector<double> value;                      ///< by axis
  std::vector<std::optional<Interval>> interval;  ///< none for fewer than three frames
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
  long n = 0;  ///< pixels looked at, every third of rows and columns
  std::vector<double> offset_px, sigma_px, mean_abs_px;  ///< by axis; the last over core and tails
  double mean_px = 0;                                    ///< of the error's length, over core and tails
  double tail_share = 0, tail_radius_px = 0;
  std::vector<CorrelationBin> correlation;
  SpatialCorrelation spatial;
  std::vector<Dependence> dependence;
};

/// Throws Error when there are fewer than 1000 pixels with an error, or all errors are the same.
ChannelErrors channel_errors(const std::vector<ChannelField>& frames, const std::string& channel);

/// Correlation by distance alone, of errors that are already centred and of unit size.
std::vector<CorrelationBin> measure_correlation(const std::vector<std::vector<Image<float>>>& frames_by_axis);

/// The mixture that fits best; see above.
SpatialCorrelation fit_correlation(const std::vector<CorrelationBin>& bins);

/// Chessboard distance of every pixel to the nearest of another id, px; NaN beyond 60 px.
Image<float> border_distance(const Image<uint16_t>& mask);

}  // namespace sextant
