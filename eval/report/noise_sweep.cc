#include "sextant/eval/report/noise_sweep.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/swept_parameter.h"

namespace sextant {
namespace {

constexpr const char* one_sample =
    "their records would count as one sample; compare the folders (sextant compare), or report them apart";

/// Returns the label of a plan for an estimator of records: LABEL, or LABEL.NAME of a program with several
/// results. `labels` is a map by label.
template <typename Map>
typename Map::const_iterator find_label(const Map& labels, const std::string& estimator) {
  auto found = labels.find(estimator);
  for (size_t dot = estimator.rfind('.'); found == labels.end() && dot != std::string::npos && dot > 0;
       dot = estimator.rfind('.', dot - 1))
    found = labels.find(estimator.substr(0, dot));
  return found;
}

/// Checks of folders whose records are counted together in one report. Refuses folders whose records would
/// count as one sample although they differ in more than the seed: equal names of an estimator or a noise
/// stand for other options, another version of an external program ran, a source has other data or options,
/// or an error is defined differently. What only one folder records is ignored, because another version of
/// the program may not have it. Warns of missing shards, and of several versions of Sextant.
class FolderChecks {
 public:
  /// Begins the next folder. `run`: content of its run.json.
  void begin(const Json& run, const std::filesystem::path& folder) {
    definitions_.check(run, folder);
    Folder& now = folders_.emplace_back(Folder{.file = (folder / "run.json").string()});
    last_.reset();
    now.versions = fingerprints_in(run, now.file);
    now.data = &*data_.insert(data_of(run)).first;
    add_options(run, now);
    if (const auto shard = shard_of(run))
      given_shards_[{run.value("configuration", Json()).dump(), shard->second}].insert(shard->first);
    Json programs = json_list(run, "programs", now.file);
    if (programs.empty() && run.contains("version")) programs.push_back(run);  // of `sextant run`
    for (const Json& program : programs) {
      for (const char* key : {"version", "git_commit"}) json_member<std::string>(program, key, now.file, "");
      folder_of_version_.emplace(program_text(Json::array({program})), folder.string());
    }
  }

  /// Checks the labels of a record of the folder. Throws Error if an earlier folder holds records with the
  /// same labels that differ. Programs, data and source options are compared for equal estimator, data set
  /// and sequence, because a curve joins their noise levels.
  void check(Interned estimator, Interned dataset, Interned sequence, Interned noise, double level) {
    const Row row{estimator, dataset, sequence, noise, level};
    if (row == last_) return;
    last_ = row;
    const Folder& now = folders_.back();
    if (const Folder* first = earlier(row, of_row_)) {
      const auto label = find_label(now.of_estimator, estimator.str());
      if (label != now.of_estimator.end())
        compare(*first, now, "estimator", label->first, label->first, &Folder::of_estimator);
      compare(*first, now, "noise", noise.str(), std::pair(noise.str(), level), &Folder::of_noise);
    }
    if (const Folder* first = earlier(Curve{estimator, dataset, sequence}, of_curve_))
      compare_origins(*first, now, estimator.str());
  }

  /// Returns a sentence for each sweep of which shards are missing, and one if there are several versions.
  std::vector<std::string> warnings() const {
    std::vector<std::string> sentences;
    for (const auto& [sweep, given] : given_shards_) {
      if (given.size() >= sweep.second) continue;
      sentences.push_back(
          fmt::format("{} {} of {} of a sweep, and not the others: seeds and levels that the others hold are "
                      "missing, so estimators may not have the same cases",
                      given.size() == 1 ? "the folders hold shard" : "the folders hold shards",
                      fmt::join(given, ", "), sweep.second));
    }
    if (folder_of_version_.size() < 2) return sentences;
    std::vector<std::string> versions;
    for (const auto& [version, folder] : folder_of_version_)
      versions.push_back(fmt::format("{} ({})", version, folder));
    sentences.push_back(
        fmt::format("the records come from different versions of Sextant, which may explain differences "
                    "between them: {}",
                    fmt::join(versions, ", ")));
    return sentences;
  }

 private:
  using Leaves = std::map<std::string, Json>;
  using Curve = std::tuple<Interned, Interned, Interned>;
  using Row = std::tuple<Interned, Interned, Interned, Interned, double>;
  struct Folder {
    std::string file;
    std::map<std::string, Leaves> of_estimator;                 ///< by label
    std::map<std::pair<std::string, double>, Leaves> of_noise;  ///< by name and level
    Fingerprints versions;                                      ///< by label
    std::map<std::string, std::string> of_source;               ///< options, by source without its folder
    const SourceData* data = nullptr;
  };
  /// Folders with records of a row or curve, as indices.
  struct Holders {
    size_t first, last;
  };

  static void add_options(const Json& run, Folder& now) {
    const Json configuration = json_object(run, "configuration", now.file);
    const Json options = json_object(configuration, "options", now.file);
    const auto add_estimator = [&](const std::string& label, const Json& own, const Json& pipeline) {
      now.of_estimator[label] = leaves_of({{"estimator", own},
                                           {"pipeline", pipeline},
                                           {"extraction", json_object(options, "extraction", now.file)}});
    };
    const auto add_noise = [&](double level, const Json& noise) {
      const std::string name = noise.is_object() ? noise_name(noise) : "";
      if (!name.empty()) now.of_noise[{name, level}] = leaves_of(noise);
    };
    const Json pipeline = json_object(options, "pipeline", now.file);
    if (configuration.contains("estimator") && configuration["estimator"].is_string()) {  // of `sextant run`
      // The records of an external program have the label of its fingerprint.
      add_estimator(
          now.versions.empty() ? configuration["estimator"].get<std::string>() : now.versions.begin()->first,
          json_object(options, "estimator", now.file), pipeline);
    }
    for (const Json& entry : json_list(configuration, "estimators", now.file)) {
      if (!entry.is_object() || !entry.contains("label") || !entry["label"].is_string()) continue;
      add_estimator(entry["label"], json_object(entry, "options", now.file),
                    entry.contains("pipeline") ? json_object(entry, "pipeline", now.file) : pipeline);
    }
    for (const Json& source : json_list(configuration, "sources", now.file)) {
      if (source.is_string()) {  // of `sextant run`
        now.of_source[without_folder(source.get<std::string>())] =
            json_line(json_object(options, "source", now.file));
      } else if (source.is_object()) {
        now.of_source[without_folder(json_member<std::string>(source, "source", now.file, ""))] =
            json_line(json_object(source, "options", now.file));
      }
    }
    const Json noise = configuration.value("noise", Json());
    if (noise.is_object()) add_noise(json_member<double>(configuration, "level", now.file, 0), noise);
    if (!noise.is_array()) return;
    for (const Json& entry : noise) {
      if (entry.is_object())
        add_noise(json_member<double>(entry, "level", now.file, 0), json_object(entry, "noise", now.file));
    }
  }

  /// Returns the first folder that holds `key`; null if it is the present one, or was compared with it.
  template <typename Key>
  const Folder* earlier(const Key& key, std::map<Key, Holders>& holders) const {
    const size_t at = folders_.size() - 1;
    const auto [of_key, is_new] = holders.try_emplace(key, Holders{at, at});
    if (is_new || of_key->second.last == at) return nullptr;
    of_key->second.last = at;
    return &folders_[of_key->second.first];
  }

  template <typename Key>
  static void compare(const Folder& first, const Folder& now, const char* what, const std::string& label,
                      const Key& key, std::map<Key, Leaves> Folder::*options) {
    const Leaves *before = find_in(first.*options, key), *after = find_in(now.*options, key);
    if (before == nullptr || after == nullptr) return;
    for (const auto& [name, value] : *after) {
      const Json* other = find_in(*before, name);
      if (other == nullptr || *other == value) continue;
      fail(
          "{}: {} '{}' has {} = {}, but {} in {}: their records would count as one sample; report the "
          "folders apart, or give the estimators of a plan different labels",
          now.file, what, label, name, json_excerpt(value), json_excerpt(*other), first.file);
    }
  }

  static void compare_origins(const Folder& first, const Folder& now, const std::string& estimator) {
    const auto before = find_label(first.versions, estimator), after = find_label(now.versions, estimator);
    if (before != first.versions.end() && after != now.versions.end() && before->second != after->second) {
      std::vector<Fingerprint> versions = before->second;
      for (const Fingerprint& version : after->second) add_distinct(version, versions);
      fail("{}: another version of '{}' ran than in {} ({}): {}", now.file, after->first, first.file,
           versions.size() > 1 ? difference(versions[0], versions[1]) : "", one_sample);
    }
    for (const auto& [source, options] : now.of_source) {
      const std::string* other = find_in(first.of_source, source);
      if (other == nullptr || *other == options) continue;
      fail("{}: source '{}' has the options {}, but {} in {}: {}", now.file, source, options, *other,
           first.file, one_sample);
    }
    if (now.data == first.data) return;
    if (const std::string changed = changed_data(*first.data, *now.data); !changed.empty())
      fail("{}: has other data than {} ({}): {}", now.file, first.file, changed, one_sample);
  }

  SameDefinitions definitions_;
  std::vector<Folder> folders_;
  std::set<SourceData> data_;  ///< the data of the folders, each once: shards of a sweep have the same
  std::map<Row, Holders> of_row_;
  std::map<Curve, Holders> of_curve_;
  std::optional<Row> last_;                               ///< the row of the last record
  std::map<std::string, std::string> folder_of_version_;  ///< the first folder, by version of Sextant
  std::map<std::pair<std::string, size_t>, std::set<size_t>> given_shards_;  ///< by sweep and their number
};

/// Returns the grid of the first level that `is_level` accepts; otherwise that of level `position`, or none
/// if there are fewer levels.
template <typename IsLevel>
SweptGrid find_grid(const std::vector<ConfiguredLevel>& levels, IsLevel is_level, size_t position) {
  const auto it = std::ranges::find_if(levels, is_level);
  if (it != levels.end()) return it->grid;
  return position < levels.size() ? levels[position].grid : SweptGrid();
}

/// A sweep lists its noise by source and level; a run has one entry per source.
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

/// Returns the folders that contain this case, in order; a folder that contains it twice is listed twice.
std::vector<std::string> folders_with(const NoiseLevelKey& key, const SeedFrame& at,
                                      const std::vector<std::filesystem::path>& folders) {
  std::vector<std::string> found;
  for (const std::filesystem::path& folder : folders) {
    if (!std::filesystem::exists(folder / "records.jsonl")) {
      for_each_summary(folder / summary_file_name, [&](const CaseSummary& c) {
        const bool has_key = c.dataset == key.dataset.str() && c.sequence == key.sequence.str() &&
                             c.level == key.level && c.noise == key.noise.str();
        const auto is_estimator = [&](const ResultSums& result) {
          return result.estimator == key.estimator.str();
        };
        if (c.seed == at.first && has_key && std::ranges::any_of(c.results, is_estimator))
          found.push_back(folder.string());
      });
      continue;
    }
    for_each_record(folder / "records.jsonl", [&](const Record& r) {
      if (SeedFrame(r.seed, r.frame) == at && NoiseLevelKey::of(r) == key) found.push_back(folder.string());
    });
  }
  return found;
}

/// Throws Error if a case occurs twice, in one folder or in two, whichever parameters these vary.
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
    fail("{}: {} of {} {}, {}, frame {}, is also in {}: give each case once", found.at(1), key.body,
         key.dataset, key.sequence, key.estimator, cases.front().second, found.front());
  }
}

/// Text before the noise in the parameter of a sweep that varies nothing.
constexpr const char* one_noise = "noise ";

/// Splits a sweep in which one level stands for several kinds of noise into one sweep for each noise, which
/// names it as its parameter, because a curve has one noise at each level.
std::vector<NoiseSweep> with_clear_levels(NoiseSweep sweep) {
  std::map<double, std::set<std::string>> noises;
  size_t most = 0;
  for (const NoiseLevelRef& level : sweep.levels) {
    std::set<std::string>& at_level = noises[level->key().level];
    at_level.insert(level->key().noise.str());
    most = std::max(most, at_level.size());
  }
  std::vector<NoiseSweep> clear;
  if (most < 2) {
    clear.push_back(std::move(sweep));
    return clear;
  }
  std::map<std::string, size_t> place;  // in `clear`, by noise
  for (const NoiseLevelRef& level : sweep.levels) {
    const std::string noise = level->key().noise.str();
    const auto [at, is_new] = place.try_emplace(noise, clear.size());
    if (is_new) clear.push_back({one_noise + noise, {}, sweep.estimators});
    clear[at->second].levels.push_back(level);
  }
  for (AchievedNoise& achieved : sweep.achieved) {
    const auto at = place.find(noise_name(achieved.noise.value("requested", Json::object())));
    clear[at == place.end() ? 0 : at->second].achieved.push_back(std::move(achieved));
  }
  return clear;
}

}  // namespace

CurveKey CurveKey::of(const std::string& parameter, const NoiseLevelKey& level) {
  return {parameter, level.dataset, level.sequence, level.body, level.estimator};
}

bool CurveKey::covers(const std::string& swept, const NoiseLevelKey& key) const {
  return swept == parameter && key.dataset == dataset && key.sequence == sequence && key.body == body &&
         key.estimator == estimator;
}

Fields<CurveKey> CurveKey::fields() {
  return {{Column::text("parameter").folded(), &CurveKey::parameter},
          {Column::text("dataset").folded(), &CurveKey::dataset},
          {Column::text("sequence").folded(), &CurveKey::sequence},
          {Column::text("body"), &CurveKey::body},
          {Column::text("estimator").folded(), &CurveKey::estimator}};
}

void add_levels(const NoiseSweep& more, NoiseSweep& sweep) {
  sweep.levels.insert(sweep.levels.end(), more.levels.begin(), more.levels.end());
  for (const Interned name : more.estimators) add_distinct(name, sweep.estimators);
  std::ranges::stable_sort(sweep.levels, [](const auto& a, const auto& b) { return a->key() < b->key(); });
}

std::vector<NoiseSweep> read_noise_sweeps(const std::vector<std::filesystem::path>& folders,
                                          std::vector<std::string>* warnings) {
  struct Content {
    NoiseLevels levels;
    std::vector<AchievedNoise> achieved;
  };
  std::map<SweptGrid, Content> by_grid;
  FolderChecks checks;
  for (const std::filesystem::path& folder : folders) {
    const bool has_records = std::filesystem::exists(folder / "records.jsonl");
    if (!has_results(folder)) {
      fail("{}: has no records.jsonl or {}: expected the folder of a finished run or sweep", folder.string(),
           summary_file_name);
    }
    const Json run = std::filesystem::exists(folder / "run.json") ? read_run_json(folder) : Json::object();
    checks.begin(run, folder);
    const std::vector<ConfiguredLevel> levels = configured_levels(run.value("configuration", Json::object()));
    // A shard may lack levels of its plan, so levels are found by their noise. Where the noise is unknown,
    // the n-th kind of noise to appear is that of the n-th level, because cases are in the order of the
    // levels.
    std::map<std::pair<Interned, double>, Content*> content_of_noise;
    const auto add = [&](const auto& of) {
      const auto [it, is_new] = content_of_noise.try_emplace({of.noise, of.level}, nullptr);
      if (is_new) {
        const auto is_level = [&](const ConfiguredLevel& level) {
          return level.level == of.level && level.name == Interned(of.noise).str();
        };
        it->second = &by_grid[find_grid(levels, is_level, content_of_noise.size() - 1)];
      }
      it->second->levels.add(of);
    };
    if (has_records) {
      uint64_t n_records = 0, n_without_errors = 0;
      for_each_record(folder / "records.jsonl", [&](const Record& record) {
        ++n_records;
        if (lacks_errors(record)) ++n_without_errors;
        checks.check(record.estimator, record.dataset, record.sequence, record.noise, record.level);
        add(record);
      });
      const std::string missing = missing_records(run, n_records, folder);
      if (!missing.empty() && warnings != nullptr) warnings->push_back(missing);
      if (n_without_errors > 0 && warnings != nullptr)
        warnings->push_back(missing_errors(folder, n_without_errors));
    } else {
      for_each_summary(folder / summary_file_name, [&](const CaseSummary& summary) {
        for (const ResultSums& result : summary.results) {
          checks.check(Interned(result.estimator), Interned(summary.dataset), Interned(summary.sequence),
                       Interned(summary.noise), summary.level);
        }
        add(summary);
      });
    }
    std::map<std::string, size_t> n_of_source;  // a source has one entry for each level, in their order
    for (AchievedNoise& achieved : achieved_noise(run)) {
      achieved.file = folder / "run.json";
      const auto is_level = [&](const ConfiguredLevel& level) {
        return level.level == achieved.level && level.noise == achieved.noise.value("requested", Json());
      };
      Content& content = by_grid[find_grid(levels, is_level, n_of_source[achieved.source]++)];
      content.achieved.push_back(std::move(achieved));
    }
  }
  if (warnings != nullptr) std::ranges::move(checks.warnings(), std::back_inserter(*warnings));
  std::vector<NoiseSweep> sweeps;
  for (auto& [grid, content] : by_grid) {
    int n_of_parameter = 0, n_of_label = 0;
    for (const auto& [other, ignored] : by_grid) {
      n_of_parameter += other.parameter == grid.parameter;
      n_of_label += other.parameter == grid.parameter && other.label == grid.label;
    }
    std::string parameter = grid.parameter;
    if (n_of_parameter > 1)
      parameter += " with " + (n_of_label > 1 || grid.label.empty() ? grid.others : grid.label);
    NoiseSweep sweep{parameter, content.levels.take(), content.levels.estimators(),
                     std::move(content.achieved)};
    if (grid.parameter.empty()) {
      for (NoiseSweep& clear : with_clear_levels(std::move(sweep))) sweeps.push_back(std::move(clear));
    } else {
      sweeps.push_back(std::move(sweep));
    }
  }
  check_once(sweeps, folders);
  return sweeps;
}

bool increases_noise(const std::string& swept) {
  // A longer baseline makes depths more accurate; the others change the kind of the noise, not its size.
  static const std::set<std::string> others = {"depth.baseline_m", "quantisation.baseline_m",
                                               "mask.neighbours"};
  return !others.contains(swept.substr(0, swept.find(" with "))) && !swept.starts_with("correlation.");
}

std::string parameter_title(const std::string& swept, const std::string& noise) {
  const std::string parameter = swept.substr(0, swept.find(" with "));
  if (parameter == "depth.delta_d_px") return "depth noise: disparity accuracy \u0394d [px]";
  if (parameter == "flow.scale") return "flow noise [\u00d7 each body's EPE level]";
  if (parameter == profile_scale) return "noise [\u00d7 the profile]";
  if (parameter == "flow.epe_px") {
    return noise.find("mean error") == std::string::npos ? "flow noise: standard deviation of x and y [px]"
                                                         : "flow noise: mean end-point error [px]";
  }
  if (swept.starts_with(one_noise))
    return fmt::format("noise level of {}", swept.substr(std::strlen(one_noise)));
  return parameter.empty() ? "noise level" : parameter;
}

}  // namespace sextant
