#include "sextant/eval/gate/policy.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

void check_size(const char* name, double value) {
  check_option(value >= 0 && value < 1e6, name, value, ">= 0 and below 1e6");
}

void check_share(const char* name, double value) {
  check_option(value >= 0 && value <= 1, name, value, "a share from 0 to 1, such as 0.05 for 5 %");
}

/// Throws Error if the name looks like a misspelt one. Other names that are not in the list of metrics are
/// legal, because third-party records may have errors of their own.
void check_error_name(const std::string& name) {
  std::vector<std::string> known;
  for (const MetricDefinition& metric : metric_definitions())
    if (metric.map == NumberMap::errors) known.push_back(metric.name);
  if (std::ranges::find(known, name) == known.end() && !nearest_name(name, known).empty())
    fail("option metrics: unknown error '{}': {}", name, suggest(name, known));
}

void check_alpha(double alpha) {
  check_option(alpha > 0 && alpha < 1, "alpha", alpha, "above 0 and below 1");
}

}  // namespace

void MetricPolicy::check() const {
  check_size("absolute", absolute);
  check_share("relative", relative);
  check_share("minimum_effect", minimum_effect);
}

bool MetricPolicy::is_change(double base, double fresh) const {
  return std::abs(fresh - base) > std::max(absolute, relative * std::abs(base));
}

void AccuracyPolicy::check() const {
  check_alpha(alpha);
  check_option(minimum_seeds >= 2, "minimum_seeds", minimum_seeds, ">= 2");
  check_option(minimum_cases >= 2, "minimum_cases", minimum_cases, ">= 2");
  check_size("inconclusive_effect", inconclusive_effect);
  check_option(replicates >= 100, "replicates", replicates, ">= 100");
  check_option(max_lost >= 0, "max_lost", max_lost, ">= 0");
  check_option(gained_error >= 1, "gained_error", gained_error, ">= 1");
  for (const auto& [name, policy] : metrics) check_error_name(name);
}

MetricPolicy AccuracyPolicy::of(const std::string& metric) const {
  const auto named = metrics.find(metric);
  return named != metrics.end() ? named->second : default_of(metric);
}

MetricPolicy AccuracyPolicy::default_of(const std::string& metric) const {
  MetricPolicy policy = other;
  const MetricDefinition* definition = find_metric(NumberMap::errors, metric);
  if (definition != nullptr && definition->better == Better::higher) policy.direction = Direction::higher;
  if (definition != nullptr && definition->better == Better::neither) policy.direction = Direction::ignore;
  return policy;
}

void SpeedPolicy::check() const {
  check_alpha(alpha);
  check_share("minimum_effect", minimum_effect);
  check_size("unrepeated_effect", unrepeated_effect);
}

std::span<const SamenessPolicy::Rule> SamenessPolicy::rules() {
  static constexpr std::array<Rule, 6> rules = {
      {{"cases", &SamenessPolicy::cases, "all records, benchmarks and errors of BASE are in NEW"},
       {"new_cases", &SamenessPolicy::new_cases, "all records, benchmarks and errors of NEW are in BASE"},
       {"data", &SamenessPolicy::data,
        "files, caches, camera and rate of the sources; true values in the records"},
       {"configuration", &SamenessPolicy::configuration,
        "sources, noise, levels, seeds and options of run.json"},
       {"definitions", &SamenessPolicy::definitions, "schema, metrics and presets"},
       {"machine", &SamenessPolicy::machine, "CPU and cores; only where times are judged"}}};
  return rules;
}

Policy read_policy(const std::string& file) {
  const Json json = read_json(file);
  Policy policy;
  try {
    read_options(json, policy);
    for (auto& [name, entry] : policy.accuracy.metrics) {
      entry = policy.accuracy.default_of(name);
      read_options(json["accuracy"]["metrics"][name], entry);
    }
  } catch (const Error& error) {
    fail("{}: {}", file, error.what());
  }
  return policy;
}

}  // namespace sextant
