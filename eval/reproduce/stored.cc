#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/reproduce/parts.h"

#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/record.h"

namespace sextant {

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
  for (const EmbeddedFile& file : system_files()) {
    if (file.name == name) return std::string(file.text);
  }
  fail("there is no file '{}' in results/systems", name);
}

}  // namespace

OutputFiles stored_files(const std::string& part, const std::filesystem::path& beside) {
  if (!std::filesystem::exists(beside / "records.jsonl"))
    fail("{}: no records.jsonl: experiment {} needs it", beside.string(), part);
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
