#include "sextant/eval/experiment/plan.h"

#include "sextant/base/files.h"
#include "sextant/base/registry.h"

namespace sextant {

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
  fail("procedure '{}' says nothing of the estimator '{}': {}", name, estimator, suggest(estimator, known));
}

}  // namespace sextant
