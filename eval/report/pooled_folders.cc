#include "sextant/eval/report/pooled_folders.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/noise/noise.h"

namespace sextant {

Leaves leaves_of(const Json& options) {
  Leaves leaves;
  for_each_leaf(options, false, [&](const std::string& key, const Json& value) { leaves[key] = value; });
  return leaves;
}

std::string noise_name(const Json& options) {
  if (options.contains("profile")) return "";  // would be read from a file
  try {
    return Noise(options).name();
  } catch (const Error&) {
    return "";
  }
}

void SameLabels::begin(const Json& run, const std::filesystem::path& folder) {
  const std::string file = (folder / "run.json").string();
  Folder& now = folders_.emplace_back(Folder{file, {}, {}});
  last_.reset();
  const Json configuration = json_object(run, "configuration", file);
  const Json options = json_object(configuration, "options", file);
  const auto add_estimator = [&](const std::string& label, const Json& own, const Json& pipeline) {
    now.of_estimator[label] = leaves_of({{"estimator", own},
                                         {"pipeline", pipeline},
                                         {"extraction", json_object(options, "extraction", file)}});
  };
  const auto add_noise = [&](double level, const Json& noise) {
    const std::string name = noise.is_object() ? noise_name(noise) : "";
    if (!name.empty()) now.of_noise[{name, level}] = leaves_of(noise);
  };
  const Json pipeline = json_object(options, "pipeline", file);
  if (configuration.contains("estimator") && configuration["estimator"].is_string())  // of `sextant run`
    add_estimator(configuration["estimator"], json_object(options, "estimator", file), pipeline);
  for (const Json& entry : json_list(configuration, "estimators", file)) {
    if (!entry.is_object() || !entry.contains("label") || !entry["label"].is_string()) continue;
    add_estimator(entry["label"], json_object(entry, "options", file),
                  entry.contains("pipeline") ? json_object(entry, "pipeline", file) : pipeline);
  }
  const Json noise = configuration.value("noise", Json());
  if (noise.is_object()) add_noise(json_member<double>(configuration, "level", file, 0), noise);
  if (!noise.is_array()) return;
  for (const Json& entry : noise) {
    if (entry.is_object())
      add_noise(json_member<double>(entry, "level", file, 0), json_object(entry, "noise", file));
  }
}

template <typename Key>
void SameLabels::compare(const Folder& first, const Folder& now, const char* what, Interned label,
                         const Key& key, std::map<Key, Leaves> Folder::*options) {
  const auto before = (first.*options).find(key), after = (now.*options).find(key);
  if (before == (first.*options).end() || after == (now.*options).end()) return;
  for (const auto& [name, value] : after->second) {
    const auto other = before->second.find(name);
    if (other == before->second.end() || other->second == value) continue;
    fail(
        "{}: {} '{}' has {} = {}, but {} in {}: their records would count as one sample; report the folders "
        "apart, or give the estimators of a plan different labels",
        now.file, what, label, name, json_excerpt(value), json_excerpt(other->second), first.file);
  }
}

void SameLabels::check(Interned estimator, Interned dataset, Interned sequence, Interned noise,
                       double level) {
  const Row row{estimator, dataset, sequence, noise, level};
  if (row == last_) return;
  last_ = row;
  const size_t at = folders_.size() - 1;
  const auto [row_folders, is_new] = folders_of_.try_emplace(row, RowFolders{at, at});
  if (is_new || row_folders->second.last == at) return;
  row_folders->second.last = at;
  const Folder &first = folders_[row_folders->second.first], &now = folders_.back();
  compare(first, now, "estimator", estimator, estimator.str(), &Folder::of_estimator);
  compare(first, now, "noise", noise, std::pair(noise.str(), level), &Folder::of_noise);
}

void GivenShards::add(const Json& run) {
  if (const auto shard = shard_of(run))
    given_[{run.value("configuration", Json()).dump(), shard->second}].insert(shard->first);
}

std::vector<std::string> GivenShards::warnings() const {
  std::vector<std::string> sentences;
  for (const auto& [sweep, given] : given_) {
    if (given.size() >= sweep.second) continue;
    std::string list;
    for (const size_t i : given) list += (list.empty() ? "" : ", ") + std::to_string(i);
    sentences.push_back(fmt::format(
        "{} {} of {} of a sweep, and not the others: seeds and levels that the others hold are "
        "missing, so estimators may not have the same cases",
        given.size() == 1 ? "the folders hold shard" : "the folders hold shards", list, sweep.second));
  }
  return sentences;
}

}  // namespace sextant
