#pragma once

// Pictures of frames and of estimates. The colours are those of Okabe and Ito, which are distinguishable for
// colour-blind readers.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/output.h"
#include "sextant/measurement/image.h"

namespace sextant {

// ---- one frame pair: the previous image with the static features and flow behind the ego motion, and every
// moving object with its points, contour and speed

/// Returns PNG bytes. `frame` is the previous frame of the pair with rgb and mask; `records` are those of the
/// pair. The picture is twice as wide as the frame; `width_px` > 0 reduces it to that width.
std::string draw_overlay(const Frame& frame, const FrameResult& result, const std::vector<Record>& records,
                         int width_px = 0);

/// Returns JPEG bytes of one body of a pair on its previous frame, cropped around its points; the whole frame
/// for the camera. At most 500 points are drawn: inliers as discs, other points as crosses, all with a
/// quarter of their flow; the outline is drawn if the frame has masks. `frame` must have rgb; `width_px` > 0
/// is the width of the picture.
std::string draw_body(const Frame& frame, const BodyResult& body, int width_px);

// ---- a source processed up to one frame pair, and the picture of that pair: Fig. 1 of the paper

struct ShowcaseRequest {
  SourceSpec source;
  /// Current frame of the pair; the pipeline starts at the first frame of the source. nullopt: the second
  /// frame of the source.
  std::optional<int> frame;
  std::string estimator = RunConfig{}.estimator;
  Json options = Json::object();
  int width_px = 0;  ///< width of the picture; 0: twice that of the image
  int jobs = 1;
  bool quiet = false;
};

struct Showcase {
  std::string overlay_png;
  RunResult run;
};

/// Runs the estimator from the first frame of the source to the requested frame, and draws the last pair.
/// Throws Error if the source does not contain both frames of the pair, or has no colour images.
Showcase make_showcase(const ShowcaseRequest& request);

/// Returns a run's files (run_files(), including tracks.csv) and overlay.png.
OutputFiles showcase_files(const ShowcaseRequest& request);

// ---- strip: a picture of the content of a source. One row per frame, with columns for the image, depth
// (near = red), flow (hue = direction, saturation = length; colour wheel in the corner) and instance masks
// over the image.

/// Returns PNG bytes. Frames are evenly spaced; missing channels are dark tiles; `tile_px` is the width of
/// one tile.
std::string draw_strip(const Sequence& sequence, int n_frames, int tile_px);

}  // namespace sextant
