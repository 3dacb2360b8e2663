#pragma once

// A viewed run as an MCAP recording for other viewers (Foxglove, Lichtblick), with JSON messages of
// Foxglove's published schemas. Positions are in metres. The frame `world` is the world of the run (x right,
// y down, z ahead in the first camera); the frame `map` is the same world with z up.
//
//   topic                        type                        content
//   /tf                          foxglove.FrameTransform     map -> world -> camera and camera_truth
//   /camera/estimate, /truth     foxglove.PoseInFrame        T_world_camera of each frame
//   /camera/estimate_path, ..    foxglove.PosesInFrame       the whole path, once
//   /object/ID/estimate, /truth  foxglove.PoseInFrame        T_world_object; origin of the true box
//   /boxes/estimate, /truth      foxglove.SceneUpdate        boxes of the objects, with the true sizes
//   /image                       foxglove.CompressedImage    the image of the frame, JPEG
//   /calibration                 foxglove.CameraCalibration  the rectified camera
//
// The time of frame k is k / rate. The estimated path of an object begins at the true pose at the start of
// each stretch of estimates (eval/records/tracks.h). Objects without a true size have poses but no boxes.

#include <cstdint>
#include <filesystem>

#include "sextant/eval/view/viewed_run.h"

namespace sextant {

struct RecordingOptions {
  bool images = true;
  int jpeg_quality = 85;
  bool quiet = false;
};

/// Replaces `out` and returns the number of messages. Throws Error, or Interrupted on Ctrl-C; `out` is then
/// unchanged.
uint64_t write_recording(const ViewedRun& run, const std::filesystem::path& out,
                         const RecordingOptions& options = {});

}  // namespace sextant
