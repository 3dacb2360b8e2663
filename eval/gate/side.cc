#include "sextant/eval/gate/side.h"

#include <algorithm>

#include "sextant/base/files.h"
#include "sextant/eval/records/run_json.h"
#include "sextant/eval/records/summary_file.h"

namespace sextant {
namespace {

template <typename T>
int three_way(const T& a, const T& b) {
  return a < b ? -1 : (b < a ? 1 : 0);
}

std::string case_name(const Record& r) {
  return fmt::format("{} {} {} noise '{}' level {} seed {} frame {} {}", r.dataset, r.sequence, r.estimator,
                     r.noise, r.level, r.seed, r.frame, r.body);
}

/// Each record is moved once; a record is a few hundred bytes.
std::vector<Record> in_order(std::vector<Record> records) {
  const auto rises = [](const Record& a, const Record& b) { return compare_cases(a, b) < 0; };
  if (std::ranges::is_sorted(records, rises)) return records;
  std::vector<const Record*> order;
  for (const Record& record : records) order.push_back(&record);
  std::ranges::sort(order, [](const Record* a, const Record* b) { return compare_cases(*a, *b) < 0; });
  std::vector<Record> sorted;
  sorted.reserve(records.size());
  for (const Record* record : order)
    sorted.push_back(std::move(records[static_cast<size_t>(record - records.data())]));
  return sorted;
}

/// Errors are magnitudes. Beyond the largest one sums of squares overflow.
void check_errors(const std::vector<Record>& records, const std::string& file) {
  constexpr double largest = 1e100;
  for (const Record& r : records) {
    for (const auto& [key, value] : r.errors) {
      if (value < 0 || value > largest)
        fail("{}: {}: error {} = {}: expected 0 .. {}", file, case_name(r), key, value, largest);
    }
  }
}

RunFolder read_run(const fs::path& folder) {
  RunFolder run;
  run.path = folder.string();
  if (fs::exists(folder / "journal.jsonl")) {
    fail("{}: its sweep is not finished: give its command again first", run.path);
  }
  run.records = in_order(read_records(folder / "records.jsonl"));
  const std::string file = (folder / "records.jsonl").string();
  if (run.records.empty()) fail("{}: has no records", file);
  const auto twice = std::ranges::adjacent_find(
      run.records, [](const Record& a, const Record& b) { return compare_cases(a, b) == 0; });
  if (twice != run.records.end()) {
    fail("{}: the case '{}' is there twice", file, case_name(*twice));
  }
  check_errors(run.records, file);
  if (!fs::exists(folder / "run.json")) return run;
  run.provenance = read_run_json(folder);
  return run;
}

bool is_benchmark_file(const fs::directory_entry& entry) {
  return entry.is_regular_file() && entry.path().filename().string().starts_with("benchmark") &&
         entry.path().extension() == ".json";
}

/// What lies in `folder` itself.
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

int compare_subjects(const Record& a, const Record& b) {
  if (const int c = three_way(a.dataset, b.dataset)) return c;
  if (const int c = three_way(a.sequence, b.sequence)) return c;
  if (const int c = three_way(a.estimator, b.estimator)) return c;
  if (const int c = three_way(a.level, b.level)) return c;
  if (const int c = three_way(a.noise, b.noise)) return c;
  if (const int c = three_way(a.body.str().size(), b.body.str().size()))
    return c;  // object:2 before object:10
  return three_way(a.body, b.body);
}

int compare_cases(const Record& a, const Record& b) {
  if (const int c = compare_subjects(a, b)) return c;
  if (const int c = three_way(a.seed, b.seed)) return c;
  return three_way(a.frame, b.frame);
}

Side read_side(const fs::path& path) {
  Side side;
  side.path = path.string();
  if (!fs::exists(path)) fail("{}: is not there: expected results to compare", side.path);
  if (path.extension() == ".jsonl") {
    fail("{}: expected its folder: run.json there says what the records are of", side.path);
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

}  // namespace sextant
