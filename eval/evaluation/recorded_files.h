#pragma once

// Evaluates files of recorded results against a reference, for `evaluate ego` and `evaluate objects`. An
// estimate is PATH or SYSTEM=PATH, one run of that system; the reference is a file or a SOURCE of a data set.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/evaluation/object_report.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// Files of `evaluate ego`, and how to read them.
struct EgoFiles {
  std::string reference;  ///< a file, or a SOURCE
  /// PATH or SYSTEM=PATH; empty: the estimate in the log `reference`, which also contains the truth
  std::vector<std::string> estimates;
  std::string format = "auto";           ///< format of all files
  std::string reference_format;          ///< if it differs from `format`; empty: `format`
  std::string estimate_format;           ///< if it differs from `format`; empty: `format`
  std::optional<double> rate_hz;         ///< files without time stamps: frame (or row) k is at k / rate_hz
  std::string data_root;                 ///< root folder of a SOURCE
  Json source_options = Json::object();  ///< {"source": {..}}, options of a SOURCE
};

/// Results of `evaluate ego`: the reference and one result per estimate.
struct EgoScores {
  EgoReference reference;
  std::vector<EgoResult> runs;  ///< in the order of the estimates
};

/// Reads and evaluates all files. Throws Error on a bad reference, or on bad estimates with one line for
/// each.
EgoScores evaluate_ego_files(const EgoFiles& files, const EgoOptions& options);

/// Writes estimate_<i>.tum, the matched poses of run i (from 0) after the alignment, and reference.tum, the
/// poses of the reference that the runs match. If the runs match different poses, reference_<i>.tum is
/// written for each run instead. Both files of a pair have the times EgoResult::times_of_matches(), so an
/// evaluation of the pair without alignment gives the absolute errors of the run.
void write_tum(const EgoScores& scores, const std::string& folder);

/// Treatment of estimates that are the identity although the object moves: they count as estimates, or as
/// lost steps.
enum class IdentityMotions { count, lost };
constexpr Names<2> names_of(IdentityMotions) { return {"count", "lost"}; }

/// Logs of `evaluate objects`, and how to read them.
struct ObjectFiles {
  std::vector<std::string> folders;  ///< DIR or SYSTEM=DIR, one log each
  LogFormat format = LogFormat::vdo;
  LogStage stage = LogStage::any;
  std::optional<MotionFrame> frame;  ///< frame of the logged motions; empty: the default of the format
  IdentityMotions identity = IdentityMotions::count;
  std::optional<CovarianceConvention> covariance =
      std::nullopt;   ///< convention of the covariances in plain files
  std::string truth;  ///< SOURCE whose objects replace the logs' truth; empty: none
  std::optional<double>
      rate_hz;      ///< frame rate, for velocities; empty: from the truth, the log's time stamps, or 10 Hz
  std::string tum;  ///< folder for obj_<id>.tum and obj_<id>_gt.tum; empty: none
  std::string
      zip;  ///< folder for obj_<id>.zip, evo's result file of each object with true poses; empty: none
  std::string data_root;                 ///< root folder of a SOURCE
  Json source_options = Json::object();  ///< {"source": {..}}, options of a SOURCE
};

/// Reads and evaluates all logs. Throws Error on bad files.
ObjectScores evaluate_object_files(const ObjectFiles& files);

/// Reads the true camera poses of a SOURCE as a reference, with frame numbers and time stamps (those of the
/// data set, otherwise frame / rate). `options` are those of `--options` and `--set`, e.g.
/// {"source":{"truth":"rectified"}}. With `every_pose` also poses of frames without images are returned, such
/// as those of KITTI's GPS/IMU file. Throws Error if the source has no true poses, or if their stamps do not
/// ascend.
EgoReference source_reference(const std::string& source, const std::string& data_root, const Json& options,
                              bool every_pose = false);

// ---- The result file of evo (evo_ape --save_results, read by evo_res): a zip of
//
//   info.json     title, ref_name, est_name, label       stats.json    the seven statistics
//   error_array.npy and, as they exist, timestamps.npy, seconds_from_start.npy, distances.npy (estimate),
//   distances_from_start.npy (reference), alignment_transformation_sim3.npy
//
// .npy: numpy's format version 1.0, little-endian doubles, C order.

/// Writes the zip under a temporary name, then renames it. Throws Error if it cannot be written.
void write_evo_result(const std::filesystem::path& path, const EgoResult& result, const EgoOptions& options,
                      const std::string& reference_name);

/// Encodes an .npy file of the values, row by row with `columns` columns; 0: a one-dimensional array.
std::string encode_npy(std::span<const double> values, size_t columns = 0);

}  // namespace sextant
