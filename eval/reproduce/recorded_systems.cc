// Results of other systems as records: recorded trajectories and object motions, which are evaluated here,
// and errors of published systems that were measured once and come with the program.

#include <algorithm>
#include <filesystem>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/names.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/reproduce/reproduce.h"

namespace sextant {

std::span<const EmbeddedFile> system_files();

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
