#pragma once

// Frames of a synthetic scenario and their truth.
//
//   gray, rgb   textures filtered analytically; pixels on edges of surfaces and shadows are the mean of 8
//               samples; light: a sun with shadows, and the sky
//   depth_m     z-depth of what is seen at the pixel centre; NaN = sky
//   flow        where that very point (at the stored depth) is seen in the next frame under the true motion
//               of its body, whether or not something hides it there, inside the image or not; NaN = sky, or
//               behind the next camera, or the body is not there then. The last frame has none
//   mask        ids of all cars, moving or parked
//
// A pure function of scenario and frame.

#include <memory>

#include "sextant/datasets/synthetic/ray_scene.h"
#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/geometry/camera.h"
#include "sextant/measurement/frame.h"
#include "sextant/truth/truth.h"

namespace sextant::synthetic {

class Renderer {
 public:
  /// Throws Error on a scenario that check() refuses.
  explicit Renderer(Scenario scenario);

  const Scenario& scenario() const { return scenario_; }
  /// Frame numbers in [0, n_frames). Safe to call from several threads.
  Frame render(int frame, const Channels& channels) const;
  /// Camera poses of all frames, and the objects that are seen in frames first..last, with the box of their
  /// visible pixels.
  SequenceTruth truth(int first, int last) const;

 private:
  struct View;
  View view(int frame) const;
  void render_geometry(const View& view, Frame& out, const Channels& channels) const;
  Image<Rgb> render_rgb(const View& view, const std::vector<Hit>& hits) const;
  /// Of each body's points: T_other_curr, from this view's camera to that of another frame; empty where the
  /// body is not there in both.
  std::vector<std::optional<SE3>> motions(const View& view, int frame) const;
  Image<Flow> render_flow(const View& view, const std::vector<Hit>& hits, int frame) const;

  Scenario scenario_;
  std::unique_ptr<Bodies> bodies_;  ///< body 0 is the street, body i the actor i - 1
};

}  // namespace sextant::synthetic
