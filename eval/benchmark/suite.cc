#include "sextant/eval/benchmark/suite.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/figure.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

std::span<const EmbeddedFile> suite_files();

namespace {

/// Throws Error unless `json` is an object whose keys are all among `known`.
void check_keys(const Json& json, const std::vector<std::string>& known, const std::string& where) {
  if (!json.is_object()) fail("{}: expected an object, got {}", where, json_excerpt(json));
  for (const auto& item : json.items()) {
    if (std::ranges::find(known, item.key()) == known.end())
      fail("{}: unknown key '{}': {}", where, item.key(), suggest(item.key(), known));
  }
}

/// Throws Error unless the name is valid for a folder and a figure.
void check_file_stem(const std::string& name, const std::string& where) {
  if (name.empty() || name != file_stem(name))
    fail("{}: name '{}': expected 1 to 48 letters, digits, '.' and '_', with single '-' between them", where,
         name);
}

std::string name_in(const Json& json, const std::string& where) {
  const auto name = json_member<std::string>(json, "name", where);
  check_file_stem(name, where);
  return name;
}

std::vector<int> ids_in(const Json& json, const std::string& where) {
  if (!json.is_array()) fail("{}: expected a list of object ids, got {}", where, json_excerpt(json));
  std::vector<int> ids;
  for (const Json& id : json) {
    if (!id.is_number_integer()) fail("{}: expected an object id, got {}", where, json_excerpt(id));
    ids.push_back(id.get<int>());
  }
  return ids;
}

/// Throws Error unless the name is that of an error of which lower is better.
void check_metric(const std::string& name, const std::string& where) {
  std::vector<std::string> known;
  for (const MetricDefinition& metric : metric_definitions())
    if (metric.map == NumberMap::errors && metric.better == Better::lower) known.push_back(metric.name);
  if (std::ranges::find(known, name) == known.end())
    fail("{}: key 'metric': unknown error '{}': {}", where, name, suggest(name, known));
}

/// Appends the levels of the key "noise" of a plan: a grid, a single setting, or a list of these.
void add_levels(const Json& noise, std::vector<double>& levels) {
  if (noise.is_array()) {
    for (const Json& grid : noise) add_levels(grid, levels);
  } else if (noise.is_object()) {
    const Json of_grid = noise.value("levels", Json::array({noise.value("level", Json(0))}));
    for (const Json& level : of_grid)
      if (level.is_number()) levels.push_back(level.get<double>());
  }
}

void check_level(double level, const std::vector<double>& levels, const char* key, const std::string& where) {
  if (std::ranges::find(levels, level) == levels.end())
    fail("{}: key '{}': no plan of the track has level {}: expected one of {}", where, key, level,
         fmt::join(levels, ", "));
}

SuiteTrack track_in(const Json& json, const std::string& where) {
  check_keys(json, {"name", "title", "level", "nominal", "quick", "needs_data", "objects", "plans"}, where);
  SuiteTrack track{.name = name_in(json, where),
                   .title = json_member<std::string>(json, "title", where),
                   .level_title = json_member<std::string>(json, "level", where),
                   .nominal = json_member<double>(json, "nominal", where),
                   .needs_data = json_member<bool>(json, "needs_data", where, false)};
  for (const Json& level : json_list(json, "quick", where)) {
    if (!level.is_number()) fail("{}: key 'quick': expected levels, got {}", where, json_excerpt(level));
    track.quick.push_back(level.get<double>());
  }
  const Json objects = json_object(json, "objects", where);
  for (const auto& item : objects.items())
    track.objects[item.key()] = ids_in(item.value(), where + ": objects of " + item.key());
  const Json plans = json_object(json, "plans", where);
  if (plans.empty()) fail("{}: key 'plans': expected at least one plan", where);
  std::vector<double> levels;
  for (const auto& item : plans.items()) {
    const std::string of_plan = where + ": plan " + item.key();
    check_file_stem(item.key(), of_plan);
    check_keys(item.value(), {"sources", "noise", "seeds", "options"}, of_plan);
    if (!item.value().contains("noise")) fail("{}: key 'noise' is missing", of_plan);
    track.sweeps.push_back({item.key(), item.value()});
    add_levels(item.value()["noise"], levels);
  }
  check_level(track.nominal, levels, "nominal", where);
  for (const double level : track.quick) check_level(level, levels, "quick", where);
  return track;
}

bool is_quick(const SuiteTrack& track, const Json& level) {
  return level.is_number() && std::ranges::find(track.quick, level.get<double>()) != track.quick.end();
}

/// Reduces the key "noise" of a plan for a quick run; null if nothing remains.
Json quick_noise(const SuiteTrack& track, Json noise) {
  if (noise.is_array()) {
    Json grids = Json::array();
    for (const Json& grid : noise) grids.push_back(quick_noise(track, grid));
    std::erase_if(grids.get_ref<Json::array_t&>(), [](const Json& grid) { return grid.is_null(); });
    return grids.empty() ? Json() : grids;
  }
  if (!noise.contains("levels")) return is_quick(track, noise.value("level", Json(0))) ? noise : Json();
  Json levels = Json::array();
  for (const Json& level : noise["levels"]) {
    if (is_quick(track, level)) levels.push_back(level);
  }
  noise["levels"] = std::move(levels);
  return noise["levels"].empty() ? Json() : noise;
}

}  // namespace

bool SuiteTrack::counts(const Record& record) const {
  if (!has_truth(record)) return false;
  if (record.is_ego() || objects.empty()) return true;
  const auto listed = objects.find(record.sequence);
  return listed != objects.end() &&
         std::ranges::find(listed->second, body_order(record.body)) != listed->second.end();
}

const SuiteTrack& Suite::track(const std::string& track_name) const {
  return find_entry(std::span<const SuiteTrack>(tracks), track_name, "track of suite " + name);
}

std::string Suite::symbol() const { return sextant::metric(NumberMap::errors, metric).symbol; }

std::string Suite::breakdown_text() const {
  return fmt::format("the mean of {} is {} that of the nominal level, or coverage falls below {:g} %",
                     symbol(), error_ratio == 2 ? "twice" : fmt::format("{:g} times", error_ratio),
                     100 * min_coverage);
}

BodyKind kind_of(const Record& record) { return record.is_ego() ? BodyKind::camera : BodyKind::object; }

Suite parse_suite(std::string_view text, const std::string& name) {
  const Json json = parse_json(text, name);
  check_keys(json, {"name", "title", "metric", "breakdown", "tracks"}, name);
  Suite suite{.name = name_in(json, name),
              .title = json_member<std::string>(json, "title", name),
              .metric = json_member<std::string>(json, "metric", name),
              .sha256 = sha256(text)};
  if (suite.name.ends_with(".json"))
    fail("{}: name '{}': expected a name that does not end like that of a file", name, suite.name);
  check_metric(suite.metric, name);
  const Json breakdown = json_object(json, "breakdown", name);
  const std::string where = name + ": breakdown";
  check_keys(breakdown, {"error_ratio", "min_coverage"}, where);
  suite.error_ratio = json_member<double>(breakdown, "error_ratio", where);
  suite.min_coverage = json_member<double>(breakdown, "min_coverage", where);
  if (suite.error_ratio <= 1)
    fail("{}: key 'error_ratio': expected more than 1, got {}", where, suite.error_ratio);
  if (suite.min_coverage < 0 || suite.min_coverage > 1)
    fail("{}: key 'min_coverage': expected 0 to 1, got {}", where, suite.min_coverage);
  std::set<std::string> folders;
  for (const Json& track : json_list(json, "tracks", name)) {
    suite.tracks.push_back(track_in(track, fmt::format("{}: track {}", name, suite.tracks.size() + 1)));
    for (const SuiteSweep& sweep : suite.tracks.back().sweeps) {
      if (!folders.insert(sweep.name).second) fail("{}: plan {} is given twice", name, sweep.name);
    }
  }
  if (suite.tracks.empty()) fail("{}: key 'tracks': expected at least one track", name);
  return suite;
}

Suite own_suite(const std::string& name) {
  return parse_suite(find_entry(suite_files(), name, "suite").text, name);
}

Suite find_suite(const std::string& name) {
  return name.ends_with(".json") ? parse_suite(read_file(name, json_file), name) : own_suite(name);
}

std::string plan_text(const Suite& suite, const SuiteTrack& track, const SuiteSweep& sweep,
                      const Json& estimator, bool quick) {
  Json plan = {{"name", fmt::format("{}, {}{}", suite.name, sweep.name, quick ? quick_ending : "")},
               {"estimators", Json::array({estimator})}};
  plan.update(sweep.plan);
  if (quick) {
    plan["noise"] = quick_noise(track, plan["noise"]);
    plan["seeds"] = 1;
    if (plan["noise"].is_null()) return "";
  }
  return json_text(plan);
}

}  // namespace sextant
