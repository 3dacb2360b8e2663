#pragma once

// Results of an external program as motions of frame pairs. A file that cannot be read is a reported problem
// and not an exception: the program failed, but the sweep continues.

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

/// Numbers of the frames in the sequence, in the program's input and in its results.
struct FrameNumbers {
  int first = 0, last = 0;  ///< frame range of the sequence
  int in_files = 0;         ///< number of the first frame in the input
  int in_results = 0;       ///< number of the first frame in the results
  double rate_hz = 0;       ///< frame n of the input is at n / rate

  size_t n_frames() const { return static_cast<size_t>(last - first) + 1; }

  /// Return the frame number in the sequence, given a frame number in the results, a time (which may differ
  /// from that of the frame by a quarter of the frame interval) or the index of a row with one row per frame.
  /// Throw Error if there is no such frame.
  int of_number(int number) const;
  int of_time(double t_s) const;
  int of_row(size_t row) const;
};

/// The folder into which a program wrote. It is only read; links that lead out of it are ignored.
struct ResultFolder {
  std::filesystem::path path;
  FrameNumbers numbers;
  /// true: the program ended with exit code 0; false: unfinished last lines of files are left out
  bool finished = true;
};

/// Size limits of files, in bytes: of poses or motions of one body and of times, and of logs of all objects.
inline constexpr FileKind pose_file = {"a file of poses or times", 100'000'000};
inline constexpr FileKind log_file = {"a log", 1'000'000'000};

struct ExternalResults {
  Trajectory camera;  ///< T_world_camera in the program's own world frame
  /// T_curr_prev of the object, by id in the masks and current frame: maps its points from previous to
  /// current camera.
  std::map<ObjectFrame, SE3> motions;
  MotionFrame declared_frame = MotionFrame::world;  ///< frame in which the program wrote the motions
  bool camera_unreadable = false;
  bool objects_unreadable = false;    ///< all of them
  std::set<int> unreadable;           ///< objects whose own file could not be read
  std::vector<std::string> problems;  ///< "FILE:LINE: ...", and missing files
  std::vector<std::string> notes;     ///< repairs, and skipped files
};

/// Reads the results. `truth` is used for motions in the body frame and to match ids (ExternalObjects::ids).
ExternalResults read_external_results(const ExternalResultSet& set, const ResultFolder& folder,
                                      const SequenceTruth& truth);

/// The program's own duration of each frame of the sequence, ms.
struct FrameTimes {
  std::map<int, double> ms;
  std::vector<std::string> problems, notes;
};
FrameTimes read_frame_times(const ExternalTimes& times, const ResultFolder& folder);

}  // namespace sextant
