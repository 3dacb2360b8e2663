// Claims on the paper's three sets, per set and kind of data. Intervals: bootstrap over seeds; a seed gives
// both estimators the same noise.
//
//   joint_camera      100 (E_t of motion only / E_t of joint - 1) %, means over the pairs that both
//                     estimated. "About 300 %" is interpreted as at least 100 %, a third of it
//   joint_objects     the same quantity for objects; stated as 10 .. 20 %
//   gain_is_selection (a) the same gain if both functions use equal points (RANSAC inliers at 0.3 px, or all)
//                     and the kernel of the published code's joint function: 0, interpreted as within 1 %;
//                     (b) increase of the camera's error of one function from all points to the inliers:
//                     about 300 %, interpreted as at least 100 %
//   joint_is_matched  largest difference of E_t of a pair, below 1e-6 m: with the default options the
//                     effective kernel of joint (lib/estimator/estimators) equals that of motion only
//   epe_falls         change of the mean EPE of joint by refinement, in %, below 0
//   classification    share of wrong decisions, at most the paper's for that sequence

#include "sextant/eval/report/claims/claim.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {
namespace {

/// Two numbers of the same pair and seed.
struct PairOfValues {
  double first, second;
};
/// Pairs of values by seed.
using Pairs = std::map<uint64_t, std::vector<PairOfValues>>;

/// One body of a set under two estimators, or before and after the optimisation.
struct PairedValues {
  const EvidencePart* part;
  RecordFilter filter;
  std::string set, body, estimator;
  Pairs pairs;
};

/// Estimated records of the bodies of a set, by the paper's names.
using Bodies = std::map<std::string, RecordRefs>;

/// Visits every set of every experiment with these roles: experiment, set, bodies by estimator.
template <typename Visit>
void for_each_set(const Evidence& evidence, std::initializer_list<PartRole> roles, const Visit& visit) {
  for (const EvidencePart* part : evidence.with(roles)) {
    for (const SetData& data : paper().sets) {
      std::map<std::string, Bodies> estimators;
      const RecordRefs of_set = matching(part->records, data.filter);
      for (const auto& [estimator, records] : group_by(of_set, &Record::estimator))
        estimators[estimator] = paper_bodies(records);
      visit(*part, data, estimators);
    }
  }
}

/// Adds the E_t of each body that both estimators have, case by case.
void add_samples(const EvidencePart& part, const SetData& data, const std::string& estimator,
                 const Bodies& first, const Bodies& second, std::vector<PairedValues>& samples) {
  for (const std::string& body : common_keys<Bodies>({&first, &second})) {
    const auto of_first = errors_by_case(first.at(body), "Et_m");
    const auto of_second = errors_by_case(second.at(body), "Et_m");
    PairedValues sample{&part, data.filter, data.set, body, estimator, {}};
    for (const SeedFrame& at : common_keys<std::map<SeedFrame, double>>({&of_first, &of_second}))
      sample.pairs[at.first].push_back({of_first.at(at), of_second.at(at)});
    if (!sample.pairs.empty()) samples.push_back(std::move(sample));
  }
}

/// Pairs the errors of the baseline with those of the paper's method, for every body, set and experiment with
/// these roles. The names of the two estimators must have the same suffix, which names a procedure or a
/// choice of points.
std::vector<PairedValues> estimator_samples(const Evidence& evidence, std::initializer_list<PartRole> roles) {
  const std::string& name = paper().baseline;
  std::vector<PairedValues> samples;
  for_each_set(evidence, roles, [&](const auto& part, const auto& data, const auto& estimators) {
    for (const auto& [baseline, bodies] : estimators) {
      if (!baseline.starts_with(name)) continue;
      const std::string joint = paper().method + baseline.substr(name.size());
      if (const Bodies* of_joint = find_in(estimators, joint))
        add_samples(part, data, joint, bodies, *of_joint, samples);
    }
  });
  return samples;
}

/// Pairs one function on the inliers and on all points, for every body and set.
std::vector<PairedValues> selection_samples(const Evidence& evidence) {
  std::vector<PairedValues> samples;
  for_each_set(evidence, {PartRole::attribution},
               [&](const auto& part, const auto& data, const auto& estimators) {
                 for (const std::string& function : {paper().baseline, paper().method}) {
                   const Bodies* inliers = find_in(estimators, function + " on inliers");
                   const Bodies* all = find_in(estimators, function + " on all");
                   if (inliers && all) add_samples(part, data, function, *inliers, *all, samples);
                 }
               });
  return samples;
}

/// Computes `statistic` over the pairs of all seeds, with its interval over seeds, and judges it by `limits`.
ClaimResult measured(const PairedValues& sample, const std::string& quantity, const std::string& stated,
                     const std::function<double(const std::vector<const PairOfValues*>&)>& statistic,
                     const Limits& limits) {
  std::vector<const std::vector<PairOfValues>*> by_seed;
  for (const auto& [seed, of_seed] : sample.pairs) by_seed.push_back(&of_seed);
  const auto of_seeds = [&](std::span<const size_t> seeds) {
    std::vector<const PairOfValues*> chosen;
    for (const size_t s : seeds) {
      for (const PairOfValues& pair : *by_seed[s]) chosen.push_back(&pair);
    }
    return statistic(chosen);
  };
  return judged({.dataset = sample.filter.dataset,
                 .sequence = sample.filter.sequence,
                 .estimator = sample.estimator,
                 .subject = sample.set + " " + sample.body,
                 .quantity = quantity,
                 .stated = stated,
                 .records = sample.part->name},
                cluster_estimate(by_seed.size(), of_seeds), limits);
}

/// 100 (sum of first / sum of second - 1), rounded to six decimals.
double percent_above(const std::vector<const PairOfValues*>& pairs) {
  double first = 0, second = 0;
  for (const PairOfValues* pair : pairs) {
    first += pair->first;
    second += pair->second;
  }
  constexpr double resolution = 1e6;
  return std::round(resolution * 100 * (first / second - 1)) / resolution + 0.0;  // avoids -0
}

constexpr Limits about_300_percent = {.low = least_of_about_300_percent};
constexpr const char* gain_title = "E_t of motion only above that of joint [%]";

/// Checks the gain for the camera, or for the objects.
std::vector<ClaimResult> check_gain(const Evidence& evidence, bool of_camera, const std::string& stated,
                                    const Limits& limits) {
  std::vector<ClaimResult> results;
  for (const PairedValues& sample : estimator_samples(evidence, {PartRole::sets, PartRole::sets_paper})) {
    if ((sample.body == "Ego") == of_camera)
      results.push_back(measured(sample, gain_title, stated, percent_above, limits));
  }
  return results;
}

std::vector<ClaimResult> check_joint_camera(const Evidence& evidence) {
  return check_gain(evidence, true, "about 300", about_300_percent);
}

std::vector<ClaimResult> check_joint_objects(const Evidence& evidence) {
  return check_gain(evidence, false, "10 .. 20", {10, 20});
}

std::vector<ClaimResult> check_gain_is_selection(const Evidence& evidence) {
  // The experiment contains both functions on the same points: "... on inliers", "... on all".
  constexpr double none_percent = 1;
  std::vector<ClaimResult> results;
  for (const PairedValues& sample : estimator_samples(evidence, {PartRole::attribution})) {
    const size_t at = sample.estimator.find(" on ");
    if (at == std::string::npos) continue;
    const std::string points = sample.estimator.substr(at + 1);
    ClaimResult result = measured(sample, fmt::format("{}, both {}", gain_title, points), "0", percent_above,
                                  {-none_percent, none_percent});
    result.estimator = fmt::format("{}, {}", paper().baseline, paper().method);
    results.push_back(std::move(result));
  }
  for (const PairedValues& sample : selection_samples(evidence)) {
    if (sample.body == "Ego")
      results.push_back(measured(sample, "E_t on the inliers above that on all points [%]", "about 300",
                                 percent_above, about_300_percent));
  }
  return results;
}

std::vector<ClaimResult> check_joint_is_matched(const Evidence& evidence) {
  constexpr double equal_um = 1;
  std::vector<ClaimResult> results;
  for (const PairedValues& sample : estimator_samples(evidence, {PartRole::sets})) {
    const auto largest = [](const std::vector<const PairOfValues*>& pairs) {
      double max = 0;
      for (const PairOfValues* pair : pairs) max = std::max(max, std::abs(pair->first - pair->second));
      return 1e6 * max;
    };
    results.push_back(
        measured(sample, "largest |difference| of E_t in a pair [um]", "< 1", largest, {.high = equal_um}));
  }
  return results;
}

std::vector<ClaimResult> check_epe_falls(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for_each_set(evidence, {PartRole::sets}, [&](const auto& part, const auto& data, const auto& estimators) {
    const Bodies* joint = find_in(estimators, paper().method);
    if (joint == nullptr) return;
    for (const auto& [body, records] : *joint) {
      PairedValues sample{&part, data.filter, data.set, body, paper().method, {}};
      for (const Record* r : records) {
        const auto before = find_number(r->errors, "epe_initial_px");
        const auto after = find_number(r->errors, "epe_refined_px");
        if (before && after) sample.pairs[r->seed].push_back({*after, *before});
      }
      if (sample.pairs.empty()) continue;
      results.push_back(measured(sample, "change of the mean EPE [%]", "< 0", percent_above, {.high = 0}));
    }
  });
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
    for (const Record& r : part->records) {
      if (r.estimator == paper().method) by_sequence[{r.dataset, r.sequence, r.level}][r.seed].push_back(r);
    }
    for (const auto& [where, by_seed] : by_sequence) {
      const auto& [dataset, name, delta_d_px] = where;
      const auto at = std::find(sequences.begin(), sequences.end(), paper().sequence_of(dataset, name));
      if (at == sequences.end()) continue;
      const auto column = static_cast<size_t>(at - sequences.begin());
      const auto count = [&](const char* key) { return published.at(key).at(column).get<double>(); };
      const std::string noise = delta_d_px > 0 ? fmt::format("delta_d {} px", delta_d_px) : "exact depth";
      const double stated =
          100 * (count("false_positive") + count("false_negative")) / count("total_detections");
      PairedValues sample{part, {dataset, name}, "sequence", sequences[column], paper().method, {}};
      for (const auto& [seed, records] : by_seed) {
        const ClassificationCounts c = count_classification(records);
        sample.pairs[seed].push_back({100.0 * (c.false_positive + c.false_negative), 1.0 * c.total()});
      }
      const auto share = [](const std::vector<const PairOfValues*>& pairs) {
        double wrong = 0, all = 0;
        for (const PairOfValues* pair : pairs) {
          wrong += pair->first;
          all += pair->second;
        }
        return wrong / all;
      };
      results.push_back(measured(sample, "wrong decisions [%], " + noise, fmt::format("<= {:.1f}", stated),
                                 share, {.high = stated}));
    }
  }
  return results;
}

}  // namespace

std::vector<Claim> sets_claims() {
  return {paper_claim(1, "joint_camera", check_joint_camera),
          paper_claim(2, "joint_objects", check_joint_objects),
          paper_claim(3, "gain_is_selection", check_gain_is_selection),
          paper_claim(4, "joint_is_matched", check_joint_is_matched),
          paper_claim(5, "epe_falls", check_epe_falls),
          paper_claim(11, "classification", check_classification)};
}

}  // namespace sextant
