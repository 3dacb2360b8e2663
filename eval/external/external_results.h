#pragma once

// What a program of somebody else has written, as motions of frame pairs. A file that cannot be read is a
// problem to be told, not an exception: the program failed, the sweep goes on.

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sextant/eval/external/external_config.h"
#include "sextant/eval/logs/object_logs.h"
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

/// The folder that a program wrote into. It is only read. Links that lead out of it are ignored.
struct ResultFolder {
  std::filesystem::path path;
  FrameNumbers numbers;
  bool finished =
      true;  ///< the program ended well; else a last line without its end is left out of every file
};

/// How much is read of a file: of poses or motions of one body and of times; of logs of all objects.
inline constexpr FileKind pose_file = {"a file of poses or times", 100'000'000};
inline constexpr FileKind log_file = {"a log", 1'000'000'000};

struct ExternalResults {
  Trajectory camera;  ///< T_world_camera, the world being the program's own
  /// T_curr_prev of the object (id of the masks, current frame): its points, previous to current camera.
  std::map<ObjectFrame, SE3> motions;
  bool camera_unreadable = false;
  bool objects_unreadable = false;    ///< all of them
  std::set<int> unreadable;           ///< objects whose own file could not be read
  std::vector<std::string> problems;  ///< "FILE:LINE: ...", and files that are not there
  std::vector<std::string> notes;     ///< what was repaired or passed over
};

/// `truth` is used for motions in the body frame and to match ids (ExternalObjects::ids).
ExternalResults read_external_results(const ExternalResultSet& set, const ResultFolder& folder,
                                      const SequenceTruth& truth);

/// The program's own time per frame of the sequence, ms.
struct FrameTimes {
  std::map<int, double> ms;
  std::vector<std::string> problems, notes;
};
FrameTimes read_frame_times(const ExternalTimes& times, const ResultFolder& folder);

}  // namespace sextant
