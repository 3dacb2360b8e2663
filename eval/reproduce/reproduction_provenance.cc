#include "sextant/eval/reproduce/reproduce.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {
namespace {

std::string text_at(const Json& run, const char* key) { return run.value(key, std::string("unknown")); }

std::string libraries(const Json& run) {
  std::string text;
  const Json packages = run.value("packages", Json::object());
  for (const auto& [name, version] : packages.items())
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, version.get<std::string>());
  return text;
}

std::string machine(const Json& run) {
  const Json& m = run.value("machine", Json::object());
  return fmt::format("{}, {} cores", m.value("cpu", std::string("unknown")), m.value("cores", 0));
}

/// Returns the texts of all experiments, each distinct text once.
std::string distinct(const std::vector<Json>& runs, const std::function<std::string(const Json&)>& say) {
  std::vector<std::string> said;
  for (const Json& run : runs) {
    const std::string text = say(run);
    if (std::ranges::find(said, text) == said.end()) said.push_back(text);
  }
  return fmt::format("{}", fmt::join(said, "; "));
}

/// Formats "24 files, SHA-256 1f0a..." from the digests of all files that an experiment has read, in order of
/// name.
std::string inputs_of(const Json& run) {
  size_t n = 0;
  std::string digests;
  const auto add = [&](const Json& inputs) {
    for (const auto& [path, input] : inputs.items()) {
      digests += (input.is_string() ? input : input.at("sha256")).get<std::string>() + "\n";
      ++n;
    }
  };
  if (run.contains("inputs")) add(run.at("inputs"));
  for (const Json& source : run.value("sources", Json::array())) add(source.value("inputs", Json::object()));
  if (n == 0) return "no files: scenarios built into the program";
  return fmt::format("{} files, SHA-256 {}", n, sha256(digests).substr(0, 16));
}

std::string part_line(const EvidencePart& part, const Json& run) {
  std::set<uint64_t> seeds;
  for (const Record& record : part.records) seeds.insert(record.seed);
  return fmt::format("{} records, {} seed{}; {}; parts/{}/run.json", part.records.size(), seeds.size(),
                     seeds.size() == 1 ? "" : "s", inputs_of(run), part.name);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> reproduction_provenance(const fs::path& parts,
                                                                         const Evidence& evidence) {
  std::vector<Json> runs;
  for (const EvidencePart& part : evidence.parts) runs.push_back(read_run_json(parts / part.name));
  std::vector<std::pair<std::string, std::string>> lines = {
      {"report by", fmt::format("sextant {}, commit {}", version(), git_commit())},
      {"records by", distinct(runs,
                              [](const Json& run) {
                                return fmt::format("sextant {}, commit {}", text_at(run, "version"),
                                                   text_at(run, "git_commit"));
                              })},
      {"compiler",
       distinct(runs,
                [](const Json& run) { return text_at(run, "compiler") + " " + text_at(run, "flags"); })},
      {"libraries", distinct(runs, libraries)},
      {"machine", distinct(runs, machine)}};
  for (size_t i = 0; i < runs.size(); ++i)
    lines.emplace_back("part " + evidence.parts[i].name, part_line(evidence.parts[i], runs[i]));
  return lines;
}

}  // namespace sextant
