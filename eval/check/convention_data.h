#pragma once

// What the convention checks look at: the truth of a sequence, and its depth, flow and masks on a coarse
// grid of pixels. A plain value: a hypothesis about a mistake is a change of a copy of it (diagnosis.h).
//
//   grid:  sample (i, j) stands at pixel (i step + step/2, j step + step/2)
//   flow:  the flow image of frame k belongs to the pair (k + flow_from) -> (k + flow_to)
//
// An absent channel is an empty image. Units: m, px; NaN = invalid.

#include <map>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/truth_floor.h"

namespace sextant {

struct GridFrame {
  Image<float> depth_m;
  Image<Flow> flow;
  Image<uint16_t> mask;
  std::map<int, MaskOutline> outlines;  ///< of the full image
};

struct ConventionData {
  StereoCamera camera;
  int width = 0;  ///< of the full images, px
  int height = 0;
  double rate_hz = 0;
  int step = 1;  ///< px between samples
  int first_frame = 0;
  std::vector<GridFrame> frames;  ///< first_frame, first_frame + 1, ...; empty images where not looked at
  int flow_from = 0;
  int flow_to = 1;
  std::string depth_kind;  ///< as in SequenceInfo
  SequenceTruth truth;
  TruthFloor floor;  ///< accuracy of the true camera motion, where the data set knows it
  std::map<int, double> times_s;  ///< stamps, where the source has them

  int last_frame() const { return first_frame + static_cast<int>(frames.size()) - 1; }
  bool has(int frame) const { return frame >= first_frame && frame <= last_frame(); }
  const GridFrame& at(int frame) const { return frames[static_cast<size_t>(frame - first_frame)]; }
  double pixel(int sample) const { return sample * step + step / 2; }  // NOLINT: whole pixels
};

/// Everything but the grids: `frames` has the right number of empty ones.
ConventionData make_convention_data(const Sequence& sequence);

/// The samples of one channel.
template <typename T>
Image<T> sample_grid(const Image<T>& image, int step) {
  const int from = step / 2;
  return image_of((image.width() - from + step - 1) / step, (image.height() - from + step - 1) / step,
                  [&](int i, int j) { return image(i * step + from, j * step + from); });
}

/// One sample of a flow image, with the depth and mask id at its starting point.
struct FlowSample {
  double u = 0, v = 0;  ///< px
  double z_m = 0;
  Flow flow;
  int id = 0;
};
/// The valid samples of flow image k, taken at frame k + flow_from; none where a channel is missing.
std::vector<FlowSample> flow_samples(const ConventionData& data, int k);

}  // namespace sextant
