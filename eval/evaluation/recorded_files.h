#pragma once

// Files of recorded results against a reference, as `evaluate ego` and `evaluate objects` take them: each
// estimate PATH or SYSTEM=PATH, a run of that system; the reference a file or a SOURCE of a data set.

#include <optional>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/evaluation/object_scores.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct EgoFiles {
  std::string reference;                 ///< a file, or a SOURCE
  std::vector<std::string> estimates;    ///< none: what the log `reference` holds beside its truth
  std::string format = "auto";           ///< of all files
  std::string reference_format;          ///< where it differs
  std::string estimate_format;           ///< where it differs
  std::optional<double> rate_hz;         ///< frame k of files without time stamps is at k / rate_hz
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

/// Exact identities as estimates of objects that move: counted as estimates, or as lost steps.
enum class IdentityMotions { count, lost };
constexpr Names<2> names_of(IdentityMotions) { return {"count", "lost"}; }

struct ObjectFiles {
  std::vector<std::string> folders;  ///< of logs
  LogFormat format = LogFormat::vdo;
  LogStage stage = LogStage::any;
  std::optional<MotionFrame> frame;  ///< of the logged motions, where it is not the format's own
  IdentityMotions identity = IdentityMotions::count;
  std::optional<CovarianceConvention> covariance = std::nullopt;  ///< of covariances in plain files
  std::string truth;                     ///< SOURCE whose objects replace the logs' truth; empty: none
  std::optional<double> rate_hz;         ///< of frames, for velocities; empty: frame_rate()
  std::string tum;                       ///< folder for obj_<id>.tum and obj_<id>_gt.tum; empty: none
  std::string data_root;                 ///< for a SOURCE
  Json source_options = Json::object();  ///< {"source": {..}} for a SOURCE
};

/// Throws Error on bad files.
ObjectScores evaluate_object_files(const ObjectFiles& files);

// ---- the truth of a SOURCE as a reference for recorded results. `options` as of `--options` and `--set`, e.g.
// {"source":{"truth":"rectified"}}.

/// Poses have frame numbers, and time stamps: those of the data set, else frame / rate. Throws Error when the
/// source has no true poses. `every_pose`: also poses of frames that the source does not have, as KITTI's GPS/IMU file where only some
/// images are there.
EgoReference source_reference(const std::string& source, const std::string& data_root, const Json& options,
                              bool every_pose = false);

/// The truth of a SOURCE.
struct SourceObjects {
  SequenceTruth truth;
  double rate_hz = 10;
};

/// The truth with the objects of the frames that SOURCE@first-last asks for. Throws Error when there are none.
SourceObjects source_objects(const std::string& source, const std::string& data_root, const Json& options);

}  // namespace sextant
