#pragma once

// Everything that `evaluate objects` computes from the logs of several runs, as JSON and as a document.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/trajectory_consistency.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

// ---- Figures of logged object motions (object_figures.cc): paths from above, states and tracklets over
// time. For each system they show its first run.

/// Positions of the camera and of all objects of one log, estimated and true, in one world.
struct ObjectTracks {
  std::string system;
  uint64_t run = 0;
  std::vector<BodyTrack> bodies;  ///< the camera first if the log has it
};
/// Returns the tracks of a log. For a log of motions only, chained_poses() gives the estimated paths.
ObjectTracks object_tracks(const ObjectLog& log, uint64_t run);

/// State of a step of an object.
enum class StepState { estimated, without_truth, gap, missed, gated };
constexpr Names<5> names_of(StepState) {
  return {"estimated", "estimated, no truth", "gap", "missed", "outside the gates"};
}

/// Successive frames of one object in the same state.
struct StateSpan {
  int object = 0, first = 0, last = 0;
  StepState state = StepState::estimated;
};
/// Returns the states of the steps of one run, by object and frame. A step without an estimate is a gap if it
/// lies between estimates of its object, and missed before the first or after the last one.
std::vector<StateSpan> state_spans(const std::vector<const Record*>& records);

/// Returns one figure per system: true and estimated paths from above.
std::vector<Figure> object_path_figures(const std::vector<ObjectTracks>& tracks);
/// Returns one figure per system: the state of every step of every object.
std::vector<Figure> object_state_figures(const std::vector<Record>& records);
/// Number of tracklets (stretches of successive estimated steps) that are at least x steps long, over x.
Figure tracklet_figure(const std::vector<Record>& records);

/// Interactive view of the paths with errors and speeds along them, for the first run of each system.
Explorer object_explorer(const std::vector<ObjectTracks>& tracks, const std::vector<Record>& records,
                         const std::string& Et_key, const std::string& ER_key);

// ---- The report.

/// Frame rate of a log, and its origin.
struct FrameRate {
  double hz = 10;
  /// Where the rate comes from: "--rate", "of SOURCE", "time stamps of the log", "default, --rate changes it"
  std::string source;

  std::string text() const;  ///< formats "10 Hz (default, --rate changes it)"
};

/// Results of all logs together.
struct ObjectScores {
  std::vector<Record> records;
  std::vector<std::string> folders;   ///< as requested, without the prefix SYSTEM=
  std::vector<std::string> warnings;  ///< for each log: the texts of its diagnoses, then its other warnings
  std::vector<DataWarning> diagnoses;
  std::map<std::string, FrameRate> rates;      ///< by system
  std::vector<ObjectTracks> tracks;            ///< paths of the camera and the objects, one per log
  std::vector<ObjectPathErrors> paths;         ///< one per object of logs with true poses
  std::vector<ObjectConsistency> consistency;  ///< one per object of logs with covariances
  /// Frames of the motions by system, for logs without poses of objects or a SOURCE that could contradict
  /// them.
  std::map<std::string, MotionFrame> assumed_frames;
  bool is_comparison = false;  ///< several folders or systems

  std::string rate_text() const;  ///< "Frame rate: 10 Hz (--rate)"; the rate of each system if they differ
  /// Formats `assumed_frames` as "Frame of the motions of SYSTEM: world, which nothing in the log can confirm
  /// ..".
  std::string frame_text() const;
};

/// Removes the runs that have the same errors as an earlier run of their system from all results, with a
/// warning.
void leave_out_repeated_runs(ObjectScores& scores);
/// Warns of runs whose true speeds are not those of the first run at the steps that both have.
void warn_of_other_truth(ObjectScores& scores);

/// Returns {"schema":1,"rates":[{"system","hz","source"}],
///  "presets":[{"preset","aggregate","rows":[..]}],"systems":[..],"comparisons":[..],"poses":[..],
///  "pose_axes":[..],"nees":[..],"diagnoses":[{"code","text"}],"warnings":[..]}; rows as in the tables.
Json object_json(const ObjectScores& scores, std::span<const MetricPreset> presets);

/// Makes the report of all logs: tables under the presets, paths, states, distributions of errors and
/// warnings.
ReportDocument object_document(const ObjectScores& scores, std::span<const MetricPreset> presets);

/// Returns the first preset whose E_t the records have, otherwise the first one; it is the default for
/// printing.
const MetricPreset& usual_preset(const std::vector<Record>& records);

/// Table with one row per object that fits a terminal: steps, coverage, E_t, E_R, E_v and the true speed
/// under one preset, and steps with another status.
Table object_screen_table(const std::vector<Record>& records, const MetricPreset& preset);

}  // namespace sextant
