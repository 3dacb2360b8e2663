#include "sextant/eval/report/noise_level.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "sextant/base/text.h"
#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

/// Returns true for keys that differ in level and noise only, which belong to the same curve.
bool is_same_curve(const NoiseLevelKey& a, const NoiseLevelKey& b) {
  return a.dataset == b.dataset && a.sequence == b.sequence && body_order(a.body) == body_order(b.body) &&
         a.estimator == b.estimator;
}

}  // namespace

const std::vector<const MetricDefinition*>& compared_errors() {
  static const std::vector<const MetricDefinition*> errors = metrics_for(compared);
  return errors;
}

const std::vector<Interned>& compared_names() {
  static const std::vector<Interned> names = [] {
    std::vector<Interned> all;
    for (const MetricDefinition* error : compared_errors()) all.emplace_back(error->name);
    return all;
  }();
  return names;
}

size_t compared_error(std::string_view name) {
  const auto at = std::ranges::find(compared_errors(), name, &MetricDefinition::name);
  SEXTANT_CHECK(at != compared_errors().end());
  return static_cast<size_t>(at - compared_errors().begin());
}

NoiseLevelKey NoiseLevelKey::of(const Record& r) {
  return {r.dataset, r.sequence, r.body, r.estimator, r.noise, r.level};
}

bool NoiseLevelKey::operator<(const NoiseLevelKey& o) const {
  const int order = body_order(body), other = body_order(o.body);
  return std::tie(dataset, sequence, order, estimator, level, noise) <
         std::tie(o.dataset, o.sequence, other, o.estimator, o.level, o.noise);
}

void NoiseLevel::add(const Record& record) {
  if (is_summed()) fail_mixed();
  const bool is_measured = has_truth(record), is_estimated = is_measured && record.status == Status::ok;
  n_truth_ += is_measured;
  n_estimated_ += is_estimated;
  cases_.add(record.seed, record.frame);
  for (size_t e = 0; e < names_.size(); ++e) {
    const auto error = is_estimated ? find_number(record.errors, names_[e]) : std::nullopt;
    const auto bound = error ? find_number(record.bound, names_[e]) : std::nullopt;
    errors_[e].push_back(error ? internal::summarised(*error) : missing);
    has_bound_[e].push_back(bound.has_value());
    n_of_[e] += error.has_value();
    if (bound) bounds_[e].add(internal::summarised(*bound));
  }
  if (!is_estimated) return;
  static const Interned nees = "nees", epe_initial_px = "epe_initial_px", distance_gt_m = "distance_gt_m",
                        Et_m = "Et_m";
  if (const auto value = find_number(record.values, nees)) nees_.add(internal::summarised(*value));
  if (const auto epe = find_number(record.errors, epe_initial_px); epe && record.flow_truth == "given")
    epe_initial_px_.add(internal::summarised(*epe));
  if (const auto distance_m = find_number(record.values, distance_gt_m);
      distance_m && record.errors.contains(Et_m))
    distance_gt_m_.add(internal::summarised(*distance_m));
}

void NoiseLevel::add(uint64_t seed, const BodySums& body) {
  if (!is_summed() && cases_.size() > 0) fail_mixed();
  const size_t n_errors = names_.size();
  sums_.resize(n_errors);
  values_.resize(n_errors);
  const auto row = static_cast<uint32_t>(cases_.size());
  cases_.add(seed, 0);
  n_truth_ += body.n_truth();
  n_estimated_ += body.n_estimated;
  std::string missed;
  for (const int frame : body.missed) missed += fmt::format("{} ", frame);
  missed_.push_back(std::hash<std::string>()(missed));
  for (size_t e = 0; e < n_errors; ++e) {
    RowSums& sums = sums_[e].emplace_back();
    if (const SampleSums* error = find_in(body.errors, names_[e])) {
      sums.error = {static_cast<double>(error->n), error->sum, error->sum_squares};
      n_of_[e] += error->n;
      for (const LogHistogram::Bin& bin : error->histogram.bins())
        values_[e].insert(values_[e].end(), bin.n, {row, bin.bin});
    }
    if (const LimitSums* limit = find_in(body.limits, names_[e])) {
      const auto n = static_cast<double>(limit->n);
      sums.bounded = {n, limit->error_sum, limit->error_squares};
      bounds_[e].add(Moments{n, missing, limit->bound_squares});
    }
  }
  const auto add_mean = [](const MeanSums& sums, Moments& moments) {
    if (sums.n > 0) moments.add(Moments{static_cast<double>(sums.n), sums.sum, missing});
  };
  add_mean(body.nees, nees_);
  add_mean(body.epe_initial_px, epe_initial_px_);
  add_mean(body.distance_gt_m, distance_gt_m_);
}

void NoiseLevel::fail_mixed() const {
  fail(
      "{} of {} {}, {}: occurs in a folder of records and in a folder of summaries: give folders that do not "
      "share estimators",
      key_.body, key_.dataset, key_.sequence, key_.estimator);
}

void NoiseLevel::sort() {
  const auto order = cases_.sorting_order();
  if (!order) return;
  reorder(*order, cases_.seeds);
  reorder(*order, cases_.frames);
  if (is_summed()) {
    std::vector<uint32_t> place(order->size());
    for (size_t row = 0; row < order->size(); ++row) place[(*order)[row]] = static_cast<uint32_t>(row);
    for (auto& sums : sums_) reorder(*order, sums);
    for (auto& values : values_) {
      for (BinnedValue& value : values) value.row = place[value.row];
    }
    reorder(*order, missed_);
    return;
  }
  for (std::vector<double>& column : errors_) reorder(*order, column);
  for (std::vector<bool>& column : has_bound_) reorder(*order, column);
}

std::vector<SeedFrame> NoiseLevel::repeated() const {
  std::vector<SeedFrame> cases;
  for (size_t row = 1; row < cases_.size(); ++row) {
    if (case_of(row) == case_of(row - 1)) cases.push_back(case_of(row));
  }
  return cases;
}

std::vector<SeedFrame> NoiseLevel::shared(const NoiseLevel& other) const {
  std::vector<SeedFrame> cases;
  for_each_case(cases_, other.cases_, [&](std::optional<size_t> a, std::optional<size_t> b) {
    if (a && b) cases.push_back(case_of(*a));
  });
  return cases;
}

size_t NoiseLevel::n_seeds() const {
  size_t n = 0;
  const std::vector<uint64_t>& seeds = cases_.seeds;
  for (size_t row = 0; row < seeds.size(); ++row) n += row == 0 || seeds[row] != seeds[row - 1];
  return n;
}

ClusterBy NoiseLevel::clusters() const {
  if (is_summed()) return ClusterBy::seeds;
  for (size_t error = 0; error < names_.size(); ++error) {
    const ClusterSums seeds = sums(error, ClusterBy::seeds);
    const bool differ = std::ranges::any_of(seeds, [&](const ClusterSum& seed) {
      return seed.of.x != seeds.front().of.x || seed.of.xx != seeds.front().of.xx;
    });
    if (differ) return ClusterBy::seeds;
  }
  return ClusterBy::frames;
}

NoiseLevel::Sample NoiseLevel::select(size_t error, ClusterBy by, bool only_bounded) const {
  Sample sample;
  for (size_t row = 0; row < cases_.size(); ++row) {
    const double value = errors_[error][row];
    if (std::isnan(value) || (only_bounded && !has_bound_[error][row])) continue;
    sample.values.push_back(value);
    const auto [seed, frame] = case_of(row);
    sample.clusters.push_back(by == ClusterBy::seeds ? seed : static_cast<uint64_t>(frame));
  }
  return sample;
}

ClusterSums NoiseLevel::row_sums(size_t error, Moments RowSums::*of) const {
  ClusterSums sums;
  for (size_t row = 0; row < cases_.size(); ++row) {
    const Moments& moments = sums_[error][row].*of;
    if (moments.n > 0) sums.push_back({cases_.seeds[row], moments});
  }
  return sums;
}

ClusterSums NoiseLevel::sums(size_t error, ClusterBy by) const {
  if (!has(error)) return {};
  if (is_summed()) return row_sums(error, &RowSums::error);
  const Sample sample = select(error, by, false);
  return cluster_sums(sample.values, sample.clusters);
}

ClusteredSample NoiseLevel::sample(size_t error, ClusterBy by) const {
  if (is_summed()) {
    Sample sample;
    for (const BinnedValue& value : values_[error]) {
      sample.values.push_back(LogHistogram::centre(value.bin));
      sample.clusters.push_back(cases_.seeds[value.row]);
    }
    return {row_sums(error, &RowSums::error), sample.values, sample.clusters};
  }
  const Sample sample = select(error, by, false);
  return {sample.values, sample.clusters};
}

std::pair<ClusterSums, Moments> NoiseLevel::bounded(size_t error) const {
  if (bounds_[error].n == 0) return {};
  if (is_summed()) return {row_sums(error, &RowSums::bounded), bounds_[error]};
  const Sample sample = select(error, ClusterBy::seeds, true);
  return {cluster_sums(sample.values, sample.clusters), bounds_[error]};
}

size_t NoiseLevel::n_with_error() const {
  if (is_summed()) return *std::ranges::max_element(n_of_);
  size_t n = 0;
  for (size_t row = 0; row < cases_.size(); ++row)
    n += std::ranges::any_of(errors_, [&](const auto& column) { return !std::isnan(column[row]); });
  return n;
}

Moments NoiseLevel::moments(size_t error, size_t row) const {
  if (is_summed()) return sums_[error][row].error;
  Moments of_record;
  if (!std::isnan(errors_[error][row])) of_record.add(errors_[error][row]);
  return of_record;
}

std::optional<std::vector<NoiseLevel::Common>> NoiseLevel::common(const NoiseLevel& other,
                                                                  size_t error) const {
  if (is_summed() != other.is_summed()) return std::nullopt;
  std::vector<Common> all;
  bool same_pairs = true;
  for_each_case(cases_, other.cases_, [&](std::optional<size_t> a, std::optional<size_t> b) {
    if (!a || !b) return;
    const Moments first = moments(error, *a), second = other.moments(error, *b);
    if (is_summed()) same_pairs = same_pairs && missed_[*a] == other.missed_[*b] && first.n == second.n;
    if (first.n > 0 && second.n > 0) all.push_back({cases_.seeds[*a], cases_.frames[*a], first, second});
  });
  return same_pairs ? std::optional(std::move(all)) : std::nullopt;
}

NoiseLevel level_of(const RecordRefs& records) {
  NoiseLevel level(NoiseLevelKey::of(*records.at(0)));
  for (const Record* record : records) level.add(*record);
  level.sort();
  return level;
}

size_t NoiseLevelKey::Hash::operator()(const NoiseLevelKey& key) const {
  size_t hash = std::hash<double>()(key.level);
  for (const Interned& part : {key.dataset, key.sequence, key.body, key.estimator, key.noise})
    hash = (hash ^ std::hash<const void*>()(&part.str())) * 0x9E3779B97F4A7C15U;
  return hash ^ (hash >> 32U);
}

NoiseLevel& NoiseLevels::level_of(const NoiseLevelKey& key) {
  const auto [level, is_new] = levels_.try_emplace(key, key);
  if (is_new) add_distinct(key.estimator, estimators_);
  return level->second;
}

void NoiseLevels::add(const Record& record) { level_of(NoiseLevelKey::of(record)).add(record); }

void NoiseLevels::add(const CaseSummary& summary) {
  for (const ResultSums& result : summary.results) {
    for (const BodySums& body : result.bodies) {
      const std::string name = body.body == 0 ? "ego" : object_body(body.body);
      level_of({summary.dataset, summary.sequence, name, result.estimator, summary.noise, summary.level})
          .add(summary.seed, body);
    }
  }
}

std::vector<NoiseLevelRef> NoiseLevels::take() {
  std::vector<NoiseLevelRef> levels;
  for (auto& [key, level] : levels_) {
    level.sort();
    levels.push_back(std::make_shared<const NoiseLevel>(std::move(level)));
  }
  levels_.clear();
  std::ranges::sort(levels, [](const auto& a, const auto& b) { return a->key() < b->key(); });
  return levels;
}

std::vector<std::span<const NoiseLevelRef>> curves_of(std::span<const NoiseLevelRef> levels) {
  std::vector<std::span<const NoiseLevelRef>> curves;
  for (size_t begin = 0, end = 0; begin < levels.size(); begin = end) {
    while (end < levels.size() && is_same_curve(levels[end]->key(), levels[begin]->key())) ++end;
    curves.push_back(levels.subspan(begin, end - begin));
  }
  return curves;
}

ClusterBy clusters_of(std::span<const NoiseLevelRef> levels) {
  const bool by_seeds = std::ranges::any_of(
      levels, [](const NoiseLevelRef& level) { return level->clusters() == ClusterBy::seeds; });
  return by_seeds ? ClusterBy::seeds : ClusterBy::frames;
}

ClusterLevels sums_by_cluster(std::span<const NoiseLevelRef> curve, size_t error, ClusterBy by) {
  ClusterLevels clusters;
  for (const NoiseLevelRef& level : curve) {
    for (const auto& [label, of] : level->sums(error, by)) clusters[label][level->key().level].add(of);
  }
  return clusters;
}

double mean_distance_m(std::span<const NoiseLevelRef> curve) {
  Moments distance_m;
  for (const NoiseLevelRef& level : curve) distance_m.add(level->distance_gt_m());
  return distance_m.mean();
}

}  // namespace sextant
