#include "sextant/eval/report/claims/sets_claims.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/summary.h"
#include "sextant/eval/report/tables/paper_sets.h"

namespace sextant {
namespace {

/// Two numbers of one pair and seed.
struct PairOfValues {
  double first, second;
};
/// By seed.
using Pairs = std::map<uint64_t, std::vector<PairOfValues>>;

/// One body of a set under two estimators, or before and after.
struct Panel {
  const EvidencePart* part;
  RecordFilter filter;
  std::string set, body, estimator;
  Pairs pairs;
};

/// joint_flow's label of a part for each label of motion_only: "x" -> "joint_flow<rest>".
std::string joint_label(const std::string& motion_only) {
  return "joint_flow" + motion_only.substr(std::string("motion_only").size());
}

using BodyRecords = std::map<std::string, RecordRefs>;

/// body -> records, by estimator, of one set in one part.
std::map<std::string, BodyRecords> by_estimator(const EvidencePart& part, const RecordFilter& filter,
                                                std::map<std::string, std::vector<Record>>& storage) {
  for (const Record& record : part.sweep.records) {
    if (filter.matches(record)) storage[record.estimator].push_back(record);
  }
  std::map<std::string, BodyRecords> bodies;
  for (const auto& [estimator, records] : storage) bodies[estimator] = paper_bodies(records, filter);
  return bodies;
}

Pairs joined(const RecordRefs& first, const RecordRefs& second, const char* key) {
  std::map<std::tuple<uint64_t, int>, double> of_second;
  for (const Record* r : second) of_second[{r->seed, r->frame}] = r->errors.at(key);
  Pairs pairs;
  for (const Record* r : first) {
    const auto it = of_second.find({r->seed, r->frame});
    if (it != of_second.end()) pairs[r->seed].push_back({r->errors.at(key), it->second});
  }
  return pairs;
}

/// motion_only and joint_flow of every body, set and part of these roles.
std::vector<Panel> estimator_panels(const Evidence& evidence, std::initializer_list<PartRole> roles) {
  std::vector<Panel> panels;
  for (const PartRole role : roles) {
    for (const EvidencePart* part : evidence.with(role)) {
      for (const SetData& data : set_data()) {
        std::map<std::string, std::vector<Record>> storage;
        const auto estimators = by_estimator(*part, data.filter, storage);
        for (const auto& [motion_only, bodies] : estimators) {
          const auto joint =
              estimators.find(motion_only.starts_with("motion_only") ? joint_label(motion_only) : "");
          if (joint == estimators.end()) continue;
          for (const auto& [body, records] : bodies) {
            const auto of_joint = joint->second.find(body);
            if (of_joint == joint->second.end()) continue;
            Panel panel{part, data.filter,  data.set,
                        body, joint->first, joined(records, of_joint->second, "Et_m")};
            if (!panel.pairs.empty()) panels.push_back(std::move(panel));
          }
        }
      }
    }
  }
  return panels;
}

/// One function on the inliers and on all points, of every body and set.
std::vector<Panel> selection_panels(const Evidence& evidence) {
  std::vector<Panel> panels;
  for (const EvidencePart* part : evidence.with(PartRole::attribution)) {
    for (const SetData& data : set_data()) {
      std::map<std::string, std::vector<Record>> storage;
      const auto estimators = by_estimator(*part, data.filter, storage);
      for (const char* function : {"motion_only", "joint_flow"}) {
        const auto inliers = estimators.find(fmt::format("{} on inliers", function));
        const auto all = estimators.find(fmt::format("{} on all", function));
        if (inliers == estimators.end() || all == estimators.end()) continue;
        for (const auto& [body, records] : inliers->second) {
          const auto of_all = all->second.find(body);
          if (of_all == all->second.end()) continue;
          Panel panel{part, data.filter, data.set, body, function, joined(records, of_all->second, "Et_m")};
          if (!panel.pairs.empty()) panels.push_back(std::move(panel));
        }
      }
    }
  }
  return panels;
}

ClaimResult result_for(const Panel& panel, const std::string& quantity, const std::string& stated) {
  ClaimResult result;
  result.dataset = panel.filter.dataset;
  result.sequence = panel.filter.sequence;
  result.estimator = panel.estimator;
  result.subject = panel.set + " " + panel.body;
  result.quantity = quantity;
  result.stated = stated;
  result.records = panel.part->name;
  return result;
}

/// `statistic` of the pairs of some seeds, and its interval.
void measure(const Pairs& pairs,
             const std::function<double(const std::vector<const PairOfValues*>&)>& statistic,
             ClaimResult& result) {
  std::vector<const std::vector<PairOfValues>*> by_seed;
  for (const auto& [seed, of_seed] : pairs) by_seed.push_back(&of_seed);
  const auto of_seeds = [&](std::span<const size_t> seeds) {
    std::vector<const PairOfValues*> chosen;
    for (const size_t s : seeds) {
      for (const PairOfValues& pair : *by_seed[s]) chosen.push_back(&pair);
    }
    return statistic(chosen);
  };
  std::vector<size_t> all(by_seed.size());
  for (size_t i = 0; i < all.size(); ++i) all[i] = i;
  result.value = of_seeds(all);
  result.interval = cluster_bootstrap(by_seed.size(), of_seeds);
}

/// 100 (sum of first / sum of second - 1), to six decimals: what is less is rounding.
double percent_above(const std::vector<const PairOfValues*>& pairs) {
  double first = 0, second = 0;
  for (const PairOfValues* pair : pairs) {
    first += pair->first;
    second += pair->second;
  }
  constexpr double resolution = 1e6;
  return std::round(resolution * 100 * (first / second - 1)) / resolution + 0.0;  // no -0
}

constexpr const char* gain_title = "E_t of motion only above that of joint [%]";

}  // namespace

std::vector<ClaimResult> check_joint_camera(const Evidence& evidence) {
  constexpr double least_percent = 100;
  std::vector<ClaimResult> results;
  for (const Panel& panel : estimator_panels(evidence, {PartRole::sets, PartRole::sets_paper})) {
    if (panel.body != "Ego") continue;
    ClaimResult result = result_for(panel, gain_title, "about 300");
    measure(panel.pairs, percent_above, result);
    result.verdict = is_above(least_percent, result.value, result.interval);
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<ClaimResult> check_joint_objects(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const Panel& panel : estimator_panels(evidence, {PartRole::sets, PartRole::sets_paper})) {
    if (panel.body == "Ego") continue;
    ClaimResult result = result_for(panel, gain_title, "10 .. 20");
    measure(panel.pairs, percent_above, result);
    result.verdict = is_between(10, 20, result.value, result.interval);
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<ClaimResult> check_gain_is_selection(const Evidence& evidence) {
  // The part holds both functions on the same points: "... on inliers", "... on all".
  constexpr double none_percent = 1;
  constexpr double least_percent = 100;
  std::vector<ClaimResult> results;
  for (const Panel& panel : estimator_panels(evidence, {PartRole::attribution})) {
    const size_t at = panel.estimator.find(" on ");
    if (at == std::string::npos) continue;
    const std::string points = panel.estimator.substr(at + 1);
    ClaimResult result = result_for(panel, fmt::format("{}, both {}", gain_title, points), "0");
    result.estimator = "motion_only, joint_flow";
    measure(panel.pairs, percent_above, result);
    result.verdict = is_between(-none_percent, none_percent, result.value, result.interval);
    results.push_back(std::move(result));
  }
  for (Panel& panel : selection_panels(evidence)) {
    if (panel.body != "Ego") continue;
    ClaimResult result = result_for(panel, "E_t on the inliers above that on all points [%]", "about 300");
    measure(panel.pairs, percent_above, result);
    result.verdict = is_above(least_percent, result.value, result.interval);
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<ClaimResult> check_joint_is_matched(const Evidence& evidence) {
  constexpr double equal_um = 1;
  std::vector<ClaimResult> results;
  for (const Panel& panel : estimator_panels(evidence, {PartRole::sets})) {
    ClaimResult result = result_for(panel, "largest |difference| of E_t in a pair [um]", "< 1");
    const auto largest = [](const std::vector<const PairOfValues*>& pairs) {
      double max = 0;
      for (const PairOfValues* pair : pairs) max = std::max(max, std::abs(pair->first - pair->second));
      return 1e6 * max;
    };
    measure(panel.pairs, largest, result);
    result.verdict = is_below(equal_um, result.value, result.interval);
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<ClaimResult> check_epe_falls(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const EvidencePart* part : evidence.with(PartRole::sets)) {
    for (const SetData& data : set_data()) {
      std::map<std::string, std::vector<Record>> storage;
      const auto estimators = by_estimator(*part, data.filter, storage);
      const auto joint = estimators.find("joint_flow");
      if (joint == estimators.end()) continue;
      for (const auto& [body, records] : joint->second) {
        Panel panel{part, data.filter, data.set, body, "joint_flow", {}};
        for (const Record* r : records) {
          const auto before = find_number(r->errors, "epe_initial_px");
          const auto after = find_number(r->errors, "epe_refined_px");
          if (before && after) panel.pairs[r->seed].push_back({*after, *before});
        }
        if (panel.pairs.empty()) continue;
        ClaimResult result = result_for(panel, "change of the mean EPE [%]", "< 0");
        measure(panel.pairs, percent_above, result);
        result.verdict = is_below(0, result.value, result.interval);
        results.push_back(std::move(result));
      }
    }
  }
  return results;
}

std::vector<ClaimResult> check_classification(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  if (evidence.published.empty()) return results;
  const Json& published = evidence.published.at("tab:dyn_obj");
  const Json& sequences = published.at("sequences");
  for (const EvidencePart* part : evidence.with(PartRole::classification)) {
    using Key = std::tuple<std::string, std::string, double>;  // dataset, sequence, delta_d
    std::map<Key, std::map<uint64_t, std::vector<Record>>> by_sequence;
    for (const Record& r : part->sweep.records)
      by_sequence[{r.dataset, r.sequence, r.level}][r.seed].push_back(r);
    for (const auto& [where, by_seed] : by_sequence) {
      const auto& [dataset, name, delta_d_px] = where;
      const auto at = std::find_if(sequences.begin(), sequences.end(), [&](const Json& s) {
        return dataset.find("vkitti") != std::string::npos &&
               name.find(s.get<std::string>() + "/") != std::string::npos;
      });
      if (at == sequences.end()) continue;
      const auto column = static_cast<size_t>(at - sequences.begin());
      const auto count = [&](const char* key) { return published.at(key).at(column).get<double>(); };
      const std::string noise = delta_d_px > 0 ? fmt::format("delta_d {} px", delta_d_px) : "exact depth";
      const double stated =
          100 * (count("false_positive") + count("false_negative")) / count("total_detections");
      Panel panel{part, {dataset, name}, "sequence", sequences[column], "joint_flow", {}};
      for (const auto& [seed, records] : by_seed) {
        const ClassificationCounts c = count_classification(records);
        panel.pairs[seed].push_back({100.0 * (c.false_positive + c.false_negative), 1.0 * c.total()});
      }
      ClaimResult result =
          result_for(panel, "wrong decisions [%], " + noise, fmt::format("<= {:.1f}", stated));
      const auto share = [](const std::vector<const PairOfValues*>& pairs) {
        double wrong = 0, all = 0;
        for (const PairOfValues* pair : pairs) {
          wrong += pair->first;
          all += pair->second;
        }
        return wrong / all;
      };
      measure(panel.pairs, share, result);
      result.verdict = is_below(stated, result.value, result.interval);
      results.push_back(std::move(result));
    }
  }
  return results;
}

}  // namespace sextant
