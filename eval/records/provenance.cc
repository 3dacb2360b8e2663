#include "sextant/eval/records/provenance.h"

#include <build_info.h>

#include <algorithm>
#include <fstream>
#include <thread>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

/// Returns "model name" of /proc/cpuinfo, if available.
std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

}  // namespace

std::string version() { return build_info::version; }
std::string git_commit() { return build_info::git_commit; }

Json program_identity() { return {{"version", version()}, {"git_commit", git_commit()}}; }

std::string program_text(const Json& programs) {
  if (!programs.is_array() || programs.empty()) return "unknown";
  const Json& first = programs.front();
  return fmt::format("{} (commit {})", first.value("version", "?"),
                     first.value("git_commit", "?").substr(0, 12));
}

Json build_provenance() {
  Json json;
  json["schema"] = 1;
  json["version"] = version();
  json["git_commit"] = git_commit();
  json["compiler"] = build_info::compiler;
  json["flags"] = build_info::flags;
  json["packages"] = {{"Eigen", build_info::eigen},
                      {"OpenCV", build_info::opencv},
                      {"Ceres", build_info::ceres},
                      {"fmt", build_info::fmt},
                      {"nlohmann_json", build_info::nlohmann_json}};
  json["machine"] = {{"cpu", cpu_model()}, {"cores", std::thread::hardware_concurrency()}};
  json["metric_definitions"] = metric_definitions_json();
  json["metric_presets"] = metric_presets_json();
  return json;
}

namespace {

void check_inputs(const Json& owner, const std::string& where) {
  const Json inputs = json_object(owner, "inputs", where);
  for (const auto& [path, input] : inputs.items()) {
    if (!input.is_string()) json_member<std::string>(input, "sha256", fmt::format("{}: '{}'", where, path));
  }
}

}  // namespace

Json read_run_json(const std::filesystem::path& folder) {
  const std::string file = (folder / "run.json").string();
  Json run = read_json(file);
  for (const char* key : {"version", "git_commit", "compiler", "flags"})
    json_member<std::string>(run, key, file, "");
  json_member<uint64_t>(run, "cases", file, 0);
  const Json machine = json_object(run, "machine", file);
  json_member<std::string>(machine, "cpu", file + ": machine", "");
  json_member<int>(machine, "cores", file + ": machine", 0);
  const Json packages = json_object(run, "packages", file);
  for (const auto& item : packages.items())
    json_member<std::string>(packages, item.key(), file + ": packages");
  json_object(run, "configuration", file);
  check_inputs(run, file);
  for (const char* list : {"noise", "sources"}) {
    for (const Json& entry : json_list(run, list, file)) {
      const std::string where = fmt::format("{}: {}", file, list);
      json_member<std::string>(entry, "source", where, "");
      json_member<double>(entry, "level", where, 0);
      check_inputs(entry, where);
    }
  }
  return run;
}

void for_each_leaf(const Json& tree, bool enters_lists,
                   const std::function<void(const std::string& key, const Json& value)>& visit,
                   const std::string& path) {
  if (tree.empty() || !(tree.is_object() || (enters_lists && tree.is_array()))) return visit(path, tree);
  for (const auto& item : tree.items())
    for_each_leaf(item.value(), enters_lists, visit, path.empty() ? item.key() : path + "." + item.key());
}

std::string without_folder(const std::string& source) {
  const size_t colon = source.find(':');
  const size_t slash = source.substr(0, source.find('#')).rfind('/');
  if (colon == std::string::npos || slash == std::string::npos || slash < colon) return source;
  return source.substr(0, colon + 1) + source.substr(slash + 1);
}

SourceData data_of(const Json& run) {
  SourceData data;
  const Json sources = run.value("sources", Json::array());
  if (!sources.is_array()) return data;
  for (const Json& source : sources) {
    if (!source.is_object()) continue;
    const std::string name = without_folder(source.value("source", std::string()));
    for (const char* key : {"provenance", "rate_hz", "width_px", "height_px", "camera"}) {
      if (!source.contains(key)) continue;
      for_each_leaf(
          source[key], true,
          [&](const std::string& leaf, const Json& value) {
            if (!value.is_null())
              data[leaf].insert(value.is_string() ? value.get<std::string>() : json_line(value));
          },
          name + " " + key);
    }
    const Json inputs = source.value("inputs", Json::object());
    for (const auto& [path, entry] : inputs.items()) {
      const std::filesystem::path whole(path);
      const std::string tail = (whole.parent_path().filename() / whole.filename()).string();
      if (entry.is_object()) data[name + " " + tail].insert(entry.value("sha256", std::string("?")));
    }
  }
  return data;
}

std::string changed_data(const SourceData& before, const SourceData& now) {
  for (const auto& [what, values] : now) {
    const auto known = before.find(what);
    if (known != before.end() && !std::ranges::includes(known->second, values) &&
        !std::ranges::includes(values, known->second))
      return what;
  }
  return "";
}

void check_unchanged_data(const std::filesystem::path& folder, const Json& now) {
  const std::string changed = changed_data(data_of(read_run_json(folder)), data_of(now));
  if (changed.empty()) return;
  const char* kind = std::filesystem::exists(folder / "plan.json") ? "sweep" : "run";
  fail("{}: holds a {} of data that have changed since ({}); restore the data, or start the {} over",
       folder.string(), kind, changed, kind);
}

std::optional<std::pair<uint64_t, uint64_t>> shard_of(const Json& run) {
  const Json shard = run.value("shard", Json());
  const auto is_count = [](const Json& number) { return number.is_number_unsigned(); };
  if (!shard.is_array() || shard.size() != 2 || !std::ranges::all_of(shard, is_count)) return std::nullopt;
  return std::pair(shard[0].get<uint64_t>(), shard[1].get<uint64_t>());
}

void check_whole_sweep(const Json& run, const std::filesystem::path& folder) {
  const auto shard = shard_of(run);
  if (shard && shard->second > 1)
    fail("{}: holds shard {} of {} of a sweep: merge the shards first (sextant merge)", folder.string(),
         shard->first, shard->second);
}

std::string missing_records(const Json& run, uint64_t n_records, const std::filesystem::path& folder) {
  if (!run.is_object()) return "";
  const auto stated = json_member<uint64_t>(run, "records", (folder / "run.json").string(), n_records);
  if (stated == n_records) return "";
  return fmt::format(
      "{}: records.jsonl holds {} records, but run.json states {}: one of the files was cut off or changed",
      folder.string(), n_records, stated);
}

std::string missing_errors(const std::filesystem::path& folder, uint64_t n) {
  return fmt::format(
      "{}: {} records have status ok, but no error of the motion: they count as estimated, and the means are "
      "over the other records; was records.jsonl edited?",
      folder.string(), n);
}

void SameDefinitions::check(const Json& run, const std::filesystem::path& folder) {
  const std::string file = (folder / "run.json").string();
  Json definitions = json_object(run, "metric_definitions", file);
  for (const auto& [metric, definition] : first_.items()) {
    if (definitions.contains(metric) && definitions[metric] != definition)
      fail("{}: {} is defined as {}, but in {} as {}: run again with one version of the program", file,
           metric, json_excerpt(definitions[metric]), first_file_, json_excerpt(definition));
  }
  if (first_.empty()) {
    first_ = std::move(definitions);
    first_file_ = file;
  }
}

std::string Fingerprint::sha256() const { return sextant::sha256(json_line(Json(parts))); }

Json Fingerprint::json() const { return {{"sha256", sha256()}, {"parts", parts}, {"not_seen", not_seen}}; }

Fingerprint Fingerprint::from(const Json& json, const std::string& where) {
  Fingerprint fingerprint;
  const Json parts = json_object(json, "parts", where);
  for (const auto& [name, ignored] : parts.items())
    fingerprint.parts[name] = json_member<std::string>(parts, name, where + ": parts");
  for (const Json& text : json_list(json, "not_seen", where)) {
    if (!text.is_string())
      fail("{}: key 'not_seen': expected a list of texts, got {}", where, json_excerpt(text));
    fingerprint.not_seen.push_back(text);
  }
  return fingerprint;
}

bool operator==(const Fingerprint& a, const Fingerprint& b) { return a.parts == b.parts; }

std::string difference(const Fingerprint& before, const Fingerprint& now) {
  constexpr size_t shown = 3;
  std::vector<std::string> all;
  for (const auto& [name, content] : now.parts) {
    const auto known = before.parts.find(name);
    if (known == before.parts.end()) {
      all.push_back(name + " is new");
    } else if (known->second != content) {
      all.push_back(name + " changed");
    }
  }
  for (const auto& [name, content] : before.parts) {
    if (!now.parts.contains(name)) all.push_back(name + " is gone");
  }
  const size_t n = all.size();
  if (n > shown) {
    all.resize(shown);
    all.push_back(fmt::format("{} more", n - shown));
  }
  return fmt::format("{}", fmt::join(all, ", "));
}

Json fingerprints_json(const Fingerprints& fingerprints) {
  Json json = Json::object();
  for (const auto& [label, versions] : fingerprints) {
    json[label] = Json::array();
    for (const Fingerprint& version : versions) json[label].push_back(version.json());
  }
  return json;
}

Fingerprints fingerprints_in(const Json& file, const std::string& where) {
  Fingerprints fingerprints;
  const Json labels = json_object(file, fingerprints_key, where);
  for (const auto& [label, ignored] : labels.items()) {
    const std::string here = fmt::format("{}: {}", where, fingerprints_key);
    for (const Json& version : json_list(labels, label, here))
      fingerprints[label].push_back(Fingerprint::from(version, fmt::format("{} '{}'", here, label)));
  }
  return fingerprints;
}

}  // namespace sextant
