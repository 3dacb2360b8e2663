#include "sextant/eval/gate/policy.h"

#include <algorithm>

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
  check_option(replicates >= 100, "replicates", replicates, ">= 100");
  check_option(max_lost >= 0, "max_lost", max_lost, ">= 0");
}

MetricPolicy AccuracyPolicy::of(const std::string& metric) const {
  if (const auto named = metrics.find(metric); named != metrics.end()) return named->second;
  MetricPolicy policy = other;
  const auto known = metric_definitions();
  const auto definition = std::ranges::find(known, metric, &MetricDefinition::name);
  if (definition != known.end() && definition->of_input) policy.direction = Better::ignore;
  return policy;
}

void SpeedPolicy::check() const {
  check_alpha(alpha);
  check_share("minimum_effect", minimum_effect);
  check_share("unrepeated_effect", unrepeated_effect);
}

Policy read_policy(const std::string& file) {
  const Json json = read_json(file);
  Policy policy;
  try {
    read_options(json, policy);
  } catch (const Error& error) {
    fail("{}: {}", file, error.what());
  }
  return policy;
}

}  // namespace sextant
