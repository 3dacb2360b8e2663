#include "sextant/eval/experiment/sweep_folder.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/json.h"
#include "sextant/eval/experiment/noise_of_cases.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/run_json.h"

namespace sextant {
namespace {

/// "0.1.0 (commit abc)".
std::string program_text(const Json& programs) {
  if (!programs.is_array() || programs.empty()) return "unknown";
  const Json& first = programs.front();
  return fmt::format("{} (commit {})", first.value("version", "?"), first.value("git_commit", "?").substr(0, 12));
}

/// A finished shard, read from its first case to its last.
class ShardReader {
 public:
  explicit ShardReader(const fs::path& folder)
      : folder_(folder), index_(folder / "cases.jsonl"), records_(folder / "records.jsonl") {
    if (!index_) fail("{}: cannot open", (folder / "cases.jsonl").string());
    if (!records_) fail("{}: cannot open", (folder / "records.jsonl").string());
  }

  struct Entry {
    uint64_t number = 0;
    uint64_t n_records = 0;
    Json noise;
  };

  /// The next line of cases.jsonl, whose numbers rise; nothing at its end.
  std::optional<Entry> next_case() {
    for (std::string text; std::getline(index_, text);) {
      ++line_;
      if (text.empty()) continue;
      const std::string name = (folder_ / "cases.jsonl").string();
      const Json json = parse_json(text, name, line_);
      const std::string where = fmt::format("{}:{}", name, line_);
      const auto number = json_member<uint64_t>(json, "case", where);
      if (last_ && number == *last_) fail("{}: case {} is there twice", where, number);
      if (last_ && number < *last_) fail("{}: case {} stands after case {}", where, number, *last_);
      last_ = number;
      return Entry{number, json_member<uint64_t>(json, "records", where), json.value("noise", Json())};
    }
    return std::nullopt;
  }

  /// Appends the next lines of records.jsonl.
  void take_records(uint64_t n, std::string& lines) {
    std::string line;
    for (; n > 0; --n) {
      if (!std::getline(records_, line) || records_.eof()) fail_count("fewer");
      lines += line;
      lines += '\n';
    }
  }
  void expect_end() {
    if (records_.peek() != std::char_traits<char>::eof()) fail_count("more");
  }

 private:
  [[noreturn]] void fail_count(const char* what) const {
    fail("{}: has {} records than {} says", (folder_ / "records.jsonl").string(), what,
         (folder_ / "cases.jsonl").string());
  }

  fs::path folder_;
  std::ifstream index_, records_;
  int line_ = 0;
  std::optional<uint64_t> last_;
};

/// What the merged run.json keeps of a shard's.
Json shard_provenance(const Json& plan, const Json& run) {
  Json json = {{"shard", plan["shard"]}};
  for (const char* key : {"version", "git_commit", "compiler", "flags", "packages", "machine", "programs", "records"})
    if (run.contains(key)) json[key] = run[key];
  return json;
}

}  // namespace

Json read_plan_file(const fs::path& folder) {
  const Json json = read_json(folder / "plan.json");
  if (!json.is_object() || !json.contains("plan") || !json.contains("shard") || !json.contains("data")) {
    fail("{}: not the plan file of a sweep", (folder / "plan.json").string());
  }
  return json;
}

uint64_t planned_cases(const Json& plan, const std::string& where) {
  uint64_t n = 1;
  for (const char* list : {"sources", "estimators", "noise", "seeds"}) {
    const size_t size = json_list(plan, list, where).size();
    if (size > max_plan_cases || (n *= size) > max_plan_cases)
      fail("{}: its plan has more than {} cases", where, max_plan_cases);
  }
  return n;
}

Json claim_folder(const fs::path& folder, const Json& wanted, bool replace, bool allow_mixed) {
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
    return wanted;
  }
  Json present = read_plan_file(folder);
  for (const auto& [key, what] : {std::pair{"plan", "another plan"}, std::pair{"shard", "another shard"},
                                  std::pair{"data", "data that have changed since"}}) {
    if (present[key] == wanted[key]) continue;
    if (!replace) {
      fail("{}: holds a sweep of {}; choose another folder, or remove it", folder.string(), what);
    }
    for (const char* file : {"records.jsonl", "cases.jsonl", "run.json", "journal.jsonl"})
      fs::remove(folder / file);
    write_file(folder / "plan.json", json_text(wanted));
    return wanted;
  }
  const Json program = wanted["programs"].front();
  Json programs = present.value("programs", Json::array());
  if (is_finished_sweep(folder) || std::ranges::find(programs, program) != programs.end()) return present;
  if (!allow_mixed) {
    fail("{}: was begun by Sextant {}, this is {}; go on with that one, choose another folder, or pass --allow-mixed",
         folder.string(), program_text(programs), program_text(wanted["programs"]));
  }
  programs.push_back(program);
  present["programs"] = std::move(programs);
  write_file(folder / "plan.json", json_text(present));
  return present;
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

SweepOutcome merge_sweeps(const std::vector<fs::path>& folders, const fs::path& out, bool allow_mixed) {
  if (folders.empty()) fail("merge: no folders given");
  Json plan, shards = Json::array();
  std::map<std::string, std::string> first_with;  // by source: the folder that names its data first
  std::map<std::string, Json> sources;            // of run.json, by source
  for (const fs::path& folder : folders) {
    const Json of_folder = read_plan_file(folder);
    if (plan.is_null()) {
      plan = of_folder;
      plan["data"] = Json::object();
      plan["programs"] = Json::array();
    }
    if (of_folder["plan"] != plan["plan"])
      fail("{}: holds another plan than {}", folder.string(), folders.front().string());
    const Json data = json_object(of_folder, "data", (folder / "plan.json").string());
    for (const auto& [source, packs] : data.items()) {
      const auto [known, is_new] = first_with.emplace(source, folder.string());
      if (is_new) plan["data"][source] = packs;
      if (plan["data"][source] != packs) fail("{}: holds other data than {}", folder.string(), known->second);
    }
    if (!is_finished_sweep(folder)) {
      fail("{}: its sweep is not finished: give its command again first", folder.string());
    }
    for (const Json& program : of_folder.value("programs", Json::array())) {
      Json& programs = plan["programs"];
      if (std::ranges::find(programs, program) == programs.end()) programs.push_back(program);
      if (programs.size() > 1 && !allow_mixed) {
        fail("{}: was made by Sextant {}, {} by {}; sweep again with one version, or pass --allow-mixed",
             folder.string(), program_text(Json::array({program})), folders.front().string(), program_text(programs));
      }
    }
    const Json run = read_run_json(folder);
    shards.push_back(shard_provenance(of_folder, run));
    for (const Json& source : run.value("sources", Json::array()))
      sources.emplace(json_member<std::string>(source, "source", (folder / "run.json").string()), source);
  }
  Json provenance = read_run_json(folders.front());
  const auto n_cases = provenance.value("cases", uint64_t{0});
  const uint64_t n_planned = planned_cases(plan["plan"], (folders.front() / "plan.json").string());
  if (n_planned != n_cases)
    fail("{}: its plan has {} cases, run.json says {}", folders.front().string(), n_planned, n_cases);
  check_output_folder(out, provenance["configuration"], /*force=*/false);

  SweepOutcome outcome;
  NoiseOfCases noise(plan["plan"]);
  std::vector<ShardReader> readers(folders.begin(), folders.end());
  using Next = std::pair<size_t, ShardReader::Entry>;  // the shard, and its case
  std::map<uint64_t, Next> next;                       // of every shard that has one, by number
  const auto advance = [&](size_t shard) {
    std::optional<ShardReader::Entry> entry = readers[shard].next_case();
    if (!entry) return;
    const uint64_t number = entry->number;
    if (number >= n_cases) fail("{}: has case {}, its plan {} cases", folders[shard].string(), number, n_cases);
    const auto [other, is_new] = next.try_emplace(number, shard, std::move(*entry));
    if (is_new) return;
    fail("{}: case {} is in an earlier folder too: give each shard once",
         folders[std::max(shard, other->second.first)].string(), number);
  };
  for (size_t shard = 0; shard < folders.size(); ++shard) advance(shard);
  OutputFolder files(out);
  StreamedFile index(files.path("cases.jsonl")), records(files.path("records.jsonl"));
  std::string lines;
  for (; outcome.n_cases < n_cases; ++outcome.n_cases) {
    check_interrupt();
    if (next.empty() || next.begin()->first != outcome.n_cases)
      fail("case {} of {} is in none of the folders: a shard is missing", outcome.n_cases, n_cases);
    const auto [shard, entry] = std::move(next.extract(next.begin()).mapped());
    advance(shard);
    lines.clear();
    readers[shard].take_records(entry.n_records, lines);
    outcome.n_records += entry.n_records;
    index.append(json_line(case_json(entry.number, entry.n_records, entry.noise)) + "\n");
    records.append(lines);
    noise.add(entry.number, entry.noise);
  }
  for (ShardReader& reader : readers) reader.expect_end();
  index.close();
  records.close();

  provenance["shard"] = plan["shard"] = {0, 1};
  provenance["noise"] = noise.json();
  provenance["records"] = outcome.n_records;
  provenance["programs"] = plan["programs"];
  provenance["sources"] = Json::array();
  for (const Json& source : plan["plan"]["sources"]) {
    const auto of_run = sources.find(source.value("source", ""));
    if (of_run != sources.end()) provenance["sources"].push_back(of_run->second);
  }
  provenance["shards"] = std::move(shards);
  write_file(files.path("plan.json"), json_text(plan));
  write_file(files.path("run.json"), json_text(provenance));
  files.commit({"plan.json", "run.json", "cases.jsonl", "records.jsonl"});
  return outcome;
}

}  // namespace sextant
