#pragma once

// Frames of a synthetic scenario and their truth.
//
//   rgb            textures filtered analytically; light: a sun with shadows, and the sky; see shading.h
//   rgb_right      colour from the right camera, bf / fx along x
//   depth_m        z-depth of the visible surface at the pixel centre; NaN = sky
//   flow           displacement of this point (at the stored depth) to its position in the next frame under
//                  the true motion of its body, px, also if it is occluded there or outside the image; NaN =
//                  sky, or less than 0.1 m ahead of the next camera, or the body does not exist then. The
//                  last frame has none
//   backward_flow  likewise to the previous frame. The first frame has none
//   mask           ids of all cars, moving or parked
//
// A pure function of scenario and frame.

#include <memory>

#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/measurement/frame.h"
#include "sextant/truth/truth.h"

namespace sextant::synthetic {

class Renderer {
 public:
  /// Throws Error if Scenario::check() rejects the scenario.
  explicit Renderer(Scenario scenario);
  ~Renderer();

  const Scenario& scenario() const;
  /// Renders the requested channels of a frame in [0, n_frames), except gray. Safe to call from several
  /// threads. The geometry of the last few frames is cached, so that channels may be requested one by one.
  Frame render(int frame, const Channels& channels) const;
  /// Returns the camera poses of frames first..last and the objects visible in them, with the bounding boxes
  /// of their visible pixels.
  SequenceTruth truth(int first, int last) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace sextant::synthetic
