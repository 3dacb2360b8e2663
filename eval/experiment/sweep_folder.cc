#include "sextant/eval/experiment/sweep_folder.h"

#include <algorithm>
#include <map>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/json.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {
namespace {

constexpr const char* journal_name = "journal.jsonl";

void check_all_there(const std::map<uint64_t, std::string>& folder_of, uint64_t n_shards) {
  constexpr size_t most_named = 20;
  std::string missing;
  size_t n = 0;
  for (uint64_t shard = 1; shard <= n_shards && n <= most_named; ++shard) {
    if (folder_of.contains(shard)) continue;
    missing += ++n > most_named ? ", .." : fmt::format("{}{}", n > 1 ? ", " : "", shard);
  }
  if (n > 0)
    fail("shard{} {} of {}: in none of the folders: give the folders of all shards", n > 1 ? "s" : "",
         missing, n_shards);
}

}  // namespace

Json read_plan_file(const fs::path& folder) {
  const Json json = read_json(folder / "plan.json");
  if (!json.is_object() || !json.contains("plan") || !json.contains("shard") || !json.contains("data")) {
    fail("{}: is not the plan file of a sweep: expected an object with \"plan\", \"shard\" and \"data\"",
         (folder / "plan.json").string());
  }
  return json;
}

ShardNumber shard_number(const Json& plan_file, const std::string& where) {
  const auto shard = shard_of(plan_file);
  if (!shard || shard->first >= shard->second)
    fail("{}: is not the plan file of a sweep: expected \"shard\": [I, N], I below N", where);
  return {shard->first == 0 ? shard->second : shard->first, shard->second};
}

uint64_t planned_cases(const Json& plan, const std::string& where) {
  uint64_t n = planned_seeds(plan, where);
  if (n > max_plan_cases) fail("{}: its plan has more than {} cases", where, max_plan_cases);
  for (const char* list : {"sources", "estimators", "noise"}) {
    const size_t size = json_list(plan, list, where).size();
    if (size > max_plan_cases || (n *= size) > max_plan_cases)
      fail("{}: its plan has more than {} cases", where, max_plan_cases);
  }
  return n;
}

Json claim_folder(const fs::path& folder, const Json& wanted, bool replace, bool allow_mixed) {
  if (!fs::exists(folder / "plan.json")) {
    if (has_results(folder)) {
      fail("{}: holds results that do not belong to a sweep; choose another folder", folder.string());
    }
    write_file(folder / "plan.json", json_text(wanted));
    return wanted;
  }
  const Json present = read_plan_file(folder);
  for (const auto& [key, what] : {std::pair{"plan", "another plan"}, std::pair{"shard", "another shard"},
                                  std::pair{"data", "data that have changed since"}}) {
    if (plan_key(present[key]) == plan_key(wanted[key])) continue;
    if (!replace) {
      fail("{}: holds a sweep of {}; choose another folder, or pass --force to start over", folder.string(),
           what);
    }
    remove_results(folder);
    fs::remove(folder / journal_name);
    FinishedCases::remove(folder);
    write_file(folder / "plan.json", json_text(wanted));
    return wanted;
  }
  return is_finished_sweep(folder) ? present : join_claim(folder, present, wanted, allow_mixed);
}

Json join_claim(const fs::path& folder, Json present, const Json& wanted, bool allow_mixed) {
  const Json before = present;
  const Json program = wanted["programs"].front();
  Json programs = present.value("programs", Json::array());
  if (std::ranges::find(programs, program) == programs.end()) {
    if (!allow_mixed) {
      fail(
          "{}: was begun by Sextant {}, this is {}; continue with that version, choose another folder, or "
          "pass --allow-mixed or --force",
          folder.string(), program_text(programs), program_text(wanted["programs"]));
    }
    programs.push_back(program);
    present["programs"] = std::move(programs);
  }
  present["plan"] = wanted["plan"];
  Fingerprints versions = fingerprints_in(wanted, "plan.json");
  for (const auto& [label, known] : fingerprints_in(before, (folder / "plan.json").string())) {
    for (const Fingerprint& version : known) add_distinct(version, versions[label]);
  }
  if (!versions.empty()) present[fingerprints_key] = fingerprints_json(versions);
  if (present != before) write_file(folder / "plan.json", json_text(present));
  return present;
}

void remove_results(const fs::path& folder) {
  for (const char* file : {"records.jsonl", summary_file_name, "cases.jsonl", "run.json"})
    fs::remove(folder / file);
}

void remove_sweep(const fs::path& folder) {
  if (!fs::exists(folder / "plan.json")) return;
  read_plan_file(folder);  // throws Error unless it is that of a sweep
  remove_results(folder);
  FinishedCases::remove(folder);
  fs::remove_all(folder / "external");
  fs::remove(folder / "plan.json");
  fs::remove(folder / journal_name);
  sync_folder(folder);
}

void remove_temporaries(const fs::path& folder) {
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("plan.json.tmp")) left.push_back(entry.path());
  }
  for (const fs::path& file : left) fs::remove(file);
}

SweepOutcome merge_sweeps(const std::vector<fs::path>& folders, const fs::path& out, bool allow_mixed,
                          bool quiet) {
  if (folders.empty()) fail("merge: no folders given");
  for (const fs::path& folder : folders) {
    std::error_code ignored;
    if (fs::equivalent(folder, out, ignored))
      fail("--out {}: is one of the folders that are merged: choose another one", out.string());
  }
  const FolderLock lock(out);
  Json plan, shards = Json::array();
  uint64_t n_shards = 0;
  std::map<uint64_t, std::string> folder_of;  // by number of the shard
  struct DataOfSource {
    std::string folder;  ///< the first that names them
    Json packs;
  };
  // By length and text of the source's index, which is the order of the indices.
  std::map<std::pair<size_t, std::string>, DataOfSource> data_of;
  std::map<std::string, Json> sources;  // of run.json, by source
  SameDefinitions definitions;
  Fingerprints versions;  // of estimators, by label
  for (const fs::path& folder : folders) {
    const Json of_folder = read_plan_file(folder);
    if (plan.is_null()) {
      plan = of_folder;
      plan["data"] = Json::object();
      plan["programs"] = Json::array();
    }
    if (plan_key(of_folder["plan"]) != plan_key(plan["plan"]))
      fail("{}: holds another plan than {}: give the shards of one sweep", folder.string(),
           folders.front().string());
    const ShardNumber shard = shard_number(of_folder, (folder / "plan.json").string());
    if (n_shards == 0) n_shards = shard.n_shards;
    if (shard.n_shards != n_shards) {
      fail("{}: belongs to a sweep in {} shards, {} to one in {}: give the shards of one sweep",
           folder.string(), shard.n_shards, folders.front().string(), n_shards);
    }
    const auto [other, is_new_shard] = folder_of.emplace(shard.number, folder.string());
    if (!is_new_shard)
      fail("{}: shard {} of {} is also in {}: list each shard once", folder.string(), shard.number, n_shards,
           other->second);
    const Json data = json_object(of_folder, "data", (folder / "plan.json").string());
    for (const auto& item : data.items()) {
      const std::pair<size_t, std::string> source{item.key().size(), item.key()};
      const auto known = data_of.try_emplace(source, DataOfSource{folder.string(), item.value()}).first;
      if (known->second.packs != item.value())
        fail("{}: the files of its sources differ from those of {}: give shards of the same data",
             folder.string(), known->second.folder);
    }
    if (!is_finished_sweep(folder)) {
      fail("{}: its sweep is not finished: run its command again to resume it", folder.string());
    }
    for (const Json& program : of_folder.value("programs", Json::array())) {
      Json& programs = plan["programs"];
      if (std::ranges::find(programs, program) == programs.end()) programs.push_back(program);
      if (programs.size() > 1 && !allow_mixed) {
        fail("{}: was made by Sextant {}, but {} by {}; sweep again with one version, or pass --allow-mixed",
             folder.string(), program_text(Json::array({program})), folders.front().string(),
             program_text(programs));
      }
    }
    for (const auto& [label, of_shard] : fingerprints_in(of_folder, (folder / "plan.json").string())) {
      std::vector<Fingerprint>& known = versions[label];
      for (const Fingerprint& version : of_shard) add_distinct(version, known);
      if (known.size() > 1 && !allow_mixed) {
        fail(
            "{}: another version of '{}' ran there than in {} ({}); sweep again with one version, or pass "
            "--allow-mixed",
            folder.string(), label, folders.front().string(), difference(known[0], known[1]));
      }
    }
    const Json run = read_run_json(folder);
    definitions.check(run, folder);
    Json kept = {{"shard", of_folder["shard"]}};  // content of the merged run.json about a shard
    for (const char* key :
         {"version", "git_commit", "compiler", "flags", "packages", "machine", "programs", "records"})
      if (run.contains(key)) kept[key] = run[key];
    shards.push_back(std::move(kept));
    for (const Json& source : run.value("sources", Json::array()))
      sources.emplace(json_member<std::string>(source, "source", (folder / "run.json").string()), source);
  }
  check_all_there(folder_of, n_shards);
  for (const auto& [source, data] : data_of) plan["data"][source.second] = data.packs;
  Json provenance = read_run_json(folders.front());
  const auto n_cases = provenance.value("cases", uint64_t{0});
  const uint64_t n_planned = planned_cases(plan["plan"], (folders.front() / "plan.json").string());
  if (n_planned != n_cases)
    fail("{}: its plan has {} cases, run.json states {}: one of the files was changed or damaged",
         folders.front().string(), n_planned, n_cases);
  check_output_folder(out, provenance["configuration"], /*force=*/false);

  SweepOutcome outcome;
  std::vector<std::unique_ptr<CaseResultReader>> readers;
  const KeepOfCases keep = kept(plan["plan"], (folders.front() / "plan.json").string());
  for (const fs::path& folder : folders) readers.push_back(open_case_results(folder, keep));
  MergedCases cases(std::move(readers));
  OutputFolder files(out);
  CaseResultWriter results(files, plan["plan"], n_cases);
  Progress progress("cases merged", static_cast<int>(n_cases), quiet);
  while (const auto next = cases.next()) {
    check_interrupt();
    const std::string folder = folders[next->reader].string();
    const uint64_t number = next->result.number;
    if (number >= n_cases)
      fail("{}: has case {}, but its plan has {} cases, numbered from 0", folder, number, n_cases);
    if (number < outcome.n_cases)
      fail("{}: case {} is also in an earlier folder: list each shard once", folder, number);
    if (number > outcome.n_cases) break;
    results.add(next->result);
    ++outcome.n_cases;
    progress.advance();
  }
  if (outcome.n_cases < n_cases)
    fail("case {} of {} is in none of the folders: the results of a shard were changed or damaged",
         outcome.n_cases, n_cases);
  for (const ExactNoises& noise : cases.noises()) results.add_noise(noise);
  results.close();
  outcome.n_records = results.n_records();

  provenance["shard"] = plan["shard"] = {0, 1};
  provenance["noise"] = results.noise();
  provenance["records"] = outcome.n_records;
  provenance["programs"] = plan["programs"];
  if (!versions.empty()) provenance[fingerprints_key] = plan[fingerprints_key] = fingerprints_json(versions);
  provenance["sources"] = Json::array();
  for (const Json& source : plan["plan"]["sources"]) {
    const auto of_run = sources.find(source.value("source", ""));
    if (of_run != sources.end()) provenance["sources"].push_back(of_run->second);
  }
  provenance["shards"] = std::move(shards);
  write_file(files.path("plan.json"), json_text(plan));
  write_file(files.path("run.json"), json_text(provenance));
  std::vector<std::string> names = {"plan.json", "run.json"};
  std::ranges::copy(results.names(), std::back_inserter(names));
  files.commit(names);
  return outcome;
}

namespace {

constexpr const char* configuration = "configuration";

}  // namespace

Json plan_key(Json plan) {
  if (!plan.is_object() || !plan.contains("estimators") || !plan["estimators"].is_array()) return plan;
  for (Json& estimator : plan["estimators"]) {
    if (!estimator.is_object() || !estimator.contains("name") || !estimator["name"].is_string()) continue;
    if (is_of_a_kind(estimator["name"].get<std::string>())) estimator.erase("options");
  }
  return plan;
}

Fingerprints present_fingerprints(const Plan& plan) {
  Fingerprints now;
  for (const PlanEstimator& estimator : plan.estimators) {
    if (const auto fingerprint = estimator.estimator->fingerprint()) now[estimator.label] = {*fingerprint};
  }
  return now;
}

Fingerprints rescored_fingerprints(const Plan& plan, const fs::path& rescored) {
  const Json file = read_plan_file(rescored);
  const std::string where = (rescored / "plan.json").string();
  const Fingerprints ran = fingerprints_in(file, where);
  const Json recorded = json_list(file["plan"], "estimators", where);
  Fingerprints now;
  for (size_t i = 0; i < plan.estimators.size(); ++i) {
    const PlanEstimator& estimator = plan.estimators[i];
    if (!is_of_a_kind(estimator.name)) {
      if (const auto fingerprint = estimator.estimator->fingerprint()) now[estimator.label] = {*fingerprint};
      continue;
    }
    Fingerprint fingerprint;
    const auto versions = i < recorded.size() ? ran.find(recorded[i].value("label", "")) : ran.end();
    if (versions == ran.end() || versions->second.empty()) {
      fingerprint.not_seen = {fmt::format("the program: {} does not say which version ran", where)};
    } else {
      fingerprint = versions->second.front();
      for (size_t version = 1; version < versions->second.size(); ++version)
        fingerprint.parts[fmt::format("version {}", version + 1)] = versions->second[version].sha256();
    }
    fingerprint.parts[configuration] = sha256(json_line(estimator.options));
    now[estimator.label] = {fingerprint};
  }
  return now;
}

CaseVersions::CaseVersions(const Plan& plan, std::string sweep, Fingerprints now, Fingerprints known)
    : plan_(plan), sweep_(std::move(sweep)), now_(std::move(now)), known_(std::move(known)) {}

std::vector<Fingerprint> CaseVersions::versions(uint64_t number) const {
  const auto present = now_.find(label(number));
  if (present == now_.end()) return {};
  std::vector<Fingerprint> all = present->second;
  const auto earlier = known_.find(label(number));
  if (earlier != known_.end()) {
    for (const Fingerprint& version : earlier->second) add_distinct(version, all);
  }
  return all;
}

std::vector<std::string> CaseVersions::owners(uint64_t number) const {
  std::vector<std::string> names;
  for (const Fingerprint& version : versions(number))
    names.push_back(sha256(sweep_ + "\n" + version.sha256()));
  return names.empty() ? std::vector{sweep_} : names;
}

std::string CaseVersions::owner_of_all() const {
  if (now_.empty()) return sweep_;
  std::string text = sweep_;
  for (const auto& [label, versions] : now_)
    text += fmt::format("\n{}\n{}", label, versions.front().sha256());
  return sha256(text);
}

bool CaseVersions::is_stale(uint64_t number) const {
  const auto present = now_.find(label(number));
  if (present == now_.end()) return false;
  const auto made = known_.find(label(number));
  return made == known_.end() || made->second != present->second;
}

std::string CaseVersions::stale_text(const std::string& label, uint64_t n_cases) const {
  const auto made = known_.find(label);
  const std::string cases = n_cases == 1 ? "1 finished case" : fmt::format("{} finished cases", n_cases);
  if (made == known_.end() || made->second.empty())
    return fmt::format("'{}': it is not known which version of it made {}", label, cases);
  std::string changes = "several versions made them";
  for (const Fingerprint& version : made->second) {
    if (version == now_.at(label).front()) continue;
    if (made->second.size() <= 2) changes = difference(version, now_.at(label).front());
  }
  return fmt::format("'{}': another version of it made {} ({})", label, cases, changes);
}

void CaseVersions::add_used(uint64_t number, size_t place, Fingerprints& used) const {
  const std::vector<Fingerprint> all = versions(number);
  if (!all.empty()) add_distinct(all.at(place), used[label(number)]);
}

}  // namespace sextant
