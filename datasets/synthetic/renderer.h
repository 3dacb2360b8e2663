#pragma once

// Frames of a synthetic scenario and their truth.
//
//   gray, rgb      textures filtered analytically; light: a sun with shadows, and the sky; see painter.h
//   rgb_right      the same from the right camera, bf / fx along x
//   depth_m        z-depth of what is seen at the pixel centre; NaN = sky
//   flow           where that very point (at the stored depth) is seen in the next frame under the true
//                  motion of its body, whether or not something hides it there, inside the image or not; NaN
//                  = sky, or behind the next camera, or the body is not there then. The last frame has none
//   backward_flow  the same to the frame before. The first frame has none
//   occlusion      visible: in the next frame, that point is what is seen at the end of its flow (at one of
//                  the four pixels around it, same body, depth within 3 cm or 0.5 %); hidden: something else
//                  is; outside: beyond the image or behind the camera; unknown: sky, or the body is not there
//                  then. The last frame has none
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
  /// Throws Error on a scenario that check() refuses.
  explicit Renderer(Scenario scenario);
  ~Renderer();

  const Scenario& scenario() const;
  /// Frame numbers in [0, n_frames). Safe to call from several threads. The geometry of the last few frames
  /// is kept, so that their channels may be asked for one by one.
  Frame render(int frame, const Channels& channels) const;
  /// Camera poses of all frames, and the objects that are seen in frames first..last, with the box of their
  /// visible pixels.
  SequenceTruth truth(int first, int last) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace sextant::synthetic
