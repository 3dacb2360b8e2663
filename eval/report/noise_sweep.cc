#include "sextant/eval/report/noise_sweep.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

/// Returns the numbers in a tree by dotted key.
std::map<std::string, double> numbers_of(const Json& tree) {
  std::map<std::string, double> numbers;
  for (const auto& [key, value] : leaves_of(tree)) {
    if (value.is_number()) numbers[key] = value.get<double>();
  }
  return numbers;
}

/// A sweep of one parameter under the same other noise.
struct Grid {
  std::string parameter;  ///< dotted key; "" if nothing is swept
  std::string others;     ///< options of the noise, in one line, with null in place of the parameter
  std::string label;      ///< text of the other noise; "" if this version cannot read the options
  auto operator<=>(const Grid&) const = default;
};

/// A noise level of the configuration in run.json.
struct ConfiguredLevel {
  double level = 0;
  Json noise;                             ///< Noise::options()
  std::string name;                       ///< text in records; "" if this version cannot read the options
  std::map<std::string, double> numbers;  ///< of `noise`, by dotted key
  Grid grid;
};

/// Sets the number at a dotted key; does nothing for a key that itself contains a dot.
void set_number(const std::string& key, const Json& value, Json& noise) {
  Json* number = &noise;
  for (const std::string& part : split(key, '.')) {
    if (!number->is_object()) return;
    number = &(*number)[part];
  }
  *number = value;
}

/// Parameter of a grid over the `scale` of a noise profile. The options in run.json hold the profile's
/// numbers times the level in place of `profile` and `scale`.
constexpr const char* profile_scale = "scale";

/// Returns true if `key` is one of the numbers that the scale of a profile multiplies.
bool is_scaled_by_profile(const std::string& key) {
  static const std::set<std::string> names = {"epe_px",     "epe_x_px", "epe_y_px",
                                              "delta_d_px", "step_px",  "radius_px"};
  return names.contains(key.substr(key.rfind('.') + 1));
}

/// Returns true if the noise of both levels is that of one profile times the level: numbers that differ are
/// in the ratio of the levels, and all else is equal. At level 0 the noise has no size.
bool are_of_profile(const ConfiguredLevel& a, const ConfiguredLevel& b) {
  Json rest_a = a.noise, rest_b = b.noise;
  bool has_size = false, is_empty = true;
  for (const auto& [key, number] : a.numbers) {
    if (!is_scaled_by_profile(key)) continue;
    is_empty = is_empty && number == 0;
    const auto other = b.numbers.find(key);
    if (other == b.numbers.end() || number == other->second) continue;
    const double scaled = number * b.level, expected = other->second * a.level;
    if (std::abs(scaled - expected) > 1e-9 * expected) continue;  // remains in both and makes them differ
    has_size = true;
    set_number(key, nullptr, rest_a);
    set_number(key, nullptr, rest_b);
  }
  if (a.level == 0) return is_empty;
  return b.level == 0 ? are_of_profile(b, a) : has_size && rest_a == rest_b;
}

/// Returns the grid of a level whose noise is that of a profile times the level.
Grid grid_of_profile(const ConfiguredLevel& level) {
  Json profile = level.noise;
  for (const auto& [key, number] : level.numbers) {
    if (is_scaled_by_profile(key))
      set_number(key, std::strtod(fmt::format("{:.6g}", number / level.level).c_str(), nullptr), profile);
  }
  return {profile_scale, json_line(profile), noise_name(profile)};
}

/// Returns the grid of a level whose noise is not none.
Grid grid_of(const ConfiguredLevel& level, const std::string& parameter) {
  if (parameter == profile_scale) return grid_of_profile(level);
  Json others = level.noise, without = level.noise;
  set_number(parameter, nullptr, others);
  set_number(parameter, 0, without);
  std::string label = noise_name(without);
  const size_t correlation = level.name.find(" (");
  if (label == "none" && correlation != std::string::npos) label += level.name.substr(correlation);
  return {parameter, json_line(others), label};
}

/// Returns true if the number `key` is the level at both levels and their noise is otherwise equal. At level
/// 0 the model of the number may be missing, because options list only models that have an effect.
bool is_swept(const std::string& key, const ConfiguredLevel& a, const ConfiguredLevel& b) {
  const std::string model = key.substr(0, key.find('.'));
  const auto is_level = [&](const ConfiguredLevel& level) {
    const auto it = level.numbers.find(key);
    if (it != level.numbers.end()) return it->second == level.level;
    return level.level == 0 && !level.noise.contains(model);
  };
  if (!is_level(a) || !is_level(b)) return false;
  const bool has_model = a.noise.contains(model) && b.noise.contains(model);
  const bool has_correlation = !a.noise.empty() && !b.noise.empty();
  const auto rest = [&](Json noise) {
    if (!has_correlation) noise.erase("correlation");
    if (!has_model) {
      noise.erase(model);
      return noise;
    }
    set_number(key, nullptr, noise);
    return noise;
  };
  return rest(a.noise) == rest(b.noise);
}

/// Determines the grid of each level. A grid consists of successive levels of which one parameter is
/// swept; it ends where no parameter fits the next level too. If a level 0 fits both the grid before it and
/// the grid after it, it is assigned to the grid after it.
void find_grids(std::vector<ConfiguredLevel>& levels) {
  using Keys = std::set<std::string>;
  const auto fits_profile = [&](size_t a, size_t b) {
    // Level 0 does not show the profile: two others must.
    if (levels[a].level > 0)
      return (levels[b].level > 0 || b > a + 1) && are_of_profile(levels[a], levels[b]);
    const size_t i = a + 1, j = std::max(b, a + 2);
    return j < levels.size() && are_of_profile(levels[a], levels[i]) && levels[i].level > 0 &&
           are_of_profile(levels[i], levels[j]);
  };
  const auto fitting = [&](const Keys& keys, size_t a, size_t b) {
    Keys fit;
    for (const std::string& key : keys) {
      if (key == profile_scale ? fits_profile(a, b) : is_swept(key, levels[a], levels[b])) fit.insert(key);
    }
    return fit;
  };
  const auto swept_by_two = [&](size_t a) {
    Keys keys;
    for (const size_t i : {a, a + 1}) {
      for (const auto& [key, value] : levels[i].numbers) keys.insert(key);
    }
    const Keys fit = fitting(keys, a, a + 1);
    return fit.empty() ? fitting({profile_scale}, a, a + 1) : fit;
  };
  size_t first = 0;  // of the grid
  Keys keys;         // parameters that fit the grid so far
  for (size_t i = 1; i <= levels.size(); ++i) {
    Keys longer;
    if (i < levels.size()) longer = i == first + 1 ? swept_by_two(first) : fitting(keys, first, i);
    const bool may_begin_next = i + 1 < levels.size() && levels[i].level == 0;
    if (may_begin_next && fitting(longer, first, i + 1).empty() && !swept_by_two(i).empty()) longer.clear();
    if (longer.empty()) {
      if (!keys.empty()) {
        const ConfiguredLevel& highest =
            *std::max_element(&levels[first], &levels[i - 1] + 1,
                              [](const auto& a, const auto& b) { return a.level < b.level; });
        const Grid grid = grid_of(highest, *keys.begin());
        for (size_t k = first; k < i; ++k) levels[k].grid = grid;
      }
      first = i;
    }
    keys = std::move(longer);
  }
}

/// Returns the noise levels of a run.json's configuration, in their order; none where it lists no levels.
std::vector<ConfiguredLevel> configured_levels(const Json& configuration) {
  const Json list = configuration.value("noise", Json());
  std::vector<ConfiguredLevel> levels;
  for (size_t i = 0; list.is_array() && i < list.size(); ++i) {
    const Json& entry = list[i];
    if (!entry.is_object() || !entry.contains("noise") || !entry["noise"].is_object()) return {};
    ConfiguredLevel level{.level = json_member<double>(entry, "level", "run.json: configuration.noise", 0),
                          .noise = entry["noise"],
                          .name = noise_name(entry["noise"])};
    level.numbers = numbers_of(level.noise);
    levels.push_back(std::move(level));
  }
  find_grids(levels);
  return levels;
}

/// Returns the grid of the first level that `is_level` accepts; otherwise that of level `position`, or none
/// if there are fewer levels.
template <typename IsLevel>
Grid find_grid(const std::vector<ConfiguredLevel>& levels, IsLevel is_level, size_t position) {
  const auto it = std::ranges::find_if(levels, is_level);
  if (it != levels.end()) return it->grid;
  return position < levels.size() ? levels[position].grid : Grid();
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

size_t NoiseSweep::n_levels() const {
  std::set<double> distinct;
  for (const NoiseLevelRef& level : levels) distinct.insert(level->key().level);
  return distinct.size();
}

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
  std::map<Grid, Content> by_grid;
  SameDefinitions definitions;
  SameLabels labels;
  GivenShards shards;
  SextantVersions versions;
  for (const std::filesystem::path& folder : folders) {
    const bool has_records = std::filesystem::exists(folder / "records.jsonl");
    if (!has_results(folder)) {
      fail("{}: has no records.jsonl or {}: expected the folder of a finished run or sweep", folder.string(),
           summary_file_name);
    }
    const Json run = std::filesystem::exists(folder / "run.json") ? read_run_json(folder) : Json::object();
    definitions.check(run, folder);
    labels.begin(run, folder);
    shards.add(run);
    versions.add(run, folder);
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
      uint64_t n_records = 0;
      for_each_record(folder / "records.jsonl", [&](const Record& record) {
        ++n_records;
        labels.check(record.estimator, record.dataset, record.sequence, record.noise, record.level);
        add(record);
      });
      const std::string missing = missing_records(run, n_records, folder);
      if (!missing.empty() && warnings != nullptr) warnings->push_back(missing);
    } else {
      for_each_summary(folder / summary_file_name, [&](const CaseSummary& summary) {
        for (const ResultSums& result : summary.results) {
          labels.check(Interned(result.estimator), Interned(summary.dataset), Interned(summary.sequence),
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
  if (warnings != nullptr) {
    std::ranges::copy(shards.warnings(), std::back_inserter(*warnings));
    std::ranges::copy(versions.warnings(), std::back_inserter(*warnings));
  }
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
