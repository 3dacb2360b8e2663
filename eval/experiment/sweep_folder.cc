#include "sextant/eval/experiment/sweep_folder.h"

#include <map>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/eval/experiment/achieved_noise.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/run_json.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

Json read_plan_file(const fs::path& folder) {
  const Json json = read_json(folder / "plan.json");
  if (!json.is_object() || !json.contains("plan") || !json.contains("shard") || !json.contains("data")) {
    fail("{}: not the plan file of a sweep", (folder / "plan.json").string());
  }
  return json;
}

struct FinishedCase {
  std::string lines;
  uint64_t n_records = 0;
  Json noise;
};

/// Of a finished shard.
std::map<uint64_t, FinishedCase> read_cases(const fs::path& folder) {
  const std::string records = read_file(folder / "records.jsonl", records_file);
  const std::string index = read_file(folder / "cases.jsonl");
  const std::string name = (folder / "cases.jsonl").string();
  std::map<uint64_t, FinishedCase> cases;
  size_t at = 0;
  int line = 0;
  for (const std::string& text : split(index, '\n')) {
    ++line;
    if (text.empty()) continue;
    const Json entry = parse_json(text, name, line);
    const std::string where = fmt::format("{}:{}", name, line);
    const auto number = json_member<uint64_t>(entry, "case", where);
    const auto n_records = json_member<uint64_t>(entry, "records", where);
    size_t end = at;
    for (uint64_t n = n_records; n > 0 && end != std::string::npos; --n) {
      end = records.find('\n', end);
      if (end != std::string::npos) ++end;
    }
    if (end == std::string::npos)
      fail("{}: has fewer records than {} says", (folder / "records.jsonl").string(), name);
    FinishedCase done{records.substr(at, end - at), n_records, entry.value("noise", Json())};
    if (!cases.emplace(number, std::move(done)).second) fail("{}: case {} is there twice", where, number);
    at = end;
  }
  if (at != records.size())
    fail("{}: has more records than {} says", (folder / "records.jsonl").string(), name);
  return cases;
}

}  // namespace

void claim_folder(const fs::path& folder, const Json& wanted, bool replace) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    fail("{}: cannot make the folder for results: {}", folder.string(),
         error ? error.message() : "it is a file");
  }
  if (!fs::exists(folder / "plan.json")) {
    if (fs::exists(folder / "records.jsonl")) {
      fail("{}: holds the records of something else than a sweep; choose another folder", folder.string());
    }
    write_file(folder / "plan.json", json_text(wanted));
    return;
  }
  const Json present = read_plan_file(folder);
  for (const auto& [key, what] : {std::pair{"plan", "another plan"}, std::pair{"shard", "another shard"},
                                  std::pair{"data", "data that have changed since"}}) {
    if (present[key] == wanted[key]) continue;
    if (!replace) {
      fail("{}: holds a sweep of {}; choose another folder, or remove it", folder.string(), what);
    }
    for (const char* file : {"records.jsonl", "cases.jsonl", "run.json", "journal.jsonl"})
      fs::remove(folder / file);
    write_file(folder / "plan.json", json_text(wanted));
    return;
  }
}

void remove_temporaries(const fs::path& folder) {
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    for (const char* file : {"plan.json", "run.json", "cases.jsonl", "records.jsonl"}) {
      if (name.starts_with(fmt::format("{}.tmp", file))) left.push_back(entry.path());
    }
  }
  for (const fs::path& file : left) fs::remove(file);
}

SweepOutcome merge_sweeps(const std::vector<fs::path>& folders, const fs::path& out) {
  if (folders.empty()) fail("merge: no folders given");
  Json plan;
  std::map<uint64_t, FinishedCase> cases;
  for (const fs::path& folder : folders) {
    const Json of_folder = read_plan_file(folder);
    if (plan.is_null()) plan = of_folder;
    if (of_folder["plan"] != plan["plan"] || of_folder["data"] != plan["data"]) {
      fail("{}: holds another plan, or other data, than {}", folder.string(), folders.front().string());
    }
    if (!fs::exists(folder / "records.jsonl") || fs::exists(folder / "journal.jsonl")) {
      fail("{}: its sweep is not finished: give its command again first", folder.string());
    }
    for (auto& [number, done] : read_cases(folder)) {
      if (!cases.emplace(number, std::move(done)).second) {
        fail("{}: case {} is in an earlier folder too: give each shard once", folder.string(), number);
      }
    }
  }
  Json provenance = read_run_json(folders.front());
  const auto n_cases = provenance.value("cases", uint64_t{0});
  double n_planned = 1;
  for (const char* list : {"sources", "estimators", "noise", "seeds"})
    n_planned *= static_cast<double>(json_list(plan["plan"], list, "plan.json").size());
  if (n_planned != static_cast<double>(n_cases))
    fail("{}: its plan has {} cases, run.json says {}", folders.front().string(), n_planned, n_cases);
  for (uint64_t number = 0; number < n_cases; ++number) {
    if (!cases.contains(number)) {
      fail("case {} of {} is in none of the folders: a shard is missing", number, n_cases);
    }
  }
  SweepOutcome outcome;
  outcome.n_cases = cases.size();
  std::string records, index;
  std::map<uint64_t, Json> noise;
  for (const auto& [number, done] : cases) {
    outcome.n_records += done.n_records;
    index += json_line(case_json(number, done.n_records, done.noise)) + "\n";
    records += done.lines;
    noise[number] = done.noise;
  }
  provenance["shard"] = plan["shard"] = {0, 1};
  provenance["noise"] = achieved_noise(plan["plan"], noise);
  provenance["records"] = outcome.n_records;
  check_output_folder(out, provenance["configuration"], /*force=*/false);
  write_output_folder(out, {{"plan.json", json_text(plan)},
                            {"run.json", json_text(provenance)},
                            {"cases.jsonl", index},
                            {"records.jsonl", records}});
  return outcome;
}

}  // namespace sextant
