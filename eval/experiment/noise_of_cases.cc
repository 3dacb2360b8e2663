#include "sextant/eval/experiment/noise_of_cases.h"

#include <algorithm>
#include <string>

#include "sextant/base/error.h"
#include "sextant/eval/experiment/plan.h"

namespace sextant {
namespace {

constexpr const char* file = "plan.json";

}  // namespace

NoiseOfCases::NoiseOfCases(Json plan) : plan_(std::move(plan)) {
  const Json estimators = json_list(plan_, "estimators", file), levels = json_list(plan_, "noise", file);
  const Json options = json_object(plan_, "options", file);
  std::vector<std::string> extractions;  // what decides the points of an estimator
  for (const Json& estimator : estimators) {
    const Json& owner = estimator.contains("extraction") ? estimator : options;
    const std::string extraction = json_line(json_object(owner, "extraction", file));
    kind_.push_back(static_cast<size_t>(std::ranges::find(extractions, extraction) - extractions.begin()));
    if (kind_.back() == extractions.size()) extractions.push_back(extraction);
  }
  for (const Json& level : levels) is_noisy_.push_back(!json_object(level, "noise", file).empty());
  n_estimators_ = estimators.size();
  n_levels_ = levels.size();
  n_seeds_ = planned_seeds(plan_, file);
  n_kinds_ = extractions.size();
  counted_.resize(json_list(plan_, "sources", file).size() * n_levels_ * n_seeds_ * n_kinds_);
}

NoiseOfCases::Place NoiseOfCases::place_of(uint64_t number) const {
  return {.source = number / n_seeds_ / n_levels_ / n_estimators_,
          .estimator = number / n_seeds_ / n_levels_ % n_estimators_,
          .level = number / n_seeds_ % n_levels_,
          .seed = number % n_seeds_};
}

bool NoiseOfCases::is_counted(uint64_t number) const {
  const Place at = place_of(number);
  const auto first = std::ranges::find(kind_, kind_[at.estimator]) - kind_.begin();
  return is_noisy_[at.level] && static_cast<size_t>(first) == at.estimator;
}

std::pair<size_t, size_t> NoiseOfCases::source_and_level(uint64_t number) const {
  const Place at = place_of(number);
  return {at.source, at.level};
}

void NoiseOfCases::add(uint64_t number, const Json& sums) {
  const Place at = place_of(number);
  if (!is_noisy_[at.level]) return;
  const std::string where = fmt::format("noise of case {}", number);
  if (sums.is_null()) fail("{}: is missing; sweep again into an empty folder", where);
  const size_t place = ((at.source * n_levels_ + at.level) * n_seeds_ + at.seed) * n_kinds_ + kind_[at.estimator];
  if (place >= counted_.size()) fail("{}: the plan has no such case", where);
  if (counted_[place]) return;
  counted_[place] = true;
  achieved_[{at.source, at.level}].merge(NoiseVerification::from_sums(sums, where));
}

void NoiseOfCases::set(const std::pair<size_t, size_t>& source_and_level, const NoiseVerification& noise) {
  const auto [source, level] = source_and_level;
  if (level >= n_levels_ || !is_noisy_[level] || source >= plan_["sources"].size())
    fail("noise of source {}, level {}: the plan has none there", source, level);
  achieved_[source_and_level] = noise;
}

Json NoiseOfCases::json() const {
  Json entries = Json::array();
  for (const auto& [place, achieved] : achieved_) {
    const Json& level = plan_["noise"][place.second];
    entries.push_back({{"source", json_member<std::string>(plan_["sources"][place.first], "source", file)},
                       {"level", json_member<double>(level, "level", file)},
                       {"noise", achieved.json(level["noise"])}});
  }
  return entries;
}

}  // namespace sextant
