#include "sextant/eval/report/tables/attribution.h"

#include <algorithm>
#include <map>
#include <set>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_sets.h"

namespace sextant {
namespace {

constexpr const char* separator = " > ";

struct Step {
  std::string decision;
  std::vector<Record> records;
};

/// Steps by path, in the order of evidence and plans.
std::map<std::string, std::vector<Step>> steps_by_path(const Evidence& evidence, const RecordFilter& filter) {
  std::map<std::string, std::vector<Step>> paths;
  for (const EvidencePart* part : evidence.with(PartRole::attribution)) {
    for (const Record& record : part->sweep.records) {
      const size_t at = record.estimator.find(separator);
      if (at == std::string::npos || !filter.matches(record)) continue;
      std::vector<Step>& steps = paths[record.estimator.substr(0, at)];
      const std::string decision = record.estimator.substr(at + std::string(separator).size());
      auto step = std::ranges::find(steps, decision, &Step::decision);
      if (step == steps.end()) step = steps.insert(steps.end(), {decision, {}});
      step->records.push_back(record);
    }
  }
  return paths;
}

using PairKey = std::pair<uint64_t, int>;  // seed, frame
using ErrorOfPair = std::map<PairKey, double>;

ErrorOfPair errors_of(const RecordRefs& records) {
  ErrorOfPair errors;
  for (const Record* record : records) {
    if (const auto Et_m = find_number(record->errors, "Et_m")) errors[{record->seed, record->frame}] = *Et_m;
  }
  return errors;
}

/// Removes what is not in all of them.
void keep_common(std::vector<ErrorOfPair>& steps) {
  std::set<PairKey> missing;
  for (const ErrorOfPair& a : steps) {
    for (const ErrorOfPair& b : steps) {
      for (const auto& [pair, error] : a)
        if (!b.contains(pair)) missing.insert(pair);
    }
  }
  for (ErrorOfPair& step : steps)
    std::erase_if(step, [&](const auto& e) { return missing.contains(e.first); });
}

/// Per seed: number of pairs, and the sum of errors at each step.
struct SeedSums {
  double n = 0;
  std::vector<double> Et_m;
};

std::vector<SeedSums> sums_by_seed(const std::vector<ErrorOfPair>& steps) {
  std::map<uint64_t, SeedSums> by_seed;
  for (size_t k = 0; k < steps.size(); ++k) {
    for (const auto& [pair, error] : steps[k]) {
      SeedSums& sums = by_seed[pair.first];
      sums.Et_m.resize(steps.size());
      sums.Et_m[k] += error;
      if (k == 0) ++sums.n;
    }
  }
  std::vector<SeedSums> out;
  for (const auto& [seed, sums] : by_seed) out.push_back(sums);
  return out;
}

/// Mean over all pairs of step `to`, less that of step `from` if there is one.
struct Difference {
  double value = 0;
  std::optional<Interval> interval;

  Difference(const std::vector<SeedSums>& seeds, size_t to, std::optional<size_t> from) {
    const auto of = [&](std::span<const size_t> chosen) {
      double sum = 0, n = 0;
      for (const size_t s : chosen) {
        sum += seeds[s].Et_m[to] - (from ? seeds[s].Et_m[*from] : 0);
        n += seeds[s].n;
      }
      return sum / n;
    };
    std::vector<size_t> all(seeds.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = i;
    value = of(all);
    interval = cluster_bootstrap(seeds.size(), of);
  }
};

std::optional<AttributionPath> path_of(const std::vector<Step>& steps, const SetData& data,
                                       const std::string& body) {
  AttributionPath path{data.set, set_data_title(data.filter), body};
  std::vector<ErrorOfPair> errors;
  for (const Step& step : steps) {
    const auto bodies = paper_bodies(step.records, data.filter);
    const auto of_body = bodies.find(body);
    if (of_body != bodies.end()) errors.push_back(errors_of(of_body->second));
  }
  if (errors.size() != steps.size() || steps.size() < 2) return std::nullopt;
  keep_common(errors);
  const std::vector<SeedSums> seeds = sums_by_seed(errors);
  if (seeds.empty()) return std::nullopt;
  path.n_pairs = errors.front().size();
  path.n_seeds = seeds.size();
  for (size_t k = 0; k < steps.size(); ++k) {
    AttributionStep step{steps[k].decision};
    const Difference mean(seeds, k, std::nullopt);
    step.Et_m = mean.value;
    step.Et_interval = mean.interval;
    if (k > 0) {
      const Difference change(seeds, k, k - 1);
      step.change_m = change.value;
      step.change_interval = change.interval;
    }
    path.steps.push_back(std::move(step));
  }
  const Difference whole(seeds, steps.size() - 1, 0);
  path.whole_m = whole.value;
  path.whole_interval = whole.interval;
  return path;
}

}  // namespace

std::vector<AttributionPath> attribution_paths(const Evidence& evidence) {
  std::vector<AttributionPath> out;
  if (evidence.with(PartRole::attribution).empty()) return out;
  const Json& rows = evidence.published.at("tab:mot_all").at("rows");
  for (const SetData& data : set_data()) {
    const auto paths = steps_by_path(evidence, data.filter);
    for (const Json& row : rows) {
      if (row.at("set") != data.set) continue;
      const std::string printed = row.at("body");
      for (const auto& [name, steps] : paths) {
        std::optional<AttributionPath> path = path_of(steps, data, printed == "Obj" ? "Obj1" : printed);
        if (!path) continue;
        path->path = name;
        path->published_m = published_number(row.at(name == "motion_only" ? "motion_only" : "joint"), "Et_m");
        out.push_back(std::move(*path));
      }
    }
  }
  return out;
}

}  // namespace sextant
