#include "sextant/eval/report/noise_sweep.h"

#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/records/run_json.h"

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

using CaseKey =
    std::tuple<std::string, std::string, std::string, std::string, double, uint64_t, int, std::string>;

CaseKey key_of(const Record& r) {
  return {r.dataset, r.sequence, r.estimator, r.noise, r.level, r.seed, r.frame, r.body};
}

}  // namespace

size_t NoiseSweep::n_levels() const {
  std::set<double> levels;
  for (const Record& record : records) levels.insert(record.level);
  return levels.size();
}

size_t NoiseSweep::n_estimators() const {
  std::set<std::string> estimators;
  for (const Record& record : records) estimators.insert(record.estimator);
  return estimators.size();
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
  std::map<std::string, NoiseSweep> by_parameter;
  std::map<CaseKey, std::string> folder_of;
  for (const std::filesystem::path& folder : folders) {
    if (!std::filesystem::exists(folder / "records.jsonl")) {
      fail("{}: no records.jsonl: expected the folder of a finished run or sweep", folder.string());
    }
    const Json run = std::filesystem::exists(folder / "run.json") ? read_run_json(folder) : Json::object();
    NoiseSweep& sweep = by_parameter[swept_parameter(run.value("configuration", Json::object()))];
    for (Record& record : read_records(folder / "records.jsonl")) {
      const auto [it, is_new] = folder_of.emplace(key_of(record), folder.string());
      if (!is_new) {
        fail("{}: {} of {} {}, {}, frame {}, is in {} too: give each case once", folder.string(), record.body,
             record.dataset, record.sequence, record.estimator, record.frame, it->second);
      }
      sweep.records.push_back(std::move(record));
    }
    for (AchievedNoise& achieved : achieved_noise(run)) sweep.achieved.push_back(std::move(achieved));
  }
  std::vector<NoiseSweep> sweeps;
  for (auto& [parameter, sweep] : by_parameter) {
    sweep.parameter = parameter;
    sweeps.push_back(std::move(sweep));
  }
  return sweeps;
}

std::string parameter_title(const std::string& parameter) {
  if (parameter == "depth.delta_d_px") return "depth noise: disparity accuracy \u0394d [px]";
  if (parameter == "flow.scale") return "flow noise [\u00d7 each body's EPE level]";
  if (parameter == "flow.epe_px") return "flow noise: end-point error [px]";
  return parameter.empty() ? "noise level" : parameter;
}

}  // namespace sextant
