#include "sextant/eval/experiment/run_options.h"

#include <array>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/plan.h"

namespace sextant {
namespace {

/// Sets tree[a][b][c] = value for the key "a.b.c".
void set_option(Json& tree, const std::string& assignment) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    fail("--set {}: expected key=value, e.g. pipeline.max_object_distance_m=30", assignment);
  }
  Json* node = &tree;
  for (const std::string& part : split(assignment.substr(0, equals), '.')) {
    if (part.empty())
      fail("--set {}: the key has an empty part: expected key=value, e.g. pipeline.max_object_distance_m=30",
           assignment);
    if (!node->is_object())
      fail("--set {}: '{}' stands below a key that has a value: expected a group of options there",
           assignment, part);
    node = &(*node)[part];
    if (node->is_null()) *node = Json::object();
  }
  const std::string text = assignment.substr(equals + 1);
  *node = try_parse_json(text).value_or(Json(text));
}

}  // namespace

Json options_tree(const std::string& options, std::span<const std::string> sets) {
  Json tree = Json::object();
  if (options.starts_with('@')) {
    tree = read_json(options.substr(1));
  } else if (!options.empty()) {
    tree = parse_json(options, "--options");
  }
  if (!tree.is_object()) fail("--options: expected a JSON object, got {}", json_excerpt(tree));
  for (const std::string& assignment : sets) set_option(tree, assignment);
  return tree;
}

ResolvedOptions resolve_options(const Json& tree) {
  if (!tree.is_object()) fail("options: expected a JSON object, got {}", json_excerpt(tree));
  const std::vector<std::string> known = {"extraction", "pipeline", "estimator", "source"};
  ResolvedOptions options;
  for (const auto& item : tree.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      fail("unknown option key '{}': {}", item.key(), suggest(item.key(), known));
    }
    if (!item.value().is_object())
      fail("option {}: expected an object, got {}", item.key(), json_excerpt(item.value()));
    if (item.key() == "extraction") read_options(item.value(), options.extraction, "extraction");
    if (item.key() == "pipeline") read_options(item.value(), options.pipeline, "pipeline");
    if (item.key() == "estimator") options.estimator = item.value();
    if (item.key() == "source") options.source = item.value();
  }
  return options;
}

std::vector<OptionHelp> run_options(const std::string& estimator) {
  std::vector<OptionHelp> all;
  const auto add = [&](const std::vector<OptionHelp>& options) {
    all.insert(all.end(), options.begin(), options.end());
  };
  add(describe_options(ExtractionOptions{}, "extraction"));
  add(describe_options(PipelineOptions{}, "pipeline"));
  const std::vector<EstimatorEntry> known = all_estimators();
  add(find_entry(std::span<const EstimatorEntry>(known), estimator, "estimator").options());
  add(describe_noise_options());
  return all;
}

std::vector<OptionHelp> plan_options() {
  return {
      {"plan.keep", std::string(to_string(Plan().keep)), "",
       "what a sweep keeps of a case, a key of its plan: records, or summary (counts, sums, histograms)"}};
}

}  // namespace sextant
