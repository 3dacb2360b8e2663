#include "sextant/eval/gate/side.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <functional>
#include <map>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

namespace {

std::string case_name(const Subject& s, const SeedFrame& at) {
  return fmt::format("{} {} {} noise '{}' level {} seed {} frame {} {}", s.dataset, s.sequence, s.estimator,
                     s.noise, s.level, at.first, at.second, s.body);
}

RunFolder read_run(const fs::path& folder) {
  RunFolder run;
  run.path = folder.string();
  if (fs::exists(folder / "journal.jsonl")) {
    fail("{}: its sweep is not finished: run its command again to resume it", run.path);
  }
  const std::string file = (folder / "records.jsonl").string();
  SubjectCollector collector;
  for_each_record(folder / "records.jsonl",
                  [&](const Record& record) { collector.add(record, ++run.n_cases); });
  if (run.n_cases == 0)
    fail("{}: has no records: expected one line for each body in each pair of frames", file);
  run.has_times = collector.has_times();
  run.subjects = collector.take();
  for (const auto& [subject, cases] : run.subjects) {
    for (size_t row = 1; row < cases.size(); ++row) {
      if (cases.case_of(row) == cases.case_of(row - 1))
        fail("{}: the record '{}' occurs twice", file, case_name(subject, cases.case_of(row)));
    }
  }
  if (!fs::exists(folder / "run.json")) return run;
  run.provenance = read_run_json(folder);
  check_whole_sweep(run.provenance, folder);
  return run;
}

/// Reads the results that lie directly in `folder`.
void read_folder(const fs::path& folder, Side& side) {
  if (has_results(folder) || fs::exists(folder / "journal.jsonl")) {
    side.runs.push_back(read_run(folder));
  }
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (is_benchmark_file(entry)) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (const fs::path& file : files)
    side.benchmarks.push_back(parse_benchmark_file(read_file(file, json_file), file.string()));
}

bool is_empty(const Side& side) { return side.runs.empty() && side.benchmarks.empty(); }

}  // namespace

bool is_benchmark_file(const fs::directory_entry& entry) {
  return entry.is_regular_file() && entry.path().filename().string().starts_with("benchmark") &&
         entry.path().extension() == ".json";
}

Side read_side(const fs::path& path) {
  Side side;
  side.path = path.string();
  if (!fs::exists(path)) fail("{}: does not exist: expected results to compare", side.path);
  if (path.extension() == ".jsonl") {
    fail("{}: expected the folder of this file, whose run.json describes the records", side.path);
  }
  if (fs::is_regular_file(path)) {
    side.benchmarks.push_back(parse_benchmark_file(read_file(path, json_file), side.path));
    return side;
  }
  read_folder(path, side);
  if (!is_empty(side)) return side;
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    if (entry.is_directory()) folders.push_back(entry.path());
  }
  std::ranges::sort(folders);
  for (const fs::path& folder : folders) read_folder(folder, side);
  if (is_empty(side)) {
    fail("{}: holds no results: expected records.jsonl, benchmark*.json, or folders with these", side.path);
  }
  return side;
}

OutputFiles baseline_files(const std::filesystem::path& run) {
  const Side side = read_side(run);
  if (side.runs.size() != 1) {
    fail("{}: holds {} runs: expected one folder of `sextant run` or `sextant sweep`", side.path,
         side.runs.size());
  }
  const std::filesystem::path folder = side.runs.front().path;
  const std::string missing =
      missing_records(side.runs.front().provenance, side.runs.front().n_cases, folder);
  if (!missing.empty()) fail("{}", missing);
  // Records are written in the order of the file, which is the order of the cases of the run.
  std::vector<Record> records = read_records(folder / "records.jsonl");
  for (Record& record : records) record = strip_times(std::move(record));
  OutputFiles files = {{"records.jsonl", write_records(records)}};
  if (std::filesystem::exists(folder / "run.json")) files["run.json"] = read_file(folder / "run.json");
  return files;
}

namespace {

double nanoseconds(const Json& entry, const std::string& where) {
  const auto unit = json_member<std::string>(entry, "time_unit", where, "ns");
  if (unit == "ns") return 1;
  if (unit == "us") return 1e3;
  if (unit == "ms") return 1e6;
  if (unit == "s") return 1e9;
  fail("{}: time_unit '{}': expected ns, us, ms or s", where, unit);
}

double time_of(const Json& entry, const char* key, const std::string& where) {
  constexpr double shortest = 1e-100, longest = 1e100;  // keeps ratios and products of times finite
  const auto value = json_member<double>(entry, key, where);
  if (value != 0 && !(value >= shortest && value <= longest))
    fail("{}: '{}' = {}: expected 0 or a time from 1e-100 to 1e100", where, key, value);
  return value * nanoseconds(entry, where);
}

std::string text_of(const Json& entry, const char* key) {
  const auto it = entry.find(key);
  return it != entry.end() && it->is_string() ? it->get<std::string>() : "";
}

}  // namespace

bool BenchmarkFile::measures_real_time(const std::string& benchmark, BenchmarkTime time) {
  const auto requests = [&](const char* what) { return benchmark.find(what) != std::string::npos; };
  return time == BenchmarkTime::real || requests("/real_time") || requests("/manual_time");
}

std::map<std::string, std::vector<double>> BenchmarkFile::times_ns(BenchmarkTime time) const {
  std::map<std::string, std::vector<double>> times = cpu_ns;
  for (auto& [name, values] : times) {
    if (measures_real_time(name, time)) values = real_ns.at(name);
  }
  return times;
}

BenchmarkFile parse_benchmark_file(std::string_view text, const std::string& name) {
  const Json json = parse_json(text, name);
  if (!json.is_object() || !json.contains("benchmarks") || !json["benchmarks"].is_array()) {
    fail("{}: expected the JSON of Google Benchmark, with a list 'benchmarks'", name);
  }
  BenchmarkFile file{.path = name, .context = json_object(json, "context", name)};
  json_member<std::string>(file.context, "executable", name + ": context", "");
  BenchmarkFile aggregates;
  for (const Json& entry : json["benchmarks"]) {
    if (!entry.is_object()) fail("{}: 'benchmarks': expected objects, got {}", name, json_excerpt(entry));
    std::string benchmark = text_of(entry, "run_name");
    if (benchmark.empty()) benchmark = text_of(entry, "name");
    if (benchmark.empty()) fail("{}: a benchmark has neither 'run_name' nor 'name'", name);
    const std::string where = fmt::format("{}: benchmark '{}'", name, benchmark);
    if (json_member<bool>(entry, "error_occurred", where, false))
      fail("{}: failed: {}", where, text_of(entry, "error_message"));
    const bool is_aggregate = text_of(entry, "run_type") == "aggregate";
    if (is_aggregate && text_of(entry, "aggregate_name") != "median") continue;
    BenchmarkFile& target = is_aggregate ? aggregates : file;
    target.cpu_ns[benchmark].push_back(time_of(entry, "cpu_time", where));
    target.real_ns[benchmark].push_back(time_of(entry, "real_time", where));
  }
  file.cpu_ns.merge(aggregates.cpu_ns);  // does not overwrite repetitions
  file.real_ns.merge(aggregates.real_ns);
  if (file.cpu_ns.empty()) fail("{}: has no benchmark: expected repetitions or medians", name);
  return file;
}

namespace {

constexpr const char* absent = "(not recorded)";
constexpr size_t shown_digits = 12;  ///< digits of the SHA-256 that are shown of a program's file

/// Leaves of a tree by dotted path, as text. An empty object or list is a leaf.
using Leaves = std::map<std::string, std::string>;

Leaves texts_of(const Json& tree, const std::string& path) {
  Leaves leaves;
  for_each_leaf(
      tree, true,
      [&](const std::string& key, const Json& value) {
        if (!value.is_null()) leaves[key] = value.is_string() ? value.get<std::string>() : json_line(value);
      },
      path);
  return leaves;
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

/// Collects the data of every source: data_of(), and the keys of its correspondence caches (hashes of data,
/// extraction and version).
Leaves data_leaves_of(const Json& run) {
  Leaves leaves;
  for (const auto& [what, values] : data_of(run)) leaves[what] = fmt::format("{}", fmt::join(values, ""));
  for (const Json& source : run.value("sources", Json::array())) {
    if (source.contains("packs"))
      leaves.merge(
          texts_of(source["packs"], without_folder(source.value("source", std::string())) + " packs"));
  }
  return leaves;
}

/// Collects the leaves below some keys of a tree.
Leaves leaves_below(const Json& tree, std::initializer_list<const char*> keys) {
  Leaves leaves;
  for (const char* key : keys) {
    if (tree.contains(key)) leaves.merge(texts_of(tree[key], key));
  }
  return leaves;
}

Leaves definitions_of(const Json& run) {
  return leaves_below(run, {"schema", "metric_definitions", "metric_presets", "preset"});
}

/// Collects the fingerprints of the external estimators: their parts, for every version that the run used.
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
void report_same_programs(const RunFolder& base, const RunFolder& fresh, std::vector<Mismatch>& findings) {
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
  Leaves leaves = leaves_below(run, {"version", "git_commit", "compiler", "flags", "packages"});
  const Json programs = run.value("programs", Json());
  if (programs.is_array() && programs.size() > 1) leaves.merge(texts_of(programs, "programs"));
  return leaves;
}

Leaves machine_of(const BenchmarkFile& file) {
  return leaves_below(file.context, {"host_name", "num_cpus", "caches"});
}

Leaves benchmark_build_of(const BenchmarkFile& file) {
  return leaves_below(file.context, {"library_build_type", "json_schema_version"});
}

/// Returns true if a path that only one side has is merely noted, and false if it is a difference. `other`:
/// the leaves of the side that lacks the path.
using IsNoted = std::function<bool(const std::string& path, const Leaves& other)>;
const IsNoted never = [](const std::string&, const Leaves&) { return false; };

/// Returns true for an option that only one version of the program knows, if both sides have the group that
/// contains the option: its value cannot differ. Returns false for a whole group that one side lacks, and for
/// an item of a list that both sides have.
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
    tally.move_findings(findings);
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
  compare("data", same.data, data_leaves_of(a), data_leaves_of(b), findings,
          [](const std::string& path, const Leaves&) { return path.find(" packs") != std::string::npos; });
  compare("configuration", same.configuration, texts_of(configuration_of(a), ""),
          texts_of(configuration_of(b), ""), findings, is_new_option);
  const bool times = policy.speed.judge && base.has_times && fresh.has_times;
  const Strictness machine_rule = times ? same.machine : Strictness::note;
  compare("machine", machine_rule, texts_of(a.value("machine", Json()), ""),
          texts_of(b.value("machine", Json()), ""), findings);
  compare("build", Strictness::note, build_of(a), build_of(b), findings);
  if (base.provenance.is_null() || fresh.provenance.is_null()) return;
  compare("program", Strictness::note, programs_of(base), programs_of(fresh), findings);
  report_same_programs(base, fresh, findings);
}

}  // namespace

Mismatch mismatch(Strictness rule, std::string what, std::string subject, std::string base,
                  std::string fresh) {
  return {std::move(what), std::move(subject), std::move(base), std::move(fresh), rule == Strictness::must};
}

void report_noises(const Subjects& base, const Subjects& fresh, Strictness rule,
                   std::vector<Mismatch>& findings) {
  // The noises of the subjects that only one side has, by body.
  const auto noises_of = [](const Subjects& side, const Subjects& other) {
    std::map<Subject, std::set<std::string>> noises;
    for (const auto& [s, cases] : side) {
      if (other.contains(s)) continue;
      noises[{s.dataset, s.sequence, s.body, s.estimator, "", 0}].insert(
          s.noise == "none" ? "none" : fmt::format("{} (level {})", s.noise, s.level));
    }
    return noises;
  };
  std::set<std::string> only_base, only_fresh;
  const auto of_base = noises_of(base, fresh), of_fresh = noises_of(fresh, base);
  for (const auto& [body, noises] : by_key(of_base, of_fresh)) {
    if (!noises.base || !noises.fresh) continue;
    only_base.insert(noises.base->begin(), noises.base->end());
    only_fresh.insert(noises.fresh->begin(), noises.fresh->end());
  }
  if (only_base.empty()) return;
  findings.push_back(mismatch(rule, "cases", "noises that only one side has",
                              fmt::format("{}", fmt::join(only_base, ", ")),
                              fmt::format("{}", fmt::join(only_fresh, ", "))));
}

std::vector<Mismatch> compare_provenance(const Side& base, const Side& fresh, const Policy& policy) {
  std::vector<Mismatch> findings;
  for (const Side* side : {&base, &fresh}) {
    for (const RunFolder& run : side->runs) {
      const std::string missing = missing_records(run.provenance, run.n_cases, run.path);
      if (!missing.empty()) findings.push_back(mismatch(Strictness::note, "records", missing, "", ""));
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
