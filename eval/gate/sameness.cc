#include "sextant/eval/gate/sameness.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <functional>
#include <map>

#include "sextant/eval/records/fingerprint.h"

namespace sextant {
namespace {

constexpr const char* absent = "(not recorded)";
constexpr size_t shown_digits = 12;  ///< digits of the SHA-256 that are shown of a program's file

/// Leaves of a tree by dotted path, as text. An empty object or list is a leaf.
using Leaves = std::map<std::string, std::string>;

void collect(const Json& tree, const std::string& path, Leaves& leaves) {
  if ((tree.is_object() || tree.is_array()) && !tree.empty()) {
    for (const auto& item : tree.items()) {
      collect(item.value(), path.empty() ? item.key() : path + "." + item.key(), leaves);
    }
  } else if (!tree.is_null()) {
    leaves[path] = tree.is_string() ? tree.get<std::string>() : json_line(tree);
  }
}

Leaves leaves_of(const Json& tree, const std::string& path) {
  Leaves leaves;
  collect(tree, path, leaves);
  return leaves;
}

/// Removes the folder of a source, "vdo:/data/kitti_03_demo@0-19" -> "vdo:kitti_03_demo@0-19", because the
/// place of data is not a property of the data.
std::string without_folder(const std::string& source) {
  const size_t colon = source.find(':');
  const size_t slash = source.substr(0, source.find('#')).rfind('/');
  if (colon == std::string::npos || slash == std::string::npos || slash < colon) return source;
  return source.substr(0, colon + 1) + source.substr(slash + 1);
}

Json configuration_of(const Json& run) {
  Json configuration = run.value("configuration", Json());
  if (!configuration.is_object()) return configuration;
  configuration.erase("name");  // name of the plan
  if (configuration.contains("sources") && configuration["sources"].is_array()) {
    for (Json& source : configuration["sources"]) {
      Json& text = source.is_object() && source.contains("source") ? source["source"] : source;
      if (text.is_string()) text = without_folder(text.get<std::string>());
    }
  }
  return configuration;
}

/// Collects for every source the hashes of its files, those of its correspondence caches (data, extraction,
/// version), and its description.
Leaves data_of(const Json& run) {
  Leaves leaves;
  const Json sources = run.value("sources", Json::array());
  if (!sources.is_array()) return leaves;
  for (const Json& source : sources) {
    if (!source.is_object()) continue;
    const std::string name = without_folder(source.value("source", std::string()));
    for (const char* key : {"provenance", "packs", "rate_hz", "width_px", "height_px", "camera"}) {
      if (source.contains(key)) leaves.merge(leaves_of(source[key], name + " " + key));
    }
    const Json inputs = source.value("inputs", Json::object());
    for (const auto& [path, entry] : inputs.items()) {
      const std::filesystem::path whole(
          path);  // the last two parts of a path identify a file independently of the machine
      const std::string tail = (whole.parent_path().filename() / whole.filename()).string();
      if (entry.is_object()) leaves[name + " " + tail] += entry.value("sha256", std::string("?"));
    }
  }
  return leaves;
}

/// Collects the leaves below some keys of a tree.
Leaves leaves_below(const Json& tree, std::initializer_list<const char*> keys) {
  Leaves leaves;
  for (const char* key : keys) {
    if (tree.contains(key)) leaves.merge(leaves_of(tree[key], key));
  }
  return leaves;
}

Leaves definitions_of(const Json& run) {
  return leaves_below(run, {"schema", "metric_definitions", "metric_presets", "preset"});
}

/// Collects the parts of the external programs, for every version of the estimators.
Leaves programs_of(const RunFolder& run) {
  Leaves leaves;
  for (const auto& [label, versions] : fingerprints_in(run.provenance, run.path + "/run.json")) {
    for (size_t i = 0; i < versions.size(); ++i) {
      const std::string name =
          versions.size() == 1 ? label : fmt::format("{} (version {} of {})", label, i + 1, versions.size());
      for (const auto& [part, content] : versions[i].parts)
        leaves[name + ": " + part] = content.substr(0, shown_digits);
    }
  }
  return leaves;
}

/// Adds a note for each estimator of which both sides ran the same version.
void tell_same_programs(const RunFolder& base, const RunFolder& fresh, std::vector<Mismatch>& findings) {
  const Fingerprints a = fingerprints_in(base.provenance, base.path + "/run.json");
  const Fingerprints b = fingerprints_in(fresh.provenance, fresh.path + "/run.json");
  for (const auto& [label, versions] : a) {
    const auto other = b.find(label);
    if (other == b.end() || other->second != versions || versions.size() != 1) continue;
    const std::string digits = versions.front().sha256().substr(0, shown_digits);
    findings.push_back(mismatch(Strictness::note, "same program", label, digits, digits));
  }
}

Leaves build_of(const Json& run) {
  return leaves_below(run, {"version", "git_commit", "compiler", "flags", "packages"});
}

Leaves machine_of(const BenchmarkFile& file) {
  return leaves_below(file.context, {"host_name", "num_cpus", "caches"});
}

Leaves benchmark_build_of(const BenchmarkFile& file) {
  return leaves_below(file.context, {"library_build_type", "json_schema_version"});
}

/// Returns true if a path that only one side has is a note; false if it is a difference.
using IsNoted = std::function<bool(const std::string& path, const Leaves& other)>;
const IsNoted never = [](const std::string&, const Leaves&) { return false; };

/// An option that only one version of the program knows cannot differ in value, so it is a note if the group
/// that contains it is known to both sides. A whole group, or an item of a list that both have, is a
/// difference.
bool is_new_option(const std::string& path, const Leaves& other) {
  const auto is_item = [&](size_t dot) {
    return std::isdigit(static_cast<unsigned char>(path[dot + 1])) != 0;
  };
  const auto has_below = [&](const std::string& group) {
    const auto leaf = other.lower_bound(group);
    return leaf != other.end() && leaf->first.starts_with(group);
  };
  size_t dot = path.rfind('.');
  if (dot != std::string::npos && dot > 0 && is_item(dot)) {  // an item of a list; the whole list may be new
    const std::string list = path.substr(0, dot);
    if (other.contains(list) || has_below(list + ".")) return false;
    dot = list.rfind('.');
  }
  if (dot == std::string::npos || is_item(dot)) return false;
  return has_below(path.substr(0, dot + 1));
}

void compare(const std::string& what, Strictness rule, const Leaves& base, const Leaves& fresh,
             std::vector<Mismatch>& findings, const IsNoted& is_noted = never) {
  Tally differ(what, rule), noted(what, Strictness::note);
  const auto add = [&](const std::string& path, const std::string& a, const std::string& b, bool is_note) {
    Tally& tally = is_note ? noted : differ;
    tally.add(path, a, b);
    tally.move_told(findings);
  };
  for (const auto& [path, value] : base) {
    const auto other = fresh.find(path);
    if (other == fresh.end()) {
      add(path, value, absent, is_noted(path, fresh));
    } else if (other->second != value) {
      add(path, value, other->second, false);
    }
  }
  for (const auto& [path, value] : fresh) {
    if (!base.contains(path)) add(path, absent, value, is_noted(path, base));
  }
  differ.move_to(findings);
  noted.move_to(findings);
}

void compare_runs(const RunFolder& base, const RunFolder& fresh, const Policy& policy,
                  std::vector<Mismatch>& findings) {
  if (base.provenance.is_null() && fresh.provenance.is_null()) {
    findings.push_back(mismatch(Strictness::note, "definitions", "run.json", absent, absent));
    return;
  }
  const Json a = base.provenance.is_null() ? Json::object() : base.provenance;
  const Json b = fresh.provenance.is_null() ? Json::object() : fresh.provenance;
  const SamenessPolicy& same = policy.same;
  compare("definitions", same.definitions, definitions_of(a), definitions_of(b), findings);
  // A run without correspondence caches does not have the key `packs`.
  compare("data", same.data, data_of(a), data_of(b), findings,
          [](const std::string& path, const Leaves&) { return path.find(" packs") != std::string::npos; });
  compare("configuration", same.configuration, leaves_of(configuration_of(a), ""),
          leaves_of(configuration_of(b), ""), findings, is_new_option);
  const bool times = policy.speed.judge && base.has_times && fresh.has_times;
  const Strictness machine_rule = times ? same.machine : Strictness::note;
  compare("machine", machine_rule, leaves_of(a.value("machine", Json()), ""),
          leaves_of(b.value("machine", Json()), ""), findings);
  compare("build", Strictness::note, build_of(a), build_of(b), findings);
  if (base.provenance.is_null() || fresh.provenance.is_null()) return;
  compare("program", Strictness::note, programs_of(base), programs_of(fresh), findings);
  tell_same_programs(base, fresh, findings);
}

}  // namespace

Mismatch mismatch(Strictness rule, std::string what, std::string subject, std::string base,
                  std::string fresh) {
  return {std::move(what), std::move(subject), std::move(base), std::move(fresh), rule == Strictness::must};
}

std::vector<Mismatch> compare_provenance(const Side& base, const Side& fresh, const Policy& policy) {
  std::vector<Mismatch> findings;
  for (const Side* side : {&base, &fresh}) {
    for (const RunFolder& run : side->runs) {
      if (!base.runs.empty() && &run != &base.runs.front())
        compare_runs(base.runs.front(), run, policy, findings);
    }
  }
  for (const Side* side : {&base, &fresh}) {
    for (const BenchmarkFile& file : side->benchmarks) {
      if (base.benchmarks.empty() || &file == &base.benchmarks.front()) continue;
      const BenchmarkFile& first = base.benchmarks.front();
      compare("machine", policy.speed.judge ? policy.same.machine : Strictness::note, machine_of(first),
              machine_of(file), findings);
      compare("definitions", policy.same.definitions, benchmark_build_of(first), benchmark_build_of(file),
              findings);
    }
  }
  // Repetitions yield the same findings; each is kept once.
  std::vector<Mismatch> once;
  for (Mismatch& f : findings) {
    const bool known = std::ranges::any_of(once, [&](const Mismatch& o) {
      return o.what == f.what && o.subject == f.subject && o.base == f.base && o.fresh == f.fresh;
    });
    if (!known) once.push_back(std::move(f));
  }
  return once;
}

}  // namespace sextant
