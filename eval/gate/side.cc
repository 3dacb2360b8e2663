#include "sextant/eval/gate/side.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

std::string case_name(const Subject& s, const SeedFrame& at) {
  return fmt::format("{} {} {} noise '{}' level {} seed {} frame {} {}", s.dataset, s.sequence, s.estimator,
                     s.noise, s.level, at.first, at.second, s.body);
}

RunFolder read_run(const fs::path& folder) {
  RunFolder run;
  run.path = folder.string();
  if (fs::exists(folder / "journal.jsonl")) {
    fail("{}: its sweep is not finished: run its command again to resume it", run.path);
  }
  const std::string file = (folder / "records.jsonl").string();
  SubjectCollector collector;
  for_each_record(folder / "records.jsonl",
                  [&](const Record& record) { collector.add(record, ++run.n_cases); });
  if (run.n_cases == 0) fail("{}: has no records", file);
  run.has_times = collector.has_times();
  run.subjects = collector.take();
  for (const SubjectCases& cases : run.subjects) {
    for (size_t row = 1; row < cases.size(); ++row) {
      if (cases.case_of(row) == cases.case_of(row - 1))
        fail("{}: the case '{}' occurs twice", file, case_name(cases.subject, cases.case_of(row)));
    }
  }
  if (!fs::exists(folder / "run.json")) return run;
  run.provenance = read_run_json(folder);
  return run;
}

/// Reads the results that lie directly in `folder`.
void read_folder(const fs::path& folder, Side& side) {
  if (has_results(folder) || fs::exists(folder / "journal.jsonl")) {
    side.runs.push_back(read_run(folder));
  }
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (is_benchmark_file(entry)) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (const fs::path& file : files)
    side.benchmarks.push_back(parse_benchmark_file(read_file(file, json_file), file.string()));
}

bool is_empty(const Side& side) { return side.runs.empty() && side.benchmarks.empty(); }

}  // namespace

bool is_benchmark_file(const fs::directory_entry& entry) {
  return entry.is_regular_file() && entry.path().filename().string().starts_with("benchmark") &&
         entry.path().extension() == ".json";
}

Side read_side(const fs::path& path) {
  Side side;
  side.path = path.string();
  if (!fs::exists(path)) fail("{}: does not exist: expected results to compare", side.path);
  if (path.extension() == ".jsonl") {
    fail("{}: expected the folder of this file, whose run.json describes the records", side.path);
  }
  if (fs::is_regular_file(path)) {
    side.benchmarks.push_back(parse_benchmark_file(read_file(path, json_file), side.path));
    return side;
  }
  read_folder(path, side);
  if (!is_empty(side)) return side;
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    if (entry.is_directory()) folders.push_back(entry.path());
  }
  std::ranges::sort(folders);
  for (const fs::path& folder : folders) read_folder(folder, side);
  if (is_empty(side)) {
    fail("{}: holds no results: expected records.jsonl, benchmark*.json, or folders with these", side.path);
  }
  return side;
}

OutputFiles baseline_files(const std::filesystem::path& run) {
  const Side side = read_side(run);
  if (side.runs.size() != 1) {
    fail("{}: holds {} runs: expected one folder of `sextant run` or `sextant sweep`", side.path,
         side.runs.size());
  }
  const std::filesystem::path folder = side.runs.front().path;
  // Records are written in the order of the file, which is the order of the cases of the run.
  std::vector<Record> records = read_records(folder / "records.jsonl");
  for (Record& record : records) record = strip_times(std::move(record));
  OutputFiles files = {{"records.jsonl", write_records(records)}};
  if (std::filesystem::exists(folder / "run.json")) files["run.json"] = read_file(folder / "run.json");
  return files;
}

}  // namespace sextant
