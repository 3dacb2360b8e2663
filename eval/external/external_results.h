#pragma once

// What a program of somebody else has written, as motions of frame pairs. A file that cannot be read is a
// problem to be told, not an exception: the program failed, the sweep goes on.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/external/external_config.h"
#include "sextant/eval/external/object_logs.h"
#include "sextant/geometry/trajectory.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// How frames are called: by the sequence, in the program's input, in its results.
struct FrameNumbers {
  int first = 0, last = 0;  ///< of the sequence
  int in_files = 0;         ///< the first one in the input
  int in_results = 0;       ///< the first one in the results
  double rate_hz = 0;       ///< frame n of the input is at n / rate

  /// The sequence's number. Throw Error when there is no such frame.
  int of_number(int number) const;
  int of_time(double t_s) const;
  int of_row(size_t row) const;
};

struct ExternalResults {
  Trajectory camera;  ///< T_world_camera, the world being the program's own
  /// T_curr_prev of the object (id of the masks, current frame): its points, previous to current camera.
  std::map<ObjectFrame, SE3> motions;
  bool camera_unreadable = false;
  bool objects_unreadable = false;
  std::vector<std::string> problems;  ///< "FILE:LINE: ...", and files that are not there
  std::vector<std::string> notes;     ///< what was repaired
};

/// `finished`: the program ended well; else a last line without its end is cut off in every file. `truth` is
/// used for motions in the body frame and to match ids (ExternalObjects::ids).
ExternalResults read_external_results(const ExternalConfig& config, const std::filesystem::path& output,
                                      const FrameNumbers& numbers, const SequenceTruth& truth, bool finished);

}  // namespace sextant
