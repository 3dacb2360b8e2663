#include "sextant/eval/experiment/achieved_noise.h"

#include <set>
#include <string>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/noise/verification.h"

namespace sextant {

Json achieved_noise(const Json& plan, const std::map<uint64_t, Json>& sums) {
  const std::string file = "plan.json";
  const Json sources = json_list(plan, "sources", file), estimators = json_list(plan, "estimators", file);
  const Json levels = json_list(plan, "noise", file);
  const size_t n_seeds = json_list(plan, "seeds", file).size();
  const Json options = json_object(plan, "options", file);
  std::vector<std::string> extraction;  // by estimator: what decides its points
  for (const Json& estimator : estimators) {
    const Json& owner = estimator.contains("extraction") ? estimator : options;
    extraction.push_back(json_line(json_object(owner, "extraction", file)));
  }

  /// Of one source and level; null when none of its cases is at hand.
  const auto entry_of = [&](size_t source, size_t level) -> Json {
    NoiseVerification achieved;
    bool any = false;
    for (size_t seed = 0; seed < n_seeds; ++seed) {
      std::set<std::string> counted;
      for (size_t e = 0; e < estimators.size(); ++e) {
        const uint64_t number = ((source * estimators.size() + e) * levels.size() + level) * n_seeds + seed;
        const auto of_case = sums.find(number);
        if (of_case == sums.end() || !counted.insert(extraction[e]).second) continue;
        const std::string where = fmt::format("noise of case {}", number);
        if (of_case->second.is_null()) fail("{}: is missing; sweep again into an empty folder", where);
        achieved.merge(NoiseVerification::from_sums(of_case->second, where));
        any = true;
      }
    }
    if (!any) return {};
    return {{"source", json_member<std::string>(sources[source], "source", file)},
            {"level", json_member<double>(levels[level], "level", file)},
            {"noise", achieved.json(levels[level]["noise"])}};
  };

  Json entries = Json::array();
  for (size_t s = 0; s < sources.size(); ++s) {
    for (size_t l = 0; l < levels.size(); ++l) {
      if (json_object(levels[l], "noise", file).empty()) continue;
      if (Json entry = entry_of(s, l); !entry.is_null()) entries.push_back(std::move(entry));
    }
  }
  return entries;
}

}  // namespace sextant
