#pragma once

// Everything that `evaluate objects` computes from the logs of several runs, as JSON and as a document.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/object_diagnosis.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/object_figures.h"
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
  std::vector<std::string> folders;   ///< one per log, without the prefix SYSTEM=
  std::vector<std::string> warnings;  ///< texts of `diagnoses` first, then other warnings
  std::vector<LogDiagnosis> diagnoses;
  std::map<std::string, FrameRate> rates;      ///< by system
  std::vector<ObjectTracks> tracks;            ///< paths of the camera and the objects, one per log
  std::vector<ObjectPathErrors> paths;         ///< one per object of logs that hold true poses
  std::vector<ObjectConsistency> consistency;  ///< one per object of logs that hold covariances
  /// Frames of the motions of systems whose logs hold no poses of objects that could contradict them.
  std::map<std::string, MotionFrame> assumed_frames;
  bool is_comparison = false;  ///< several folders or systems

  std::string rate_text() const;  ///< "Frame rate: 10 Hz (--rate)"; the rate of each system if they differ
  /// "Frame of the motions of SYSTEM: world, which nothing in its log can confirm .."; empty if all are
  /// checked.
  std::string frame_text() const;
};

/// {"schema":1,"rates":[{"system","hz","source"}],"presets":[{"preset","aggregate","rows":[..]}],
///  "systems":[..],"comparisons":[..],"poses":[..],"pose_axes":[..],"nees":[..],
///  "diagnoses":[{"code","text"}],"warnings":[..]}; rows as in the tables.
Json object_json(const ObjectScores& scores, std::span<const MetricPreset> presets);

/// Makes the report of all logs: tables under the presets, paths, states, distributions of errors and
/// warnings.
ReportDocument object_document(const ObjectScores& scores, std::span<const MetricPreset> presets);

/// Returns the first preset whose errors the records have. It is printed if the user requests no preset.
const MetricPreset& usual_preset(const std::vector<Record>& records);

/// One row per object, short enough for a terminal: steps, coverage, E_t, E_R and E_v under one preset, and
/// missing steps.
Table object_screen_table(const std::vector<Record>& records, const MetricPreset& preset);

}  // namespace sextant
