#include "sextant/eval/report/claims/paper_claims.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

constexpr const char* spatial_suffix = " (spatial ";

bool is_correlated(const NoiseLevel& level) { return level.key().noise.str().find(spatial_suffix) != std::string::npos; }

/// The level of the same noise without correlation; null where there is none.
const NoiseLevel* independent_of(const NoiseLevel& correlated, std::span<const NoiseLevelRef> curve) {
  const std::string noise = correlated.key().noise.str();
  const std::string independent = noise.substr(0, noise.find(spatial_suffix));
  for (const NoiseLevelRef& level : curve) {
    if (level->key().level == correlated.key().level && level->key().noise == independent) return level.get();
  }
  return nullptr;
}

struct Sums {
  double correlated = 0, independent = 0;
};

/// The ratio of mean errors of one body; none where no case has both.
std::optional<IntervalEstimate> error_ratio(std::span<const NoiseLevelRef> curve, size_t error) {
  std::map<uint64_t, Sums> by_seed;
  for (const NoiseLevelRef& level : curve) {
    const NoiseLevel* other = is_correlated(*level) ? independent_of(*level, curve) : nullptr;
    if (other == nullptr) continue;
    for (const auto& [row, other_row] : level->pairs(*other)) {
      Sums& sums = by_seed[level->case_of(row).first];
      const double a = level->error(error, row), b = other->error(error, other_row);
      if (!std::isfinite(a) || !std::isfinite(b)) continue;
      sums.correlated += a;
      sums.independent += b;
    }
  }
  if (by_seed.empty()) return std::nullopt;
  std::vector<Sums> sums;
  for (const auto& [seed, sum] : by_seed) sums.push_back(sum);
  return cluster_estimate(sums.size(), [&](std::span<const size_t> seeds) {
    Sums all;
    for (const size_t s : seeds) {
      all.correlated += sums[s].correlated;
      all.independent += sums[s].independent;
    }
    return all.correlated / all.independent;
  });
}

using Group = std::tuple<Interned, Interned, Interned>;  // dataset, sequence, estimator

}  // namespace

std::vector<ClaimResult> check_independent_noise_is_kind(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  std::vector<const EvidencePart*> parts = evidence.with(PartRole::noise_correlated);
  std::ranges::move(evidence.with(PartRole::noise), std::back_inserter(parts));
  for (const EvidencePart* part : parts) {
    std::map<Group, std::vector<std::span<const NoiseLevelRef>>> groups;
    for (const auto& curve : curves_of(part->sweep.levels)) {
      const NoiseLevelKey& key = curve.front()->key();
      const bool has_both = std::ranges::any_of(
          curve, [&](const auto& level) { return is_correlated(*level) && independent_of(*level, curve) != nullptr; });
      if (has_both) groups[{key.dataset, key.sequence, key.estimator}].push_back(curve);
    }
    for (const auto& [group, curves] : groups) {
      for (const auto& [subject, curve] : nearest_bodies(curves)) {
        for (const char* key : {"Et_m", "ER_deg"}) {
          const std::optional<IntervalEstimate> k = error_ratio(curve, compared_error(key));
          if (!k) continue;
          ClaimResult result;
          result.dataset = std::get<0>(group).str();
          result.sequence = std::get<1>(group).str();
          result.estimator = std::get<2>(group).str();
          result.subject = subject;
          result.quantity = fmt::format("mean {}, correlated / independent noise", metric(NumberMap::errors, key).symbol);
          result.stated = "> 1";
          result.set(*k);
          result.verdict = is_above(1, result.value, result.interval);
          result.records = part->name;
          results.push_back(std::move(result));
        }
      }
    }
  }
  return results;
}

}  // namespace sextant
