#include "sextant/eval/experiment/run_journal.h"

#include <array>

#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

Json pose_json(const SE3& T) {
  const Eigen::Quaterniond& q = T.rotation();
  const Eigen::Vector3d& t = T.translation();
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

SE3 pose_from(const Json& json) {
  const auto v = json.get<std::array<double, 7>>();
  return SE3::from_parts({v[0], v[1], v[2], v[3]}, {v[4], v[5], v[6]});
}

Json poses_json(const std::map<int, SE3>& poses) {
  Json json = Json::array();
  for (const auto& [frame, pose] : poses) json.push_back({frame, pose_json(pose)});
  return json;
}

Json note_of(const SourceOutcome& outcome) {
  Json objects = Json::array();
  for (const auto& [id, motions] : outcome.motions.objects) objects.push_back({id, poses_json(motions)});
  return {{"starts_at_truth", outcome.motions.starts_at_truth},
          {"camera", poses_json(outcome.motions.estimated.poses())},
          {"objects", objects},
          {"sums", outcome.noise.sums()},
          {"problems", outcome.problems},
          {"inputs", inputs_json(outcome.inputs)}};
}

SourceOutcome outcome_of(const Json& note, std::string_view records) {
  SourceOutcome outcome;
  outcome.records = parse_records(records, "journal");
  outcome.motions.starts_at_truth = note.at("starts_at_truth").get<bool>();
  for (const Json& entry : note.at("camera"))
    outcome.motions.estimated.set(entry.at(0).get<int>(), pose_from(entry.at(1)));
  for (const Json& object : note.at("objects")) {
    std::map<int, SE3>& motions = outcome.motions.objects[object.at(0).get<int>()];
    for (const Json& entry : object.at(1)) motions[entry.at(0).get<int>()] = pose_from(entry.at(1));
  }
  outcome.noise = NoiseVerification::from_sums(note.at("sums"), "journal");
  outcome.problems = note.at("problems").get<std::vector<std::string>>();
  for (const auto& [path, entry] : note.at("inputs").items())
    outcome.inputs[path] = {entry.at("bytes").get<uint64_t>(), entry.at("sha256").get<std::string>()};
  return outcome;
}

}  // namespace

Json inputs_json(const std::map<std::string, InputLog::Entry>& inputs) {
  Json json = Json::object();
  for (const auto& [path, entry] : inputs) json[path] = {{"bytes", entry.bytes}, {"sha256", entry.sha256}};
  return json;
}

bool same_inputs(const Json& inputs) {
  for (const auto& [path, input] : inputs.items()) {
    if (!fs::exists(path) || input.at("sha256") != sha256(read_file(path))) return false;
  }
  return true;
}

RunJournal::RunJournal(fs::path folder, const Json& configuration)
    : path_(std::move(folder) / "unfinished.jsonl"),
      owner_(sha256(json_line({{"run", configuration}, {"program", program_identity()}}))) {
  if (fs::exists(path_)) open();
}

void RunJournal::open() {
  journal_.emplace(path_, owner_, [](uint64_t, std::string_view) { return true; });
}

std::optional<SourceOutcome> RunJournal::find(size_t source) const {
  if (!journal_) return std::nullopt;
  const auto block = journal_->blocks().find(source);
  if (block == journal_->blocks().end() || !same_inputs(block->second.noise.at("inputs"))) return std::nullopt;
  const std::string text = read_file(path_, records_file);
  return outcome_of(block->second.noise,
                    std::string_view(text).substr(block->second.offset, block->second.bytes));
}

void RunJournal::append(size_t source, const SourceOutcome& outcome) {
  if (!journal_) {
    open();
  }
  journal_->append(source, outcome.records.size(), write_records(outcome.records), note_of(outcome));
}

void RunJournal::remove() {
  journal_.reset();
  fs::remove(path_);
}

}  // namespace sextant
