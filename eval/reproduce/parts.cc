#include "sextant/eval/reproduce/parts.h"

#include <filesystem>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/names.h"
#include "sextant/base/text.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

std::span<const EmbeddedFile> plan_files();

namespace {

/// Makes an experiment with a plan of eval/plans.
Part plan_part(const char* name, PartRole role, const char* plan, const char* needs = "",
               const std::string& fetch = "") {
  Part part{name, role, "", needs, fetch, std::string(find_entry(plan_files(), plan, "plan").text)};
  part.title = json_member<std::string>(parse_json(part.plan, plan), "name", plan);
  return part;
}

/// Makes an experiment on the text files of Virtual KITTI, from the folder of the root that contains them.
Part replay_part(const char* name, PartRole role, const char* plan, const std::string& data_root) {
  Part part = plan_part(name, role, plan, "vkitti_1.3.1_text", paper().fetch("vkitti1_text"));
  const std::filesystem::path root(data_root);
  if (data_root.empty() || std::filesystem::is_directory(root / part.needs)) return part;
  part.plan = replaced(part.plan, part.needs, "vkitti_1.3.1");
  part.needs = "vkitti_1.3.1";
  return part;
}

}  // namespace

std::vector<Part> reproduction_parts(const std::string& data_root) {
  std::vector<Part> parts = {
      plan_part("sets", PartRole::sets, "sets"),
      plan_part("sets_release", PartRole::sets_paper, "sets_release"),
      plan_part("sets_table", PartRole::sets_paper, "sets_table"),
      plan_part("sets_text", PartRole::sets_paper, "sets_text"),
      plan_part("attribution_release", PartRole::attribution, "attribution_release"),
      plan_part("attribution_draws", PartRole::attribution, "attribution_draws"),
      plan_part("attribution", PartRole::attribution, "attribution"),
      plan_part("depth", PartRole::noise, "depth_s18"),
      plan_part("flow", PartRole::noise, "flow_s18"),
      plan_part("correlated", PartRole::noise_correlated, "correlated"),
      plan_part("classification", PartRole::classification, "classification"),
      {"timing", PartRole::timing, "run time, scenario s18, one thread", "", "",
       std::string(find_entry(plan_files(), "timing", "plan").text)},
      plan_part("showcase", PartRole::showcase, "showcase"),
      plan_part("demo", PartRole::real, "demo", "kitti_03_demo", paper().fetch("demo")),
      plan_part("showcase_demo", PartRole::showcase, "showcase_demo", "kitti_03_demo", paper().fetch("demo")),
      {"recorded", PartRole::recorded, "recorded trajectories on KITTI tracking", "kitti_tracking_peers",
       paper().fetch("peers"), ""},
      {"recorded_objects", PartRole::recorded_objects, "DynOSAM's logs of KITTI tracking 0000",
       "dynosam_kitti_0000", paper().fetch("peers"), ""},
      replay_part("sets_replay", PartRole::sets, "sets_replay", data_root),
      replay_part("sets_release_replay", PartRole::sets_paper, "sets_release_replay", data_root),
      replay_part("sets_table_replay", PartRole::sets_paper, "sets_table_replay", data_root),
      replay_part("sets_text_replay", PartRole::sets_paper, "sets_text_replay", data_root),
      replay_part("attribution_release_replay", PartRole::attribution, "attribution_release_replay",
                  data_root),
      replay_part("attribution_draws_replay", PartRole::attribution, "attribution_draws_replay", data_root),
      replay_part("attribution_replay", PartRole::attribution, "attribution_replay", data_root),
      replay_part("depth_replay", PartRole::noise, "depth_vkitti18", data_root),
      replay_part("flow_replay", PartRole::noise, "flow_vkitti18", data_root),
      replay_part("classification_replay", PartRole::classification, "classification_replay", data_root),
      plan_part("sets_vkitti1", PartRole::sets, "sets_vkitti1", "vkitti_1.3.1", paper().fetch("vkitti1")),
      plan_part("classification_vkitti1", PartRole::classification, "classification_vkitti1", "vkitti_1.3.1",
                paper().fetch("vkitti1")),
      plan_part("sets_vkitti2", PartRole::sets, "sets_vkitti2", "vkitti_2.0.3", paper().fetch("vkitti2")),
      plan_part("classification_vkitti2", PartRole::classification, "classification_vkitti2", "vkitti_2.0.3",
                paper().fetch("vkitti2")),
      {"systems_sets", PartRole::sets, "published systems on the three sets", "", "", "", "sets"},
      {"systems_depth", PartRole::systems_noise, "published systems under depth noise, scenario s18", "", "",
       "", "depth"},
      {"systems_demo", PartRole::real, "published systems on the authors' sample of KITTI tracking 0003",
       "kitti_03_demo", paper().fetch("demo"), "", "demo"},
      {"systems_run", PartRole::systems, "published systems and ours in one run", "", "", "", "sets"},
  };
  for (const std::string& sequence : recorded_sequences()) {
    Part& part = parts.emplace_back(
        plan_part("kitti", PartRole::real, "kitti", "kitti_tracking", paper().fetch("kitti")));
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

Json recorded_inputs(const std::string& data_root) {
  Json inputs = Json::object();
  for (const Recording& recording : recordings_in(data_root)) {
    inputs[recording.path] = sha256(read_file(recording.path));
    add_truth_files(data_root, recording.sequence, {"oxts", "calib"}, inputs);
  }
  return inputs;
}

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

Json recorded_object_inputs(const std::string& data_root) {
  Json inputs = Json::object();
  for (const auto& entry : fs::directory_iterator(fs::path(data_root) / object_logs))
    if (entry.path().extension() == ".csv") inputs[entry.path().string()] = sha256(read_file(entry.path()));
  add_truth_files(data_root, object_sequence, {"oxts", "calib", "label_02"}, inputs);
  return inputs;
}

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

std::span<const EmbeddedFile> system_files();

namespace {

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

}  // namespace sextant
