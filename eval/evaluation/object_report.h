#pragma once

// Everything that `evaluate objects` computes from the logs of several runs, as JSON and as a document.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/object_figures.h"
#include "sextant/eval/evaluation/object_plausibility.h"
#include "sextant/eval/evaluation/trajectory_consistency.h"

namespace sextant {

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
  std::vector<LogDiagnosis> diagnoses;
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
