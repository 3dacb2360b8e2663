#pragma once

// Everything that `evaluate objects` finds in the logs of several runs, as JSON and as a document.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/object_consistency.h"
#include "sextant/eval/evaluation/object_diagnosis.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/object_figures.h"
#include "sextant/eval/evaluation/object_paths.h"

namespace sextant {

/// The rate of a log's frames, and where it is known from.
struct FrameRate {
  double hz = 10;
  std::string source;  ///< "--rate", "of SOURCE", "time stamps of the log", "default, --rate changes it"

  std::string text() const;  ///< "10 Hz (default, --rate changes it)"
};

struct ObjectScores {
  std::vector<Record> records;
  std::vector<std::string> folders;   ///< without the names of systems
  std::vector<std::string> warnings;  ///< texts of `diagnoses` first
  std::vector<LogDiagnosis> diagnoses;
  std::map<std::string, FrameRate> rates;  ///< by system
  std::vector<ObjectTracks> tracks;        ///< of every log
  std::vector<ObjectPathErrors> paths;     ///< of logs with true poses
  std::vector<ObjectConsistency> consistency;  ///< of logs with covariances
  bool is_comparison = false;              ///< several folders or systems

  std::string rate_text() const;  ///< "Frame rate: 10 Hz (--rate)"; of each system where they differ
};

/// {"schema":1,"rates":[{"system","hz","source"}],"presets":[{"preset","aggregate","rows":[..]}],"systems":[..],
///  "comparisons":[..],"poses":[..],"pose_axes":[..],"nees":[..],"diagnoses":[{"code","text"}],"warnings":[..]}; rows as in the
/// tables.
Json object_json(const ObjectScores& scores, std::span<const MetricPreset> presets);

ReportDocument object_document(const ObjectScores& scores, std::span<const MetricPreset> presets);

/// The first preset whose errors the records have: the one to print where none is asked for.
const MetricPreset& usual_preset(const std::vector<Record>& records);

/// One line an object, for a screen: steps, coverage, E_t, E_R and E_v under one preset, and missing steps.
Table object_screen_table(const std::vector<Record>& records, const MetricPreset& preset);

}  // namespace sextant
