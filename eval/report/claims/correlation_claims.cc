#include "sextant/eval/report/claims/correlation_claims.h"

#include <map>
#include <tuple>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_sets.h"

namespace sextant {
namespace {

constexpr size_t n_paper_objects = 3;
constexpr const char* spatial_suffix = " (spatial ";

/// The same noise without correlation.
std::string independent_name(const std::string& noise) { return noise.substr(0, noise.find(spatial_suffix)); }

struct Sums {
  double correlated = 0, independent = 0;
};

using Group = std::tuple<std::string, std::string, std::string>;  // dataset, sequence, estimator
using Case = std::tuple<double, uint64_t, int>;                   // level, seed, frame

/// The ratio of mean errors of one body; no value where no case has both.
IntervalEstimate ratio(const RecordRefs& records, const char* key, size_t& n_cases) {
  std::map<std::pair<std::string, Case>, double> independent;
  for (const Record* r : records)
    if (!has_correlated_noise(*r)) independent[{r->noise, {r->level, r->seed, r->frame}}] = r->errors.at(key);
  std::map<uint64_t, Sums> by_seed;
  n_cases = 0;
  for (const Record* r : records) {
    if (!has_correlated_noise(*r)) continue;
    const auto other = independent.find({independent_name(r->noise), {r->level, r->seed, r->frame}});
    if (other == independent.end()) continue;
    by_seed[r->seed].correlated += r->errors.at(key);
    by_seed[r->seed].independent += other->second;
    ++n_cases;
  }
  if (n_cases == 0) return {};
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

}  // namespace

bool has_correlated_noise(const Record& record) { return record.noise.find(spatial_suffix) != std::string::npos; }

std::vector<ClaimResult> check_independent_noise_is_kind(const Evidence& evidence) {
  std::map<Group, RecordRefs> groups;
  std::map<Group, std::string> parts;
  for (const EvidencePart* part : evidence.with(PartRole::noise)) {
    for (const Record& r : part->sweep.records) {
      if (r.status != Status::ok || !has_truth(r) || !r.errors.contains("Et_m") || !r.errors.contains("ER_deg")) continue;
      const Group group{r.dataset, r.sequence, r.estimator};
      groups[group].push_back(&r);
      if (has_correlated_noise(r)) parts[group] = part->name;
    }
  }
  std::vector<ClaimResult> results;
  for (const auto& [group, part] : parts) {
    for (const PaperBody& body : bodies_by_distance(groups.at(group))) {
      if (body.number > n_paper_objects) break;
      for (const char* key : {"Et_m", "ER_deg"}) {
        size_t n_cases = 0;
        const IntervalEstimate k = ratio(body.records, key, n_cases);
        if (n_cases == 0) continue;
        ClaimResult result;
        std::tie(result.dataset, result.sequence, result.estimator) = group;
        result.subject = body.number == 0 ? "camera" : fmt::format("object {} (id {})", body.number, body.id);
        result.quantity =
            fmt::format("mean {}, correlated / independent noise", metric(NumberMap::errors, key).symbol);
        result.stated = "> 1";
        result.set(k);
        result.verdict = is_above(1, result.value, result.interval);
        result.records = part;
        results.push_back(std::move(result));
      }
    }
  }
  return results;
}

}  // namespace sextant
