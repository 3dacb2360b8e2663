#include "sextant/eval/records/run_json.h"

#include "sextant/base/error.h"

namespace sextant {
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

}  // namespace sextant
