#include "sextant/eval/external/rescore.h"

#include "sextant/base/error.h"
#include "sextant/base/json.h"
#include "sextant/eval/external/external_config.h"

namespace sextant {
namespace {

Json read_object(const fs::path& path) {
  Json json = read_json(path);
  if (!json.is_object()) fail("{}: expected a JSON object", path.string());
  return json;
}

const Json& member(const Json& json, const char* key, const fs::path& path) {
  if (!json.contains(key))
    fail("{}: has no \"{}\": expected the run.json of a finished run, or the plan.json of a finished sweep",
         path.string(), key);
  return json[key];
}

bool is_external(const Json& name) {
  return name.is_string() && name.get<std::string>().starts_with("external:");
}

/// Replaces name and options of the estimator according to the request.
void replace_estimator(const RescoreRequest& request, Json& name, Json& options) {
  const Json changes = request.options.value("estimator", Json::object());
  if (!request.config.empty()) {
    name = "external:" + request.config;
    options = changes;
    return;
  }
  options[recorded_options] = true;
  options.merge_patch(changes);
}

}  // namespace

bool is_sweep(const fs::path& folder) {
  if (fs::exists(folder / "plan.json")) return true;
  if (!fs::exists(folder / "run.json"))
    fail("{}: holds neither run.json nor plan.json: expected the folder of a finished run or sweep",
         folder.string());
  return false;
}

RunConfig rescored_run(const RescoreRequest& request) {
  const fs::path path = request.folder / "run.json";
  const Json run = read_object(path);
  const Json recorded = member(run, "configuration", path);
  if (recorded.contains("estimators"))
    fail("{}: belongs to a sweep, but this folder has no plan.json: expected the folder of the sweep itself",
         path.string());
  RunConfig config;
  try {
    for (const Json& source : member(recorded, "sources", path))
      config.sources.push_back(find_source(source.get<std::string>(), request.data_root));
    Json name = member(recorded, "estimator", path);
    if (!is_external(name))
      fail("{}: estimator {} is not an external program: run it again instead", path.string(),
           json_excerpt(name));
    Json options = member(recorded, "options", path), changes = request.options;
    replace_estimator(request, name, options["estimator"]);
    changes.erase("estimator");
    options.merge_patch(changes);
    config.estimator = name.get<std::string>();
    config.options = options;
    config.noise = Noise(member(recorded, "noise", path));
    config.level = json_member<double>(recorded, "level", path.string());
    config.n_seeds = json_member<int>(recorded, "seeds", path.string());
  } catch (const Json::exception& error) {
    fail("{}: has no valid configuration of a run: {}", path.string(), error.what());
  }
  config.folder = request.folder / "external";
  config.rescore = true;
  return config;
}

SweepConfig rescored_sweep(const RescoreRequest& request) {
  const fs::path path = request.folder / "plan.json";
  const Json file = read_object(path);
  Json plan = member(file, "plan", path), changes = request.options;
  SweepConfig config;
  try {
    int n_external = 0;
    for (Json& estimator : plan.at("estimators")) {
      if (!is_external(estimator.at("name"))) continue;
      ++n_external;
      replace_estimator(request, estimator["name"], estimator["options"]);
    }
    if (n_external == 0) fail("{}: has no external program among its estimators", path.string());
    if (n_external > 1 && !request.config.empty())
      fail("{}: has {} external programs: --config is for one; edit their files, or use --set", path.string(),
           n_external);
    changes.erase("estimator");
    plan["options"].merge_patch(changes);
    const Json& shard = member(file, "shard", path);
    const char* wrong = nullptr;
    for (const auto& [i, number] : {std::pair{0, &config.shard}, std::pair{1, &config.n_shards}})
      if (const char* expected = internal::read_value(shard.at(i), *number)) wrong = expected;
    if (wrong != nullptr || shard.size() != 2 || config.shard >= config.n_shards)
      fail("{}: key 'shard': expected [I, N] with 0 <= I < N, got {}", path.string(), json_excerpt(shard));
  } catch (const Json::exception& error) {
    fail("{}: is not the plan file of a sweep: {}", path.string(), error.what());
  }
  config.plan = parse_plan(json_text(plan), path.string(), request.data_root);
  config.rescored = request.folder;
  return config;
}

}  // namespace sextant
