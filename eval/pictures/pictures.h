#pragma once

// Pictures of frames, and of what an estimator made of them. Colours are Okabe and Ito's, told apart by
// colour-blind readers too.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/output.h"
#include "sextant/measurement/image.h"

namespace sextant {

// ---- one frame pair: the previous image with the static features and flow that gave the ego motion, and
// every moving object with its points, contour and speed

/// PNG bytes. `frame` is the previous frame of the pair with rgb and mask; `records` are those of the pair.
/// The picture is twice as wide as the frame; `width_px` > 0 shrinks it to that width.
std::string draw_overlay(const Frame& frame, const FrameResult& result, const std::vector<Record>& records,
                         int width_px = 0);

/// JPEG bytes: one body of a pair on its previous frame, cut out around its points; the whole frame for the
/// camera. Points that the estimate agrees with as discs, the others as crosses, all with a quarter of their
/// flow, and the outline where the frame has masks. `frame` has rgb.
std::string draw_body(const Frame& frame, const BodyResult& body, int width_px);

// ---- a source run up to one frame pair, and the picture of that pair: fig. 1 of the paper

struct ShowcaseRequest {
  SourceSpec source;
  /// Current frame of the pair; the pipeline runs from the source's first. nullopt: the second frame of the
  /// source.
  std::optional<int> frame;
  std::string estimator = RunConfig{}.estimator;
  Json options = Json::object();
  int width_px = 0;  ///< of the picture; 0: twice the image's
  int jobs = 1;
  bool quiet = false;
};

struct Showcase {
  std::string overlay_png;
  RunResult run;
};

/// Throws Error where the frame is none of the source, or the source has no colour images.
Showcase make_showcase(const ShowcaseRequest& request);

/// A run's files (run_files(), tracks.csv among them) and overlay.png.
OutputFiles showcase_files(const ShowcaseRequest& request);

// ---- strip: a picture that shows what a source gives: one row a frame, with columns for the image, depth
// (near = red), flow (hue = direction, strength = length; the wheel is in the corner) and instance masks over
// the image.

/// PNG bytes. Frames are evenly spread; channels that one lacks are dark tiles; `tile_px` is the width of one
/// tile.
std::string draw_strip(const Sequence& sequence, int n_frames, int tile_px);

}  // namespace sextant
