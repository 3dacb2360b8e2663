#pragma once

// A source run up to one frame pair, and the picture of that pair: fig. 1 of the paper.

#include <string>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/run_output.h"
#include "sextant/eval/records/output.h"

namespace sextant {

struct ShowcaseRequest {
  SourceSpec source;
  int frame = 0;  ///< the current one of the pair; the pipeline runs from the source's first
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

}  // namespace sextant
