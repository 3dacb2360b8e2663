#include "sextant/eval/reproduce/reproduce.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/names.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/pictures/pictures.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

std::span<const EmbeddedFile> plan_files();
std::span<const EmbeddedFile> system_files();

namespace {

std::string plan_named(const char* name) { return std::string(find_entry(plan_files(), name, "plan").text); }

/// Makes an experiment with a plan of eval/plans; `data` is the name of the data that it needs.
Part plan_part(const char* name, PartRole role, const char* plan, const char* needs = "",
               const char* data = "") {
  Part part{name, role, "", needs, paper().fetch(data), plan_named(plan)};
  part.title = json_member<std::string>(parse_json(part.plan, plan), "name", plan);
  return part;
}

/// Makes an experiment on the text files of Virtual KITTI, from the folder of the root that contains them.
Part replay_part(const char* name, PartRole role, const char* plan, const std::string& data_root) {
  Part part = plan_part(name, role, plan, "vkitti_1.3.1_text", "vkitti1_text");
  const std::filesystem::path root(data_root);
  if (data_root.empty() || std::filesystem::is_directory(root / part.needs)) return part;
  part.plan = replaced(part.plan, part.needs, "vkitti_1.3.1");
  part.needs = "vkitti_1.3.1";
  return part;
}

}  // namespace

std::vector<Part> reproduction_parts(const std::string& data_root) {
  using enum PartRole;
  std::vector<Part> parts = {
      plan_part("sets", sets, "sets"),
      plan_part("sets_release", sets_paper, "sets_release"),
      plan_part("sets_table", sets_paper, "sets_table"),
      plan_part("sets_text", sets_paper, "sets_text"),
      plan_part("attribution_release", attribution, "attribution_release"),
      plan_part("attribution_draws", attribution, "attribution_draws"),
      plan_part("attribution", attribution, "attribution"),
      plan_part("depth", noise, "depth_s18"),
      plan_part("flow", noise, "flow_s18"),
      plan_part("correlated", noise_correlated, "correlated"),
      plan_part("classification", classification, "classification"),
      {"timing", timing, "run time, scenario s18, one thread", "", "", plan_named("timing")},
      plan_part("showcase", showcase, "showcase"),
      plan_part("demo", real, "demo", "kitti_03_demo", "demo"),
      plan_part("showcase_demo", showcase, "showcase_demo", "kitti_03_demo", "demo"),
      {"recorded", recorded, "recorded trajectories on KITTI tracking", "kitti_tracking_peers",
       paper().fetch("peers"), ""},
      {"recorded_objects", recorded_objects, "DynOSAM's logs of KITTI tracking 0000", "dynosam_kitti_0000",
       paper().fetch("peers"), ""},
      replay_part("sets_replay", sets, "sets_replay", data_root),
      replay_part("sets_release_replay", sets_paper, "sets_release_replay", data_root),
      replay_part("sets_table_replay", sets_paper, "sets_table_replay", data_root),
      replay_part("sets_text_replay", sets_paper, "sets_text_replay", data_root),
      replay_part("attribution_release_replay", attribution, "attribution_release_replay", data_root),
      replay_part("attribution_draws_replay", attribution, "attribution_draws_replay", data_root),
      replay_part("attribution_replay", attribution, "attribution_replay", data_root),
      replay_part("depth_replay", noise, "depth_vkitti18", data_root),
      replay_part("flow_replay", noise, "flow_vkitti18", data_root),
      replay_part("classification_replay", classification, "classification_replay", data_root),
      plan_part("sets_vkitti1", sets, "sets_vkitti1", "vkitti_1.3.1", "vkitti1"),
      plan_part("classification_vkitti1", classification, "classification_vkitti1", "vkitti_1.3.1",
                "vkitti1"),
      plan_part("sets_vkitti2", sets, "sets_vkitti2", "vkitti_2.0.3", "vkitti2"),
      plan_part("classification_vkitti2", classification, "classification_vkitti2", "vkitti_2.0.3",
                "vkitti2"),
      {"systems_sets", sets, "published systems on the three sets", "", "", "", "sets"},
      {"systems_depth", systems_noise, "published systems under depth noise, scenario s18", "", "", "",
       "depth"},
      {"systems_demo", real, "published systems on the authors' sample of KITTI tracking 0003",
       "kitti_03_demo", paper().fetch("demo"), "", "demo"},
      {"systems_run", systems, "published systems and ours in one run", "", "", "", "sets"},
  };
  for (const std::string& sequence : recorded_sequences()) {
    Part& part = parts.emplace_back(plan_part("kitti", real, "kitti", "kitti_tracking", "kitti"));
    part.name += "_" + sequence;
    part.title = replaced(part.title, "SEQUENCE", sequence);
    part.plan = replaced(part.plan, "SEQUENCE", sequence);
  }
  return parts;
}

std::string what_is_missing(const Part& part, const std::string& data_root) {
  if (part.needs.empty()) return "";
  if (data_root.empty()) return "no data folder given (--data ROOT or SEXTANT_DATA)";
  if (!std::filesystem::is_directory(std::filesystem::path(data_root) / part.needs))
    return fmt::format("ROOT has no folder {}", part.needs);
  if (part.plan.empty()) return "";
  try {
    for (const SourceSpec& spec : parse_plan(part.plan, part.name, data_root).sources)
      check_runnable(spec, *open_source(spec));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

namespace {

struct Recording {
  const RecordedSystem* system;
  std::string sequence;
  std::string path;
};

std::vector<Recording> recordings_in(const fs::path& root) {
  std::vector<Recording> found;
  for (const RecordedSystem& system : recorded_systems()) {
    for (const std::string& sequence : recorded_sequences()) {
      const fs::path path = root / "kitti_tracking_peers" / system.folder / (sequence + system.extension);
      if (fs::exists(path)) found.push_back({&system, sequence, path.string()});
    }
  }
  if (found.empty())
    fail("{}: holds no trajectory of a known name: expected files such as orbslam3_camera/0003.txt",
         (root / "kitti_tracking_peers").string());
  return found;
}

EgoReference truth_of(const Recording& recording, const std::string& data_root, const char* velocity) {
  return source_reference("kitti:kitti_tracking#" + recording.sequence, data_root,
                          {{"source", {{"velocity", velocity}}}}, /*every_pose=*/true);
}

EgoResult evaluate(const Recording& recording, const EgoReference& truth, Alignment alignment) {
  EgoOptions options;
  options.alignment = alignment;
  return evaluate_ego(truth, read_trajectory(recording.path, recording.system->format), recording.path,
                      options);
}

std::vector<Record> records_of(const Recording& recording, const EgoResult& raw, const EgoResult& corrected,
                               const EgoResult& scaled, const EgoReference& truth) {
  std::vector<Record> records;
  for (size_t i = 0; i < raw.per_frame.row.size(); ++i) {
    const auto row = static_cast<size_t>(raw.per_frame.row[i]);
    Record record;
    record.dataset = "kitti";
    record.sequence = recording.sequence;
    record.estimator = recording.system->name;
    record.frame = truth.poses.frames[row];
    record.body = "ego";
    record.errors = {{"Et_m", raw.per_frame.Et_m[i]},
                     {"ER_deg", raw.per_frame.ER_deg[i]},
                     {"Et_corrected_m", corrected.per_frame.Et_m[i]},
                     {"Et_scaled_m", scaled.per_frame.Et_m[i]}};
    record.values["step_gt_m"] = (truth.poses.positions_m[row] - truth.poses.positions_m[row - 1]).norm();
    if (truth.step_floor_m) record.values["step_floor_m"] = *truth.step_floor_m;
    record.values.insert(truth.floors.begin(), truth.floors.end());
    records.push_back(std::move(record));
  }
  return records;
}

// Folder of DynOSAM's logs below the root, and the sequence of KITTI tracking that was logged.
constexpr const char* object_logs = "dynosam_kitti_0000";
constexpr const char* object_sequence = "0000";

/// Adds path -> SHA-256 of the files of ROOT/kitti_tracking that have the truth of a sequence.
void add_truth_files(const std::string& data_root, const std::string& sequence,
                     std::initializer_list<const char*> folders, Json& inputs) {
  for (const char* folder : folders) {
    const fs::path path = fs::path(data_root) / "kitti_tracking" / "training" / folder / (sequence + ".txt");
    if (fs::exists(path)) inputs[path.string()] = sha256(read_file(path));
  }
}

std::string stem_of_recording(const Recording& recording) {
  return fmt::format("{}_{}", recording.system->folder, recording.sequence);
}

}  // namespace

std::span<const RecordedSystem> recorded_systems() {
  static constexpr RecordedSystem systems[] = {
      {"ORB-SLAM3", "orbslam3_camera", ".txt", "kitti"},
      {"VDO-SLAM front end", "vdo_slam_frontend", ".xml", "vdo_xml"}};
  return systems;
}

const std::vector<std::string>& recorded_sequences() {
  static const std::vector<std::string> sequences = {"0000", "0001", "0002", "0003", "0004",
                                                     "0005", "0006", "0018", "0020"};
  return sequences;
}

namespace {

// ---- Recorded camera trajectories of other systems on KITTI tracking, converted to records: the paper's
// pose change error against the truth for each frame pair.
//
//   ROOT/kitti_tracking                                     truth (text is enough)
//   ROOT/kitti_tracking_peers/orbslam3_camera/0003.txt      KITTI format
//   ROOT/kitti_tracking_peers/vdo_slam_frontend/0000.xml    VDO-SLAM's log
//
//   errors.Et_m, ER_deg        against the raw truth
//   errors.Et_corrected_m      against the truth with velocity-corrected step lengths
//   errors.Et_scaled_m         raw truth, the estimate scaled to the truth's size (Umeyama, scale only)
//   values.step_gt_m, step_floor_m, and other floors of the truth

/// Returns the files that evaluate_recorded() would read, as path -> SHA-256. Throws Error if there is no
/// trajectory.
Json recorded_inputs(const std::string& data_root) {
  Json inputs = Json::object();
  for (const Recording& recording : recordings_in(data_root)) {
    inputs[recording.path] = sha256(read_file(recording.path));
    add_truth_files(data_root, recording.sequence, {"oxts", "calib"}, inputs);
  }
  return inputs;
}

/// Returns records.jsonl, run.json, and for each system and sequence
/// <system>_<sequence>_{reference,estimate}.tum.
OutputFiles evaluate_recorded(const std::string& data_root) {
  OutputFiles files;
  std::vector<Record> records;
  Json warnings = Json::object();
  for (const Recording& recording : recordings_in(data_root)) {
    check_interrupt();
    const EgoReference truth = truth_of(recording, data_root, "raw");
    const EgoResult raw = evaluate(recording, truth, Alignment::none);
    const EgoResult corrected =
        evaluate(recording, truth_of(recording, data_root, "velocity_corrected"), Alignment::none);
    const EgoResult scaled = evaluate(recording, truth, Alignment::scale);
    SEXTANT_CHECK(raw.per_frame.row == corrected.per_frame.row && raw.per_frame.row == scaled.per_frame.row);
    for (Record& record : records_of(recording, raw, corrected, scaled, truth))
      records.push_back(std::move(record));
    files[stem_of_recording(recording) + "_reference.tum"] = encode_tum(raw.reference);
    files[stem_of_recording(recording) + "_estimate.tum"] = encode_tum(raw.estimate);
    for (const DataWarning& warning : raw.warnings) warnings[recording.path].push_back(warning.text);
  }
  check_listed(records);
  files["records.jsonl"] = write_records(records);
  Json run = build_provenance();
  run["inputs"] = recorded_inputs(data_root);
  run["warnings"] = warnings;
  files["run.json"] = json_text(run);
  return files;
}

// ---- Recorded object motions: DynOSAM's logs of a sequence of KITTI tracking, in ROOT/dynosam_kitti_0000.
// The truth comes from the data set; the errors are computed as by `sextant evaluate objects`.

/// Returns the files that evaluate_recorded_objects() would read, as path -> SHA-256.
Json recorded_object_inputs(const std::string& data_root) {
  Json inputs = Json::object();
  for (const auto& entry : fs::directory_iterator(fs::path(data_root) / object_logs))
    if (entry.path().extension() == ".csv") inputs[entry.path().string()] = sha256(read_file(entry.path()));
  add_truth_files(data_root, object_sequence, {"oxts", "calib", "label_02"}, inputs);
  return inputs;
}

/// Returns records.jsonl and run.json. The estimators are called "DynOSAM front end" and "DynOSAM back end".
OutputFiles evaluate_recorded_objects(const std::string& data_root) {
  ObjectFiles logs{.folders = {(fs::path(data_root) / object_logs).string()}, .format = LogFormat::dynosam};
  logs.truth = fmt::format("kitti:kitti_tracking#{}", object_sequence);
  logs.data_root = data_root;
  ObjectScores scores = evaluate_object_files(logs);
  for (Record& record : scores.records) {
    record.dataset = "kitti";
    record.sequence = object_sequence;
    record.estimator = record.estimator == "frontend" ? "DynOSAM front end" : "DynOSAM back end";
  }
  Json run = build_provenance();
  run["inputs"] = recorded_object_inputs(data_root);
  run["warnings"] = scores.warnings;
  return {{"records.jsonl", write_records(scores.records)}, {"run.json", json_text(run)}};
}

using FrameKey = std::tuple<std::string, std::string, int, std::string>;

FrameKey frame_key(const Record& r) { return {r.dataset, r.sequence, r.frame, r.body}; }

std::map<FrameKey, Record::Numbers> truth_values(const std::vector<Record>& records) {
  std::map<FrameKey, Record::Numbers> truth;
  for (const Record& record : records) {
    Record::Numbers& values = truth[frame_key(record)];
    for (const auto& [key, value] : record.values) {
      if (key.str().find("_gt") != std::string::npos)
        values.emplace(key, value);  // the truth does not depend on the estimator
    }
  }
  return truth;
}

std::string embedded_text(const std::string& name) {
  return std::string(find_entry(system_files(), name, "file of results/systems").text);
}

}  // namespace

OutputFiles stored_files(const std::string& part, const std::filesystem::path& beside) {
  if (!std::filesystem::exists(beside / "records.jsonl"))
    fail("{}: has no records.jsonl: experiment {} takes the truth of its frames from this file",
         beside.string(), part);
  const auto truth = truth_values(read_records(beside / "records.jsonl"));
  const std::string name = part + "/records.jsonl";
  std::vector<Record> records;
  for (Record& record : parse_records(embedded_text(name), "results/systems/" + name)) {
    const auto of_frame = truth.find(frame_key(record));
    if (of_frame == truth.end()) continue;
    record.values.insert(of_frame->second.begin(), of_frame->second.end());
    records.push_back(std::move(record));
  }
  return {{"records.jsonl", write_records(records)}, {"run.json", embedded_text(part + "/run.json")}};
}

namespace {

/// Returns the SHA-256 of the program's file: results depend on the program, the plan and the data.
std::string program_id() {
  static const std::string id = sha256(read_file("/proc/self/exe"));
  return id;
}

/// File of an experiment that records the program and, unless a sweep keeps track of them, the inputs.
constexpr const char* stamp_name = "part.json";

Json stamp_of(const Part& part, const ReproduceConfig& config) {
  Json stamp = {{"program", program_id()}, {"plan", part.plan}};
  if (part.role == PartRole::recorded) stamp["inputs"] = recorded_inputs(config.data_root);
  if (part.role == PartRole::recorded_objects) stamp["inputs"] = recorded_object_inputs(config.data_root);
  if (part.is_stored()) {
    const fs::path truth = config.out / "parts" / part.beside / "records.jsonl";
    stamp["truth"] = fs::exists(truth) ? sha256(read_file(truth)) : "";
  }
  return stamp;
}

bool has_stamp(const fs::path& folder, const Json& stamp) {
  if (!fs::exists(folder / stamp_name)) return false;
  return try_parse_json(read_file(folder / stamp_name, json_file)) == stamp;
}

void run_sweep_part(const Part& part, const ReproduceConfig& config, const fs::path& folder) {
  SweepConfig sweep_config;
  sweep_config.plan = parse_plan(part.plan, part.name, config.data_root);
  sweep_config.out = folder;
  sweep_config.cache = config.cache;
  sweep_config.jobs = config.jobs;
  sweep_config.quiet = config.quiet;
  sweep_config.replace = true;
  sweep(sweep_config);
}

/// Returns true if the files that a run has read are unchanged according to its run.json.
bool read_the_same(const fs::path& folder) {
  try {
    return std::ranges::all_of(
        json_list(read_run_json(folder), "sources", "run.json"),
        [](const Json& source) { return same_inputs(json_object(source, "inputs", "run.json")); });
  } catch (const Error&) {
    return false;  // damaged: run again
  }
}

/// Runs an experiment whose files are all written at once, unless its records exist and the files that it
/// read are unchanged.
void run_whole_part(const fs::path& folder, const std::function<OutputFiles()>& make) {
  if (!fs::exists(folder / "records.jsonl") || !read_the_same(folder)) write_output_folder(folder, make());
}

OutputFiles make_showcase_part(const Part& part, const ReproduceConfig& config) {
  const Plan plan = parse_plan(part.plan, part.name, config.data_root);
  ShowcaseRequest request;
  request.source = plan.sources.front();
  request.frame = open_source(request.source)->info().last_frame;
  request.estimator = plan.estimators.front().name;
  request.jobs = config.jobs;
  request.quiet = config.quiet;
  return showcase_files(request);
}

/// Runs the estimators one after the other on one thread, so that stages do not share cores.
OutputFiles time_estimators(const Part& part, const ReproduceConfig& config) {
  const Plan plan = parse_plan(part.plan, part.name, config.data_root);
  OutputFiles files;
  std::string records;
  for (const PlanEstimator& estimator : plan.estimators) {
    RunConfig run_config{.sources = plan.sources, .estimator = estimator.name};
    run_config.options = {{"estimator", estimator.options}};
    run_config.jobs = 1;
    run_config.quiet = config.quiet;
    const RunResult result = run(run_config);
    records += write_records(result.records);
    files["run.json"] = json_text(run_provenance(result));
  }
  files["records.jsonl"] = std::move(records);
  return files;
}

void run_part(const Part& part, const ReproduceConfig& config, const fs::path& folder) {
  if (part.is_stored())
    return write_output_folder(folder, stored_files(part.name, config.out / "parts" / part.beside));
  switch (part.role) {
    case PartRole::recorded:
      return run_whole_part(folder, [&] { return evaluate_recorded(config.data_root); });
    case PartRole::recorded_objects:
      return run_whole_part(folder, [&] { return evaluate_recorded_objects(config.data_root); });
    case PartRole::timing:
      return run_whole_part(folder, [&] { return time_estimators(part, config); });
    case PartRole::showcase:
      return run_whole_part(folder, [&] { return make_showcase_part(part, config); });
    default:
      return run_sweep_part(part, config, folder);
  }
}

/// Progress on standard error: for each experiment a line "[3/9] flow noise, scenario s18" and, when it has
/// ended, a line "4.1 s; 6 experiments left, about 25 s".
class PartLines {
 public:
  PartLines(size_t n, bool quiet) : n_(n), quiet_(quiet) {}

  void begin(const Part& part, bool finished) {
    ++at_;
    start_ = Clock::now();
    name_ = part.name;
    if (quiet_) return;
    print_error(fmt::format("[{}/{}] {}{}\n", at_, n_, part.title, finished ? " (finished before)" : ""));
  }
  void end() {
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    total_s_ += seconds;
    times_.emplace_back(seconds, name_);
    if (quiet_) return;
    const size_t left = n_ - at_;
    const double left_s = total_s_ / static_cast<double>(at_) * static_cast<double>(left);
    print_error(fmt::format("      {:.1f} s", seconds));
    if (left > 0)
      print_error(fmt::format("; {} experiment{} left, about {:.0f} s", left, left == 1 ? "" : "s", left_s));
    print_error("\n");
  }

  /// Prints the experiments that took longest.
  void summary() {
    constexpr size_t most = 8;
    constexpr double worth_reporting_s = 0.5;
    std::ranges::stable_sort(times_, std::greater(), &std::pair<double, std::string>::first);
    std::string text;
    for (size_t i = 0; i < std::min(most, times_.size()) && times_[i].first >= worth_reporting_s; ++i)
      text += fmt::format("{}{} {:.1f} s", i > 0 ? ", " : "", times_[i].second, times_[i].first);
    if (!quiet_ && !text.empty())
      print_error(fmt::format("{} experiments in {:.1f} s: {}\n", at_, total_s_, text));
  }

 private:
  using Clock = std::chrono::steady_clock;
  size_t n_, at_ = 0;
  bool quiet_;
  std::string name_;
  std::vector<std::pair<double, std::string>> times_;
  double total_s_ = 0;
  Clock::time_point start_;
};

}  // namespace

void run_parts(const ReproduceConfig& config) {
  const FolderLock lock(config.out);
  Json data = Json::array();
  std::vector<const Part*> available;
  for (const Part& part : config.parts) {
    const std::string missing = what_is_missing(part, config.data_root);
    data.push_back({{"part", part.name},
                    {"title", part.title},
                    {"missing", missing},
                    {"needs", part.needs},
                    {"fetch", part.fetch}});
    if (missing.empty()) available.push_back(&part);
    if (!missing.empty()) fs::remove_all(config.out / "parts" / part.name);
  }
  write_file(config.out / "data.json", json_text(data));
  PartLines lines(available.size(), config.quiet);
  for (const Part* part : available) {
    const fs::path folder = make_folder_below(config.out, fs::path("parts") / part->name);
    const Json stamp = stamp_of(*part, config);
    lines.begin(*part, has_stamp(folder, stamp) && fs::exists(folder / "records.jsonl") &&
                           !fs::exists(folder / "journal.jsonl"));
    if (!has_stamp(folder, stamp)) {  // written by another program or from other inputs
      fs::remove_all(folder);
      make_folder_below(config.out, fs::path("parts") / part->name);
      write_file(folder / stamp_name, json_text(stamp));
    }
    run_part(*part, config, folder);
    lines.end();
  }
  lines.summary();
}

}  // namespace sextant
