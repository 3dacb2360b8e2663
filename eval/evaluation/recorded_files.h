#pragma once

// Files of recorded results against a reference, as `evaluate ego` and `evaluate objects` take them: each
// estimate PATH or SYSTEM=PATH, a run of that system; the reference a file or a SOURCE of a data set.

#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"

namespace sextant {

struct EgoFiles {
  std::string reference;                 ///< a file, or a SOURCE
  std::vector<std::string> estimates;    ///< none: what the log `reference` holds beside its truth
  std::string format = "auto";           ///< of all files
  std::string reference_format;          ///< where it differs
  std::string estimate_format;           ///< where it differs
  std::string data_root;                 ///< for a SOURCE
  Json source_options = Json::object();  ///< {"source": {..}} for a SOURCE
};

struct EgoScores {
  EgoReference reference;
  std::vector<EgoResult> runs;  ///< in order of the estimates
};

/// Throws Error on bad files.
EgoScores evaluate_ego_files(const EgoFiles& files, const EgoOptions& options);

/// reference.tum and estimate_<i>.tum: matched and aligned.
void write_tum(const EgoScores& scores, const std::string& folder);

struct ObjectFiles {
  std::vector<std::string> folders;      ///< of logs
  LogFormat format = LogFormat::vdo;
  LogStage stage = LogStage::any;
  std::string truth;                     ///< SOURCE whose objects replace the logs' truth; empty: none
  double rate_hz = 10;                   ///< of frames, for velocities
  std::string tum;                       ///< folder for obj_<id>.tum and obj_<id>_gt.tum; empty: none
  std::string data_root;                 ///< for a SOURCE
  Json source_options = Json::object();  ///< {"source": {..}} for a SOURCE
};

struct ObjectScores {
  std::vector<Record> records;
  std::vector<std::string> folders;  ///< without the names of systems
  std::vector<std::string> warnings;
  bool is_comparison = false;  ///< several folders or systems
};

/// Throws Error on bad files.
ObjectScores evaluate_object_files(const ObjectFiles& files);

}  // namespace sextant
