#include "sextant/eval/gate/policy.h"

#include <array>

#include "sextant/base/files.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

void check_share(const char* name, double value) {
  check_option(value >= 0 && value < 1e6, name, value, ">= 0");
}

void check_alpha(double alpha) {
  check_option(alpha > 0 && alpha < 1, "alpha", alpha, "above 0 and below 1");
}

}  // namespace

void MetricPolicy::check() const {
  check_share("absolute", absolute);
  check_share("relative", relative);
  check_share("minimum_effect", minimum_effect);
}

void AccuracyPolicy::check() const {
  check_alpha(alpha);
  check_option(minimum_seeds >= 2, "minimum_seeds", minimum_seeds, ">= 2");
  check_option(minimum_cases >= 2, "minimum_cases", minimum_cases, ">= 2");
  check_share("inconclusive_effect", inconclusive_effect);
  check_option(replicates >= 100, "replicates", replicates, ">= 100");
  check_option(max_lost >= 0, "max_lost", max_lost, ">= 0");
}

MetricPolicy AccuracyPolicy::of(const std::string& metric) const {
  if (const auto named = metrics.find(metric); named != metrics.end()) return named->second;
  MetricPolicy policy = other;
  const MetricDefinition* definition = find_metric(NumberMap::errors, metric);
  if (definition != nullptr && definition->better == Better::higher) policy.direction = Direction::higher;
  if (definition != nullptr && definition->better == Better::neither) policy.direction = Direction::ignore;
  return policy;
}

void SpeedPolicy::check() const {
  check_alpha(alpha);
  check_share("minimum_effect", minimum_effect);
  check_share("unrepeated_effect", unrepeated_effect);
}

std::span<const SamenessPolicy::Rule> SamenessPolicy::rules() {
  static constexpr std::array<Rule, 6> rules = {
      {{"cases", &SamenessPolicy::cases, "all cases, benchmarks and errors of BASE are in NEW"},
       {"new_cases", &SamenessPolicy::new_cases, "all cases, benchmarks and errors of NEW are in BASE"},
       {"data", &SamenessPolicy::data,
        "files, caches, camera and rate of the sources; true values in the records"},
       {"configuration", &SamenessPolicy::configuration,
        "sources, noise, levels, seeds and options of run.json"},
       {"definitions", &SamenessPolicy::definitions, "schema, metrics and presets"},
       {"machine", &SamenessPolicy::machine, "CPU and cores; only where times are judged"}}};
  return rules;
}

}  // namespace sextant
