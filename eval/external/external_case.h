#pragma once

// The folder of one case of an external program, and the results that it holds: input/, output/, stdout.txt,
// stderr.txt, calibration.yaml, settings.*, case.json and log.txt.

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/base/new_file.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/external/external_config.h"
#include "sextant/eval/external/process.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/geometry/trajectory.h"
#include "sextant/noise/noise.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// Creates the folder, replacing an existing one. The destructor removes what is not to be kept, also after
/// an exception.
class CaseFolder {
 public:
  /// With an empty `folder`, a temporary one is used and removed completely, also after Ctrl-C.
  CaseFolder(const std::filesystem::path& folder, Keep keep);
  ~CaseFolder();
  CaseFolder(const CaseFolder&) = delete;
  CaseFolder& operator=(const CaseFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path input() const { return path_ / "input"; }
  std::filesystem::path output() const { return path_ / "output"; }
  std::filesystem::path file(const std::string& name) const { return path_ / name; }

 private:
  std::optional<ScratchFolder> scratch_;  ///< the temporary folder
  std::filesystem::path path_;
  Keep keep_;
};

/// Writes case.json: how the program ended, for reading its output again.
void write_case(const ProcessOutcome& outcome, const std::filesystem::path& folder);
/// Reads case.json. Throws Error if there is no finished case with its output.
ProcessOutcome read_case(const std::filesystem::path& folder);

/// Returns the last line of a text file that is not blank, with "?" for characters that are not printable
/// ASCII and "..." before the last 200 characters of a longer line; "" if there is none.
std::string last_line(const std::filesystem::path& path);

// ---- The sequence as an external program gets it. Its frames contain the noise of a case, with the same
// values that built-in estimators get at the same pixels (noise.h); frame n is at the time n / rate; ground
// truth is contained only if requested. Frames may be numbered from 0, and the last one may have a flow of
// zeros.

struct ShownSequence {
  bool truth = false;
  bool from_zero = false;       ///< numbers the first frame 0, whatever its number in the source
  bool zero_last_flow = false;  ///< adds zero flow to the last frame, which has no successor
};

class NoisySequence final : public Sequence {
 public:
  /// `base` must outlive this object.
  NoisySequence(const Sequence& base, Noise noise, uint64_t seed, const ShownSequence& shown);

  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override;
  void check_files() const override { base_.check_files(); }

 private:
  const Sequence& base_;
  Noise noise_;
  Draws draws_;
  SequenceInfo info_;
  SequenceTruth truth_;
  int shift_ = 0;  ///< from frame numbers here to those of the source
  bool zero_last_flow_ = false;
};

// ---- Results of an external program as motions of frame pairs. A file that cannot be read is a reported
// problem and not an exception: the program failed, but the sweep continues.

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
  Trajectory camera;                   ///< T_world_camera in the program's own world frame
  bool camera_has_quaternions = true;  ///< false: the camera's file contains matrices
  /// T_curr_prev of the object, by id in the masks and current frame: maps its points from previous to
  /// current camera.
  std::map<ObjectFrame, SE3> motions;
  MotionFrame declared_frame = MotionFrame::world;  ///< frame in which the program wrote the motions
  bool motions_have_quaternions = true;  ///< false: a file of an object, or the log, contains matrices
  bool camera_unreadable = false;
  bool objects_unreadable = false;    ///< all of them
  std::set<int> unreadable;           ///< objects whose file, or whose camera poses, could not be read
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
