#include "sextant/eval/experiment/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"

namespace sextant {
namespace {

/// Reads a plan; its error messages name the line of the key.
class PlanReader {
 public:
  PlanReader(std::string_view text, std::string name, const std::string& data_root)
      : text_(text), name_(std::move(name)), data_root_(data_root) {}

  Plan read() {
    Json json = parse_json(text_, name_);
    if (!json.is_object()) fail_at(0, "expected an object with \"sources\"");
    check_keys(json, {"name", "procedure", "sources", "estimators", "noise", "seeds", "options", "keep"});
    if (json.contains("procedure")) {
      in("procedure", [&] { json = on_procedure(text_of(json["procedure"], "procedure"), json); });
    }
    Plan plan;
    plan.name = json.contains("name") ? text_of(json["name"], "name") : fs::path(name_).stem().string();
    in("sources", [&] { read_sources(json, plan); });
    in("options", [&] { read_options_of(json, plan); });
    in("estimators", [&] { read_estimators(json, plan); });
    in("noise", [&] { read_noise(json, plan); });
    in("seeds", [&] { read_seeds(json, plan); });
    in("keep", [&] { plan.keep = kept(json, "plan"); });
    check_size(plan);
    return plan;
  }

 private:
  int line_of(size_t position) const {
    return 1 + static_cast<int>(
                   std::count(text_.begin(), text_.begin() + static_cast<ptrdiff_t>(position), '\n'));
  }

  [[noreturn]] void fail_at(size_t position, const std::string& message) const {
    fail("{}:{}: {}", name_, line_of(position), message);
  }

  size_t position_of(const std::string& word, size_t from = 0) const {
    const size_t at = text_.find(fmt::format("\"{}\"", word), from);
    return at == std::string_view::npos ? from : at;
  }

  /// Runs the function that reads `key`; an error in it gets the line of the word that the message quotes, or
  /// of the key.
  template <typename Part>
  void in(const std::string& key, const Part& part) const {
    try {
      part();
    } catch (const Error& error) {
      const size_t section = position_of(key);
      fail_at(position_of(quoted(error.what()), section), fmt::format("{}: {}", key, error.what()));
    }
  }

  /// Returns the last component of the first 'dotted.name' in a message.
  static std::string quoted(const std::string& message) {
    const size_t from = message.find('\'');
    const size_t to = from == std::string::npos ? from : message.find('\'', from + 1);
    if (to == std::string::npos) return "";
    const std::string word = message.substr(from + 1, to - from - 1);
    const size_t dot = word.rfind('.');
    const std::string last = dot == std::string::npos ? word : word.substr(dot + 1);
    return last;
  }

  void check_keys(const Json& json, const std::vector<std::string>& known) const {
    for (const auto& item : json.items()) {
      if (std::ranges::find(known, item.key()) != known.end()) continue;
      fail_at(position_of(item.key()),
              fmt::format("unknown key '{}': {}", item.key(), suggest(item.key(), known)));
    }
  }

  static std::string text_of(const Json& json, const std::string& key) {
    if (!json.is_string() || json.get<std::string>().empty()) {
      fail("key '{}': expected a text, got {}", key, json_excerpt(json));
    }
    return json.get<std::string>();
  }

  static const Json& list_of(const Json& json, const std::string& key) {
    if (!json.contains(key)) fail("key '{}' is missing", key);
    if (!json[key].is_array() || json[key].empty()) {
      fail("key '{}': expected a list that is not empty, got {}", key, json_excerpt(json[key]));
    }
    return json[key];
  }

  void read_sources(const Json& json, Plan& plan) const {
    std::vector<SequenceInfo> seen;
    for (const Json& entry : list_of(json, "sources")) {
      Json source = entry;
      if (entry.is_string()) source = {{"source", entry}};
      if (!source.is_object())
        fail("expected a SOURCE, or {{\"source\", \"options\"}}, got {}", json_excerpt(entry));
      check_keys(source, {"source", "options"});
      const std::string text = text_of(source.value("source", Json()), "source");
      SourceSpec spec = find_source(text, data_root_);
      spec.add_options(source.value("options", Json::object()));
      try {
        const std::unique_ptr<Sequence> opened = open_source(spec);
        const SequenceInfo& info = opened->info();
        const bool twice =
            std::ranges::any_of(seen, [&](const SequenceInfo& other) { return share_pairs(other, info); });
        seen.push_back(info);
        if (twice) {
          fail(
              "its frames of {} sequence {} are also those of an earlier source of the plan: list each frame "
              "pair once",
              info.dataset, info.sequence);
        }
      } catch (const Error& error) {
        fail("'{}': {}", text, error.what());
      }
      plan.sources.push_back(std::move(spec));
    }
  }

  void read_estimators(const Json& json, Plan& plan) const {
    std::set<std::string> labels;
    for (const Json& entry : list_of(json, "estimators")) {
      Json estimator = entry;
      if (entry.is_string()) estimator = {{"name", entry}};
      if (!estimator.is_object()) {
        fail("expected a name, or {{\"name\", \"options\", \"label\", \"extraction\", \"pipeline\"}}, got {}",
             json_excerpt(entry));
      }
      check_keys(estimator, {"name", "options", "label", "extraction", "pipeline"});
      PlanEstimator out{.extraction = plan.extraction, .pipeline = plan.pipeline};
      read_options(estimator.value("extraction", Json::object()), out.extraction, "extraction");
      read_options(estimator.value("pipeline", Json::object()), out.pipeline, "pipeline");
      out.name = text_of(estimator.value("name", Json()), "name");
      out.estimator = make_case_estimator(out.name, estimator.value("options", Json::object()),
                                          fs::path(name_).parent_path());
      out.label = estimator.contains("label") ? text_of(estimator["label"], "label") : out.estimator->label();
      out.options = out.estimator->options();
      if (!labels.insert(out.label).second) {
        fail("'{}' is repeated in the plan: give each estimator its own label", out.label);
      }
      plan.estimators.push_back(std::move(out));
    }
  }

  void read_noise(const Json& json, Plan& plan) const {
    if (!json.contains("noise")) {
      plan.levels = {PlanLevel{}};
      return;
    }
    const Json grids = json["noise"].is_array() ? json["noise"] : Json::array({json["noise"]});
    if (grids.empty()) fail("key 'noise': expected a grid, or a list of them that is not empty");
    for (const Json& grid : grids) add_grid(grid, plan);
    std::set<std::pair<std::string, double>> seen, names;
    for (const PlanLevel& level : plan.levels) {
      if (!seen.emplace(json_line(level.noise.options()), level.level).second) {
        fail("level {} ({}) is repeated: list each level of a noise once", level.level, level.noise.name());
      }
      if (!names.emplace(level.noise.name(), level.level).second) {
        fail("level {}: two different noises have the same name '{}' in records: give them different levels",
             level.level, level.noise.name());
      }
    }
  }

  void add_grid(const Json& grid, Plan& plan) const {
    if (!grid.is_object()) fail("expected {{\"parameter\", \"levels\"}}, got {}", json_excerpt(grid));
    if (grid.contains("level") || grid.contains("noise")) {
      check_keys(grid, {"level", "noise"});
      const bool is_zero = grid.contains("level") && grid["level"] == 0;  // the level without noise
      for (const char* key : {"level", "noise"})
        if (!grid.contains(key) && !is_zero)
          fail("key '{}' is missing: a setting has \"level\" and \"noise\", which is {{}} without noise",
               key);
      plan.levels.push_back({level_of(grid["level"], "level"), Noise(grid.value("noise", Json::object()))});
      return;
    }
    check_keys(grid, {"parameter", "levels", "base"});
    const std::string parameter = text_of(grid.value("parameter", Json()), "parameter");
    std::map<std::string, double> level_of_noise;  // by options
    for (const Json& value : list_of(grid, "levels")) {
      Json noise = grid.value("base", Json::object());
      if (!noise.is_object()) fail("key 'base': expected an object, got {}", json_excerpt(noise));
      Json* node = &noise;
      for (const std::string& part : split(parameter, '.')) {
        if (part.empty() || !(node->is_object() || node->is_null())) {
          fail(
              "key 'parameter': '{}' does not name a number of the noise: expected one such as "
              "depth.delta_d_px",
              parameter);
        }
        node = &(*node)[part];
      }
      *node = value;
      const Json bodies = noise.value(Json::json_pointer("/flow/bodies"), Json::object());
      if (parameter.starts_with("flow.epe_") && bodies.contains("background") && bodies.contains("objects")) {
        fail(
            "'{}' does not change the noise, because flow.bodies sets that of the background and of "
            "all objects",
            parameter);
      }
      plan.levels.push_back({level_of(value, "levels"), Noise(noise)});
      const PlanLevel& level = plan.levels.back();
      const auto it = level_of_noise.try_emplace(json_line(level.noise.options()), level.level).first;
      if (it->second != level.level || (level.level > 0 && level.noise.none())) {
        fail(
            "'{}' does not change the noise, which is '{}' at level {}: give the noise that this parameter "
            "changes in 'base'",
            parameter, level.noise.name(), level.level);
      }
    }
  }

  static double level_of(const Json& json, const char* key) {
    if (!json.is_number() || !std::isfinite(json.get<double>()) || json.get<double>() < 0) {
      fail("key '{}': expected finite numbers of 0 or more, got {}", key, json_excerpt(json));
    }
    return json.get<double>();
  }

  static void read_seeds(const Json& json, Plan& plan) {
    const Json seeds = json.value("seeds", Json(1));
    const auto whole = [](const Json& value) {
      return value.is_number_unsigned() || (value.is_number_integer() && value.get<int64_t>() >= 0);
    };
    uint64_t first = 0, count = 0;
    if (seeds.is_array()) {
      for (const Json& seed : seeds) {
        if (!whole(seed))
          fail("key 'seeds': expected whole numbers of 0 or more, got {}", json_excerpt(seed));
        plan.seeds.push_back(seed.get<uint64_t>());
      }
      if (std::set<uint64_t>(plan.seeds.begin(), plan.seeds.end()).size() != plan.seeds.size()) {
        fail("key 'seeds': a seed is repeated: list each seed once");
      }
    } else if (seeds.is_object() && seeds.contains("count") && whole(seeds["count"])) {
      if (seeds.contains("first") && !whole(seeds["first"])) {
        fail("key 'first': expected a whole number of 0 or more, got {}", json_excerpt(seeds["first"]));
      }
      first = seeds.value("first", uint64_t{0});
      count = seeds["count"].get<uint64_t>();
    } else if (whole(seeds)) {
      count = seeds.get<uint64_t>();
    } else {
      fail("key 'seeds': expected a number, a list, or {{\"first\", \"count\"}}, got {}",
           json_excerpt(seeds));
    }
    if (count > max_plan_cases)
      fail("key 'seeds': {} seeds are more than the {} cases that a plan may have", count, max_plan_cases);
    if (count > 0 && first > std::numeric_limits<uint64_t>::max() - (count - 1))
      fail("key 'first': {} and the {} seeds after it go beyond 2^64 - 1", first, count - 1);
    for (uint64_t i = 0; i < count; ++i) plan.seeds.push_back(first + i);
    if (plan.seeds.empty()) fail("key 'seeds': expected at least one seed");
  }

  void read_options_of(const Json& json, Plan& plan) const {
    const Json options = json.value("options", Json::object());
    if (!options.is_object()) fail("expected an object, got {}", json_excerpt(options));
    check_keys(options, {"extraction", "pipeline"});
    read_options(options.value("extraction", Json::object()), plan.extraction, "extraction");
    read_options(options.value("pipeline", Json::object()), plan.pipeline, "pipeline");
  }

  void check_size(const Plan& plan) const {
    const double n = static_cast<double>(plan.sources.size()) * static_cast<double>(plan.estimators.size()) *
                     static_cast<double>(plan.levels.size()) * static_cast<double>(plan.seeds.size());
    if (n <= static_cast<double>(max_plan_cases)) return;
    fail_at(
        position_of("seeds"),
        fmt::format(
            "seeds: {:.3g} cases (sources x estimators x levels x seeds) are more than the {} that a plan "
            "may have",
            n, max_plan_cases));
  }

  std::string_view text_;
  std::string name_;
  const std::string& data_root_;
};

/// Returns a list of seeds, as {"first", "count"} if they are consecutive and many.
Json seeds_json(const std::vector<uint64_t>& seeds) {
  constexpr size_t long_list = 1000;
  const auto gap = std::ranges::adjacent_find(seeds, [](uint64_t a, uint64_t b) { return b != a + 1; });
  if (seeds.size() <= long_list || gap != seeds.end()) return seeds;
  return {{"first", seeds.front()}, {"count", seeds.size()}};
}

void add_changed(const char* key, const Json& options, const Json& of_plan, Json& entry) {
  if (options != of_plan) entry[key] = options;
}

}  // namespace

PlanCase Plan::at(uint64_t number) const {
  PlanCase c;
  c.number = number;
  c.seed = seeds[number % seeds.size()];
  number /= seeds.size();
  c.level = number % levels.size();
  number /= levels.size();
  c.estimator = number % estimators.size();
  c.source = number / estimators.size();
  return c;
}

CaseSettings case_settings(const Plan& plan, const PlanCase& c) {
  const PlanEstimator& estimator = plan.estimators[c.estimator];
  const PlanLevel& level = plan.levels[c.level];
  return {estimator.label, estimator.estimator, estimator.pipeline, level.noise, level.level, c.seed};
}

bool share_pairs(const SequenceInfo& a, const SequenceInfo& b) {
  return a.dataset == b.dataset && a.sequence == b.sequence && a.first_frame < b.last_frame &&
         b.first_frame < a.last_frame;
}

Json Plan::json() const {
  Json out;
  out["name"] = name;
  out["sources"] = Json::array();
  for (const SourceSpec& source : sources) {
    out["sources"].push_back({{"source", source.text}, {"options", source.options}});
  }
  out["estimators"] = Json::array();
  for (const PlanEstimator& e : estimators) {
    Json entry = {{"name", e.name}, {"label", e.label}, {"options", e.options}};
    add_changed("extraction", write_options(e.extraction), write_options(extraction), entry);
    add_changed("pipeline", write_options(e.pipeline), write_options(pipeline), entry);
    out["estimators"].push_back(std::move(entry));
  }
  out["noise"] = Json::array();
  for (const PlanLevel& level : levels) {
    out["noise"].push_back({{"level", level.level}, {"noise", level.noise.options()}});
  }
  out["seeds"] = seeds_json(seeds);
  out["options"] = {{"extraction", write_options(extraction)}, {"pipeline", write_options(pipeline)}};
  if (keep != KeepOfCases::records) out["keep"] = std::string(to_string(keep));
  return out;
}

KeepOfCases kept(const Json& plan, const std::string& where) {
  return from_name<KeepOfCases>(
      json_member<std::string>(plan, "keep", where, std::string(to_string(KeepOfCases::records))),
      "value of 'keep'");
}

uint64_t planned_seeds(const Json& plan, const std::string& where) {
  if (!plan.contains("seeds") || !plan["seeds"].is_object()) return json_list(plan, "seeds", where).size();
  return json_member<uint64_t>(plan["seeds"], "count", where + ": seeds");
}

std::vector<uint64_t> cases_of_shard(const Plan& plan, uint64_t shard, uint64_t n_shards) {
  // The cases of a source are ordered as j * step modulo their number, with step coprime to it and near the
  // golden section, so that adjacent numbers are far apart. A shard is a block of that order.
  const uint64_t n = plan.n_cases();
  const uint64_t per_source = n / plan.sources.size();
  uint64_t step = std::max<uint64_t>(1, static_cast<uint64_t>(static_cast<double>(per_source) * 0.618));
  while (std::gcd(step, per_source) != 1) ++step;
  const auto first = [&](uint64_t k) { return n / n_shards * k + n % n_shards * k / n_shards; };
  const uint64_t begin = first(shard), end = first(shard + 1);
  std::vector<uint64_t> numbers;
  for (uint64_t place = begin; place < end; ++place) {
    const uint64_t source = place / per_source;
    numbers.push_back(source * per_source + place % per_source * step % per_source);
  }
  std::ranges::sort(numbers);
  return numbers;
}

Plan parse_plan(std::string_view text, const std::string& name, const std::string& data_root) {
  return PlanReader(text, name, data_root).read();
}

std::span<const EmbeddedFile> procedure_files();

std::vector<std::string> procedure_names() {
  std::vector<std::string> names;
  for (const EmbeddedFile& file : procedure_files()) names.emplace_back(file.name);
  return names;
}

Json find_procedure(const std::string& name) {
  return parse_json(find_entry(procedure_files(), name, "procedure").text, name);
}

Json on_procedure(const std::string& name, const Json& plan) {
  Json merged = find_procedure(name);
  merged.erase("description");
  merged.merge_patch(plan);
  merged.erase("procedure");
  return merged;
}

Json procedure_options(const std::string& name, const std::string& estimator) {
  const Json procedure = find_procedure(name);
  std::vector<std::string> known;
  for (const Json& entry : procedure.at("estimators")) {
    if (entry.at("name") != estimator) {
      known.push_back(entry.at("name"));
      continue;
    }
    Json options = procedure.value("options", Json::object());
    for (const char* key : {"extraction", "pipeline"}) {
      if (entry.contains(key)) options[key].merge_patch(entry[key]);
    }
    options["estimator"] = entry.value("options", Json::object());
    return options;
  }
  fail("procedure '{}' has no estimator '{}': {}", name, estimator, suggest(estimator, known));
}

}  // namespace sextant
