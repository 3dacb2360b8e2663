#include "sextant/eval/experiment/noise_of_cases.h"

#include <algorithm>
#include <string>

#include "sextant/base/error.h"

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
  n_seeds_ = json_list(plan_, "seeds", file).size();
  n_kinds_ = extractions.size();
  counted_.resize(json_list(plan_, "sources", file).size() * n_levels_ * n_seeds_ * n_kinds_);
}

void NoiseOfCases::add(uint64_t number, const Json& sums) {
  const size_t seed = number % n_seeds_;
  const size_t level = number / n_seeds_ % n_levels_;
  const size_t estimator = number / n_seeds_ / n_levels_ % n_estimators_;
  const size_t source = number / n_seeds_ / n_levels_ / n_estimators_;
  if (!is_noisy_[level]) return;
  const std::string where = fmt::format("noise of case {}", number);
  if (sums.is_null()) fail("{}: is missing; sweep again into an empty folder", where);
  const size_t place = ((source * n_levels_ + level) * n_seeds_ + seed) * n_kinds_ + kind_[estimator];
  if (place >= counted_.size()) fail("{}: the plan has no such case", where);
  if (counted_[place]) return;
  counted_[place] = true;
  achieved_[{source, level}].merge(NoiseVerification::from_sums(sums, where));
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
