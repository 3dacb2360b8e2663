#include "sextant/eval/evaluation/recorded_files.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <future>
#include <limits>
#include <set>

#include "sextant/base/file_lock.h"
#include "sextant/base/files.h"
#include "sextant/base/new_file.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/trajectory_matching.h"
#include "sextant/eval/evaluation/trajectory_warnings.h"
#include "sextant/eval/logs/object_association.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/zip_file.h"

namespace sextant {

namespace {

/// An estimate "NAME=PATH" of the system NAME; the system of a plain path is empty.
struct Estimate {
  std::string system;
  std::string path;
};

Estimate parse_estimate(const std::string& text) {
  const size_t equals = text.find('=');
  std::error_code ignored;
  if (equals == std::string::npos || fs::exists(text, ignored)) return {"", text};
  if (equals == 0 || equals + 1 == text.size())
    fail("'{}': expected FILE or NAME=FILE, but the {} is missing", text, equals == 0 ? "name" : "file");
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Returns the labels of the estimates in tables: NAME, with the number of the run if NAME has several. The
/// label of an estimate without a name is the shortest end of its path that no other estimate has.
std::vector<std::string> labels_of(const std::vector<Estimate>& estimates) {
  std::map<std::string, int> runs, seen;
  for (const Estimate& e : estimates) ++runs[e.system];
  std::vector<std::string> labels;
  for (const Estimate& e : estimates) {
    if (!e.system.empty()) {
      labels.push_back(runs[e.system] > 1 ? fmt::format("{} {}", e.system, ++seen[e.system]) : e.system);
      continue;
    }
    fs::path path = fs::path(e.path).lexically_normal();
    std::string label = path.filename().string();
    const auto is_taken = [&] {
      return std::ranges::any_of(estimates, [&](const Estimate& other) {
        const std::string text = fs::path(other.path).lexically_normal().string();
        return &other != &e && other.system.empty() && other.path != e.path &&
               (text == label || text.ends_with("/" + label));
      });
    };
    while (is_taken() && path.has_parent_path() && path.parent_path() != path) {
      path = path.parent_path();
      label = path.filename().string() + "/" + label;
    }
    const int n = ++seen["\n" + label];
    labels.push_back(n > 1 ? fmt::format("{} {}", label, n) : label);
  }
  return labels;
}

/// Returns true if `text` has the form "adapter:path" and is not the name of a file.
bool looks_like_source(const std::string& text) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos || colon < 2) return false;
  const std::string adapter = text.substr(0, colon);
  if (adapter.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") != std::string::npos) return false;
  std::error_code ignored;
  return !fs::exists(text, ignored);
}

std::unique_ptr<Sequence> open(const std::string& source, const std::string& data_root, const Json& options) {
  for (const auto& group : options.items()) {
    if (group.key() != "source")
      fail("unknown option group '{}': a reference has options under 'source'", group.key());
  }
  SourceSpec spec = find_source(source, data_root);
  spec.add_options(options.value("source", Json::object()));
  return open_source(spec);
}

/// True objects of a SOURCE, with its frame rate.
struct SourceObjects {
  SequenceTruth truth;
  double rate_hz = 10;
};

/// Reads the true objects of a SOURCE; `SOURCE@first-last` restricts the frames. Throws Error if there are
/// none.
SourceObjects source_objects(const std::string& source, const std::string& data_root, const Json& options) {
  const std::unique_ptr<Sequence> sequence = open(source, data_root, options);
  SequenceTruth truth = sequence->truth();
  std::erase_if(truth.objects, [&](const auto& at) {
    return at.first < sequence->info().first_frame || at.first > sequence->info().last_frame;
  });
  if (truth.objects.empty()) fail("{}: has no true objects to compare with", source);
  return {std::move(truth), sequence->info().rate_hz};
}

/// Computes time stamps from frame numbers, or from rows if there are none; returns false if the poses
/// already have stamps.
bool add_stamps(PoseSeries& poses, const std::optional<double>& rate_hz) {
  if (!rate_hz || !poses.stamps_s.empty()) return false;
  for (const int frame : frames_of(poses)) poses.stamps_s.push_back(frame / *rate_hz);
  return true;
}

void check_rate(const std::optional<double>& rate_hz) {
  if (rate_hz && !(*rate_hz > 0 && std::isfinite(*rate_hz)))
    fail("--rate {}: must be finite and above 0", *rate_hz);
}

EgoReference reference_of(const EgoFiles& files) {
  if (looks_like_source(files.reference))
    return source_reference(files.reference, files.data_root, files.source_options);
  TrajectoryFile file = read_trajectory(
      files.reference, files.reference_format.empty() ? files.format : files.reference_format);
  EgoReference reference;
  reference.side = {files.reference, file.comments, file.format};
  reference.warnings = file.warnings;
  reference.poses = file.truth ? std::move(*file.truth) : std::move(file.poses);
  return reference;
}

/// Returns the format of an estimate. With --format euroc, as for evo, the estimates may be in a TUM format.
std::string format_of_estimate(const EgoFiles& files, const std::string& path) {
  if (!files.estimate_format.empty()) return files.estimate_format;
  if (files.format != "euroc") return files.format;
  const FittingFormats fitting = fitting_formats(path);
  const bool tum = fitting.names.size() == 1 && fitting.names[0].starts_with("tum");
  return tum ? fitting.names[0] : files.format;
}

std::string tum_of(const std::map<ObjectFrame, SE3>& poses, int id, double rate_hz) {
  PoseSeries series = object_series(poses, id);
  for (const int frame : series.frames) series.stamps_s.push_back(frame / rate_hz);
  return encode_tum(series);
}

/// Writes <DIR>/<system>, and <DIR>/<system>_2 ... for further runs of a system, below the folders for TUM
/// files and for evo's result files; `taken` holds the names used by earlier logs.
void write_objects(ObjectLog& log, uint64_t run_of_system, double rate_hz, const ObjectFiles& files,
                   std::vector<std::string>& taken) {
  if (log.poses.empty()) log.poses = chained_poses(log);
  if (log.poses.empty()) {
    log.warnings.push_back(fmt::format(
        "--save-tum, --save-zip: the log of {} holds motions of objects, but no pose to start from: give "
        "--truth",
        log.estimator));
  }
  const std::string end_of_name = run_of_system > 1 ? fmt::format("_{}", run_of_system) : "";
  taken.push_back(safe_file_name(log.estimator + end_of_name));
  taken = distinct_names(std::move(taken));
  std::set<std::string> written;
  if (!files.zip.empty()) {
    const FolderLock lock(files.zip);
    const fs::path folder = make_folder_below(files.zip, taken.back());
    EgoOptions options;
    options.alignment = Alignment::se3;
    for (const EgoResult& path : aligned_object_paths(log, rate_hz)) {
      const std::string name = path.name + ".zip";
      write_evo_result(folder / name, path, options, path.name + "_gt");
      written.insert(name);
    }
    remove_stale_files(folder, R"(obj_\d+\.zip)", written);
  }
  if (files.tum.empty()) return;
  const FolderLock lock(files.tum);
  const fs::path folder = make_folder_below(files.tum, taken.back());
  for (const auto& [poses, end] : {std::pair(&log.poses, ""), std::pair(&log.true_poses, "_gt")}) {
    for (auto it = poses->begin(); it != poses->end();
         it = poses->upper_bound({it->first.first, std::numeric_limits<int>::max()})) {
      const int id = it->first.first;
      const std::string name = fmt::format("obj_{}{}.tum", id, end);
      write_file(folder / name, tum_of(*poses, id, rate_hz));
      written.insert(name);
    }
  }
  remove_stale_files(folder, R"(obj_\d+(_gt)?\.tum)", written);
}

/// Reads the logs of one folder. Logs of SYSTEM=DIR are called SYSTEM, or SYSTEM_<module> if the folder has
/// several.
std::vector<ObjectLog> logs_of(const Estimate& estimate, const ObjectFiles& files) {
  ObjectLogRequest request{
      .format = files.format, .stage = files.stage, .frame = files.frame, .rate_hz = files.rate_hz};
  request.rules.covariance = files.covariance;
  std::vector<ObjectLog> logs = read_object_logs(estimate.path, request);
  for (ObjectLog& log : logs) {
    if (estimate.system.empty()) continue;
    log.estimator = logs.size() == 1 ? estimate.system : estimate.system + "_" + log.estimator;
  }
  return logs;
}

/// Folders without a name are systems of their own: logs of one name in several of them also get the label of
/// their folder.
void name_apart(const std::vector<Estimate>& estimates, std::vector<std::vector<ObjectLog>>& logs) {
  std::map<std::string, int> folders;
  for (size_t i = 0; i < logs.size(); ++i) {
    for (const ObjectLog& log : logs[i]) folders[log.estimator] += estimates[i].system.empty();
  }
  const std::vector<std::string> labels = labels_of(estimates);
  for (size_t i = 0; i < logs.size(); ++i) {
    for (ObjectLog& log : logs[i]) {
      if (estimates[i].system.empty() && folders.at(log.estimator) > 1)
        log.estimator = logs[i].size() == 1 ? labels[i] : labels[i] + "_" + log.estimator;
    }
  }
}

/// Returns the first known rate: --rate, the data set's, that of the log's time stamps, 10 Hz.
FrameRate frame_rate(const ObjectFiles& files, ObjectLog& log, const std::optional<SourceObjects>& source) {
  if (files.rate_hz) return {*files.rate_hz, "--rate"};
  const FrameRate rate = source        ? FrameRate{source->rate_hz, "of " + files.truth}
                         : log.rate_hz ? FrameRate{*log.rate_hz, "time stamps of the log"}
                                       : FrameRate{10, "default, --rate changes it"};
  if (log.rate_hz && std::abs(*log.rate_hz / rate.hz - 1) > 0.01) {
    log.warnings.push_back(fmt::format(
        "{}: the log's time stamps have {:.4g} Hz, {} has {:.4g} Hz, which is used: give --rate to "
        "use another one",
        log.estimator, *log.rate_hz, files.truth, rate.hz));
  }
  return rate;
}

/// Warns of missing steps, and of identity estimates with how they are counted.
void note_steps(ObjectLog& log, IdentityMotions identity) {
  for (const auto& [id, steps] : identity_steps(log)) {
    const bool lost = identity == IdentityMotions::lost;
    log.warnings.push_back(fmt::format(
        "{}, object {}: {} estimates are exactly the identity while the object moves, frames {}: motions "
        "that were never estimated? They count as {}",
        log.estimator, object_text(id), steps.size(), ranges_text(steps),
        lost ? "lost steps" : "estimates; --identity lost counts them as lost"));
    for (const int k : steps) {
      if (!lost) continue;
      const auto motion = log.motions.find({id, k});
      if (motion->second.truth) log.lost_truth.emplace(motion->first, *motion->second.truth);
      log.motions.erase(motion);
    }
  }
  std::map<int, int> logged;
  for (const auto& [key, motion] : log.motions) ++logged[key.first];
  for (const auto& [id, steps] : missing_steps(log)) {
    if (!logged.contains(id)) continue;  // not detected: the coverage counts it
    log.warnings.push_back(fmt::format("{}, object {}: {} of {} steps have no estimate, frames {}",
                                       log.estimator, object_text(id), steps.size(),
                                       steps.size() + static_cast<size_t>(logged[id]), ranges_text(steps)));
  }
}

std::vector<double> distances_of(const PoseSeries& poses, const std::vector<int>& rows) {
  const std::vector<double> path = path_lengths_m(poses);
  std::vector<double> out;
  for (const int row : rows) out.push_back(path[static_cast<size_t>(row)]);
  return out;
}

std::string title_of(const EgoResult& result, const EgoOptions& options) {
  std::string title = fmt::format("{} w.r.t. {} ({})", options.rpe() ? "RPE" : "APE",
                                  to_string(options.relation), unit_of(options.relation));
  if (options.rpe()) {
    title += fmt::format("\nfor delta = {} using {} pairs", options.rpe()->text(),
                         options.rpe()->all_pairs ? "all" : "consecutive");
  }
  return title +
         fmt::format("\n(alignment: {}, {} poses)", to_string(options.alignment), result.estimate.size());
}

}  // namespace

EgoScores evaluate_ego_files(const EgoFiles& files, const EgoOptions& options) {
  check_rate(files.rate_hz);
  std::vector<Estimate> estimates;
  for (const std::string& text : files.estimates) estimates.push_back(parse_estimate(text));
  if (estimates.empty()) estimates.push_back({"", files.reference});

  const auto read = [&](const std::string& path) {
    ReadRules rules;
    rules.covariance = options.covariance;
    return read_trajectory(path, format_of_estimate(files, path), rules);
  };
  std::future<TrajectoryFile> first = std::async(std::launch::async, read, estimates.front().path);
  EgoScores scores;
  scores.reference = reference_of(files);
  bool used_rate = add_stamps(scores.reference.poses, files.rate_hz);
  to_camera(scores.reference.poses, options.reference_frame);
  check_physical(scores.reference.poses, scores.reference.side.name, options.max_speed_m_s);
  const std::vector<std::string> labels = labels_of(estimates);
  std::string problems;  // one line per bad estimate: a table never silently leaves one out
  for (size_t i = 0; i < estimates.size(); ++i) {
    try {
      TrajectoryFile file = i == 0 ? first.get() : read(estimates[i].path);
      used_rate |= add_stamps(file.poses, files.rate_hz);
      if (files.estimates.empty() && !file.truth)
        fail("{}: holds no truth of its own: give the estimate after the reference", files.reference);
      scores.runs.push_back(evaluate_ego(scores.reference, std::move(file), estimates[i].path, options));
      EgoResult& run = scores.runs.back();
      run.name = labels[i];
      run.system = estimates[i].system.empty() ? labels[i] : estimates[i].system;
    } catch (const Error& error) {
      problems += (problems.empty() ? "" : "\n") + std::string(error.what());
    }
  }
  if (!problems.empty()) fail("{}", problems);
  mark_same_runs(scores.runs);
  if (files.rate_hz && !used_rate) {
    fail("--rate {}: gives times to files without time stamps, but all of these have some: leave it out",
         *files.rate_hz);
  }
  return scores;
}

void write_tum(const EgoScores& scores, const std::string& folder) {
  const FolderLock lock(folder);
  std::vector<std::vector<double>> times;
  for (const EgoResult& run : scores.runs) times.push_back(run.times_of_matches());
  bool one_reference = true;
  for (size_t i = 1; i < scores.runs.size(); ++i) {
    one_reference = one_reference && times[i] == times[0] &&
                    scores.runs[i].reference.positions_m == scores.runs[0].reference.positions_m;
  }
  std::set<std::string> written;
  const auto write = [&](const std::string& name, const PoseSeries& poses, size_t i) {
    write_file(fs::path(folder) / name, encode_tum(poses, times[i]));
    written.insert(name);
  };
  for (size_t i = 0; i < scores.runs.size(); ++i) {
    const EgoResult& run = scores.runs[i];
    if (i == 0 || !one_reference)
      write(one_reference ? "reference.tum" : fmt::format("reference_{}.tum", i), run.reference, i);
    write(fmt::format("estimate_{}.tum", i), run.estimate, i);
  }
  remove_stale_files(folder, R"((estimate_\d+|reference(_\d+)?)\.tum)", written);
}

ObjectScores evaluate_object_files(const ObjectFiles& files) {
  check_rate(files.rate_hz);
  std::optional<SourceObjects> source;
  if (!files.truth.empty()) source = source_objects(files.truth, files.data_root, files.source_options);
  ObjectScores scores;
  std::map<std::string, uint64_t> runs;
  std::vector<std::string> folders;  // names of folders that --save-tum and --save-zip have written
  std::vector<Estimate> estimates;
  for (const std::string& text : files.folders) estimates.push_back(parse_estimate(text));
  std::vector<std::vector<ObjectLog>> logs;
  for (const Estimate& estimate : estimates) logs.push_back(logs_of(estimate, files));
  name_apart(estimates, logs);
  for (size_t i = 0; i < estimates.size(); ++i) {
    const Estimate& estimate = estimates[i];
    scores.folders.push_back(estimate.path);
    const std::string name = fs::path(estimate.path).lexically_normal().filename().string();
    for (ObjectLog& log : logs[i]) {
      const FrameRate rate = frame_rate(files, log, source);
      scores.rates[log.estimator] = rate;
      camera_motions_to_world(log, source ? source->truth.camera : Trajectory());
      if (!source && !log.motions.empty() && log.poses.empty() && log.true_poses.empty())
        scores.assumed_frames.emplace(log.estimator, log.from_camera ? MotionFrame::camera : log.frame);
      std::vector<DataWarning> found = source ? diagnose_log(log, source->truth) : diagnose_log(log);
      check_plausible(log, rate.hz, found);
      append(found, diagnose_speeds(log, rate.hz));
      append(found, diagnose_frames(log, source ? source->truth.camera : log.true_camera));
      if (source) take_truth(log, source->truth);
      if (found.empty()) found = diagnose_identities(log);  // other mistakes move the positions as well
      if (found.empty()) found = diagnose_disagreement(log);
      note_steps(log, files.identity);
      const uint64_t run = runs[log.estimator]++;
      std::ranges::move(object_records(log, std::string(to_string(files.format)), name, rate.hz, run),
                        std::back_inserter(scores.records));
      std::ranges::move(object_path_errors(log, run), std::back_inserter(scores.paths));
      std::ranges::move(object_consistency(log, run), std::back_inserter(scores.consistency));
      scores.tracks.push_back(object_tracks(log, run));
      if (!files.tum.empty() || !files.zip.empty()) write_objects(log, run + 1, rate.hz, files, folders);
      for (const DataWarning& diagnosis : found) scores.warnings.push_back(diagnosis.text);
      std::ranges::move(found, std::back_inserter(scores.diagnoses));
      std::ranges::move(log.warnings, std::back_inserter(scores.warnings));
    }
  }
  leave_out_repeated_runs(scores);
  if (!source) warn_of_other_truth(scores);
  scores.is_comparison = files.folders.size() > 1 || runs.size() > 1;
  return scores;
}

EgoReference source_reference(const std::string& source, const std::string& data_root, const Json& options,
                              bool every_pose) {
  const std::unique_ptr<Sequence> sequence = open(source, data_root, options);
  const SequenceInfo& info = sequence->info();
  EgoReference reference;
  reference.side.name = source;
  reference.side.format = "source";
  reference.warnings = info.warnings;
  reference.step_floor_m = sequence->truth().camera_step_floor_m;
  reference.floors = info.floor.numbers();
  for (const auto& [frame, pose] : sequence->truth().camera.poses()) {
    if (!every_pose && (frame < info.first_frame || frame > info.last_frame)) continue;
    const auto time = info.times_s.find(frame);
    reference.poses.frames.push_back(frame);
    reference.poses.stamps_s.push_back(time != info.times_s.end() ? time->second : frame / info.rate_hz);
    reference.poses.add(pose);
  }
  if (reference.poses.empty()) fail("{}: has no true camera poses to compare with", source);
  if (!std::is_sorted(reference.poses.stamps_s.begin(), reference.poses.stamps_s.end()))
    fail("{}: its time stamps do not ascend with its frames", source);
  return reference;
}

std::string encode_npy(std::span<const double> values, size_t columns) {
  const std::string shape = columns == 0 ? fmt::format("({},)", values.size())
                                         : fmt::format("({}, {})", values.size() / columns, columns);
  std::string out = npy_header("<f8", shape);
  const size_t at = out.size();
  out.resize(at + values.size_bytes());
  std::memcpy(out.data() + at, values.data(), values.size_bytes());
  return out;
}

void write_evo_result(const std::filesystem::path& path, const EgoResult& result, const EgoOptions& options,
                      const std::string& reference_name) {
  ZipFile zip(path);
  const Json info = {
      {"title", title_of(result, options)},
      {"ref_name", reference_name},
      {"est_name", result.name},
      {"label", fmt::format("{} ({})", options.rpe() ? "RPE" : "APE", unit_of(options.relation))}};
  zip.add("info.json", json_line(info));
  zip.add("stats.json", json_line(to_json(result.statistics)));
  zip.add("error_array.npy", encode_npy(result.errors));
  std::vector<int>
      rows;  // matched rows that the errors belong to; a relative error belongs to its second pose
  for (size_t i = 0; i < result.errors.size(); ++i)
    rows.push_back(result.pairs.empty() ? static_cast<int>(i) : result.pairs[i].second);
  if (!result.estimate.stamps_s.empty()) {
    std::vector<double> stamps, seconds;
    for (const int row : rows) {
      stamps.push_back(result.estimate.stamps_s[static_cast<size_t>(row)]);
      seconds.push_back(stamps.back() - result.estimate.stamps_s[0]);
    }
    zip.add("timestamps.npy", encode_npy(stamps));
    zip.add("seconds_from_start.npy", encode_npy(seconds));
    zip.add("distances_from_start.npy", encode_npy(distances_of(result.reference, rows)));
    zip.add("distances.npy", encode_npy(distances_of(result.estimate, rows)));
  }
  if (options.alignment != Alignment::none) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = result.alignment.ref_from_est.matrix();
    zip.add("alignment_transformation_sim3.npy", encode_npy({m.data(), 16}, 4));
  }
  zip.finish();
}

}  // namespace sextant
