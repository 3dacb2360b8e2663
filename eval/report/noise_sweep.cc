#include "sextant/eval/report/noise_sweep.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

/// Dotted keys of the numbers in a tree.
void collect_numbers(const Json& tree, const std::string& prefix, std::map<std::string, double>& numbers) {
  for (const auto& [key, value] : tree.items()) {
    const std::string name = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object()) collect_numbers(value, name, numbers);
    if (value.is_number()) numbers[name] = value.get<double>();
  }
}

/// A sweep lists its noise by source and level; a run has one entry a source.
std::vector<AchievedNoise> achieved_noise(const Json& run) {
  std::vector<AchievedNoise> achieved;
  const auto add = [&](const Json& entry, const Json& configuration) {
    if (!entry.is_object() || !entry.contains("noise") || !entry["noise"].is_object()) return;
    achieved.push_back(
        {entry.value("source", std::string()),
         entry.value("level", json_member<double>(configuration, "level", "run.json: configuration", 0)),
         entry["noise"]});
  };
  const Json configuration = run.value("configuration", Json::object());
  for (const char* list : {"noise", "sources"}) {
    if (!run.contains(list) || !run[list].is_array()) continue;
    for (const Json& entry : run[list]) add(entry, configuration);
  }
  return achieved;
}

/// The folders of a case that is in more than one, or in one of them twice, in order.
std::vector<std::string> folders_with(const NoiseLevelKey& key, const SeedFrame& at,
                                      const std::vector<std::filesystem::path>& folders) {
  std::vector<std::string> found;
  for (const std::filesystem::path& folder : folders) {
    if (!std::filesystem::exists(folder / "records.jsonl")) {
      for_each_summary(folder / summary_file_name, [&](const CaseSummary& c) {
        const bool has_key = c.dataset == key.dataset.str() && c.sequence == key.sequence.str() && c.level == key.level &&
                             c.noise == key.noise.str();
        const auto is_estimator = [&](const ResultSums& result) { return result.estimator == key.estimator.str(); };
        if (c.seed == at.first && has_key && std::ranges::any_of(c.results, is_estimator)) found.push_back(folder.string());
      });
      continue;
    }
    for_each_record(folder / "records.jsonl", [&](const Record& r) {
      if (SeedFrame(r.seed, r.frame) == at && NoiseLevelKey::of(r) == key) found.push_back(folder.string());
    });
  }
  return found;
}

/// Throws Error for a case that is in two folders, whatever they vary.
void check_once(const std::vector<NoiseSweep>& sweeps, const std::vector<std::filesystem::path>& folders) {
  std::map<NoiseLevelKey, std::vector<const NoiseLevel*>> by_key;
  for (const NoiseSweep& sweep : sweeps) {
    for (const NoiseLevelRef& level : sweep.levels) by_key[level->key()].push_back(level.get());
  }
  for (const auto& [key, levels] : by_key) {
    std::vector<SeedFrame> cases;
    for (size_t i = 0; i < levels.size() && cases.empty(); ++i) {
      cases = levels[i]->repeated();
      for (size_t j = 0; j < i && cases.empty(); ++j) cases = levels[j]->shared(*levels[i]);
    }
    if (cases.empty()) continue;
    const std::vector<std::string> found = folders_with(key, cases.front(), folders);
    fail("{}: {} of {} {}, {}, frame {}, is in {} too: give each case once", found.at(1), key.body,
         key.dataset, key.sequence, key.estimator, cases.front().second, found.front());
  }
}

}  // namespace

size_t NoiseSweep::n_levels() const {
  std::set<double> distinct;
  for (const NoiseLevelRef& level : levels) distinct.insert(level->key().level);
  return distinct.size();
}

NoiseSweep noise_sweep_of(const std::string& parameter, const std::vector<Record>& records) {
  NoiseLevels levels;
  for (const Record& record : records) levels.add(record);
  return {parameter, levels.take(), levels.estimators()};
}

void add_levels(const NoiseSweep& more, NoiseSweep& sweep) {
  sweep.levels.insert(sweep.levels.end(), more.levels.begin(), more.levels.end());
  for (const Interned name : more.estimators) {
    if (std::ranges::find(sweep.estimators, name) == sweep.estimators.end()) sweep.estimators.push_back(name);
  }
  std::ranges::stable_sort(sweep.levels, [](const auto& a, const auto& b) { return a->key() < b->key(); });
}

std::string swept_parameter(const Json& configuration) {
  const Json levels = configuration.value("noise", Json());
  if (!levels.is_array() || levels.size() < 2) return "";
  std::optional<std::set<std::string>> candidates;
  for (const Json& level : levels) {
    if (!level.is_object() || !level.contains("noise") || !level["noise"].is_object()) return "";
    std::map<std::string, double> numbers;
    collect_numbers(level["noise"], "", numbers);
    std::set<std::string> equal;
    for (const auto& [key, value] : numbers) {
      if (value == json_member<double>(level, "level", "run.json: configuration.noise", 0) &&
          (!candidates || candidates->contains(key)))
        equal.insert(key);
    }
    candidates = std::move(equal);
  }
  return candidates->empty() ? "" : *candidates->begin();
}

std::vector<NoiseSweep> read_noise_sweeps(const std::vector<std::filesystem::path>& folders) {
  struct Content {
    NoiseLevels levels;
    std::vector<AchievedNoise> achieved;
  };
  std::map<std::string, Content> by_parameter;
  for (const std::filesystem::path& folder : folders) {
    const bool has_records = std::filesystem::exists(folder / "records.jsonl");
    if (!has_results(folder)) {
      fail("{}: no records.jsonl or {}: expected the folder of a finished run or sweep", folder.string(), summary_file_name);
    }
    const Json run = std::filesystem::exists(folder / "run.json") ? read_run_json(folder) : Json::object();
    Content& content = by_parameter[swept_parameter(run.value("configuration", Json::object()))];
    if (has_records) {
      for_each_record(folder / "records.jsonl", [&](const Record& record) { content.levels.add(record); });
    } else {
      for_each_summary(folder / summary_file_name, [&](const CaseSummary& summary) { content.levels.add(summary); });
    }
    for (AchievedNoise& achieved : achieved_noise(run)) {
      achieved.file = folder / "run.json";
      content.achieved.push_back(std::move(achieved));
    }
  }
  std::vector<NoiseSweep> sweeps;
  for (auto& [parameter, content] : by_parameter)
    sweeps.push_back(
        {parameter, content.levels.take(), content.levels.estimators(), std::move(content.achieved)});
  check_once(sweeps, folders);
  return sweeps;
}

std::string parameter_title(const std::string& parameter) {
  if (parameter == "depth.delta_d_px") return "depth noise: disparity accuracy \u0394d [px]";
  if (parameter == "flow.scale") return "flow noise [\u00d7 each body's EPE level]";
  if (parameter == "flow.epe_px") return "flow noise: end-point error [px]";
  return parameter.empty() ? "noise level" : parameter;
}

}  // namespace sextant
