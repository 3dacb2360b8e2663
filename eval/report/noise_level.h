#pragma once

// What one estimator made of one body at one level of the noise, as columns: the case, the compared errors
// and nothing else of its records, about 30 bytes each. Tables, figures and claims on noise are functions
// of these. A sweep may have kept summaries instead of records (records/case_summary.h): then a row is a
// case, its sums are exact, and its values are the centres of their bins. Frames are not known.
//
//   truth       records whose body has truth, and is not static by truth
//   estimated   those of them with status ok
// Every number below is of the estimated ones; n_seeds() alone is of all records.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

/// What was drawn independently (stats/bootstrap.h): a seed; where all have the same seed, a frame.
enum class ClusterBy { seeds, frames };

struct NoiseLevelKey {
  Interned dataset, sequence, body, estimator, noise;
  double level = 0;

  static NoiseLevelKey of(const Record& record);
  bool operator==(const NoiseLevelKey&) const = default;
  /// Dataset, sequence, body (ego first, objects by id), estimator, level, noise.
  bool operator<(const NoiseLevelKey& other) const;
  /// The same but for level and noise: the same curve.
  bool is_same_curve(const NoiseLevelKey& other) const;

  struct Hash {
    size_t operator()(const NoiseLevelKey& key) const;
  };
};

/// `metrics_for(compared)`: the columns of a level. An error is called by its index here.
const std::vector<const MetricDefinition*>& compared_errors();
/// Names of compared_errors().
const std::vector<Interned>& compared_names();
/// The index of that name; throws InternalError where there is none.
size_t compared_error(std::string_view name);

class NoiseLevel {
 public:
  explicit NoiseLevel(NoiseLevelKey key, std::vector<Interned> errors = compared_names())
      : key_(key), names_(std::move(errors)) {}

  void add(const Record& record);
  /// A case's summary of the body. Throws Error where there are records, and the other way round.
  void add(uint64_t seed, const BodySums& body);
  bool is_summed() const { return !sums_.empty(); }
  /// Into order of case, once all are there.
  void sort();
  /// Cases that stand more than once, in order; sorted.
  std::vector<SeedFrame> repeated() const;
  /// Cases of both; both sorted.
  std::vector<SeedFrame> shared(const NoiseLevel& other) const;

  const NoiseLevelKey& key() const { return key_; }
  size_t n_truth() const { return n_truth_; }
  size_t n_estimated() const { return n_estimated_; }
  size_t n_seeds() const;
  ClusterBy clusters() const { return is_summed() || n_seeds() > 1 ? ClusterBy::seeds : ClusterBy::frames; }

  bool has(size_t error) const { return n_of_.at(error) > 0; }
  /// One error of those that have it.
  ClusterSums sums(size_t error, ClusterBy by) const;
  ClusteredSample sample(size_t error, ClusterBy by) const;
  /// The same of those that have a bound of that error too, by seed; and the moments of these bounds.
  std::pair<ClusterSums, Moments> bounded(size_t error) const;
  Moments nees() const { return nees_; }
  /// EPE before the refinement where the true flow is given: the noise that was really there.
  Moments epe_initial_px() const { return epe_initial_px_; }
  /// True distance of those that have E_t.
  Moments distance_gt_m() const { return distance_gt_m_; }

  /// Rows of two levels that are of one case and have a compared error each; both sorted.
  std::vector<std::pair<size_t, size_t>> pairs(const NoiseLevel& other) const;
  size_t n_with_error() const;
  /// Of two levels of summaries, by seed of both: the sums of an error that both have. Nothing where in
  /// some seed they are of different pairs.
  struct SeedSums {
    uint64_t seed;
    Moments first, second;
  };
  std::optional<std::vector<SeedSums>> paired_sums(const NoiseLevel& other, size_t error) const;
  SeedFrame case_of(size_t row) const { return cases_.case_of(row); }
  /// NaN where the row has none.
  double error(size_t error, size_t row) const { return errors_[error][row]; }

 private:
  struct Sample {
    std::vector<double> values;
    std::vector<uint64_t> clusters;
  };
  Sample select(size_t error, ClusterBy by, bool only_bounded) const;
  bool has_error(size_t row) const;
  [[noreturn]] void fail_mixed() const;

  NoiseLevelKey key_;
  std::vector<Interned> names_;  ///< of the errors
  size_t n_truth_ = 0, n_estimated_ = 0;
  std::vector<size_t> n_of_ = std::vector<size_t>(names_.size());  ///< by error
  std::vector<Moments> bounds_ = std::vector<Moments>(names_.size());
  Moments nees_, epe_initial_px_, distance_gt_m_;
  CaseColumns cases_;
  // By row, which is a record.
  std::vector<std::vector<double>> errors_ = std::vector<std::vector<double>>(names_.size());
  std::vector<std::vector<bool>> has_bound_ = std::vector<std::vector<bool>>(names_.size());  ///< by error
  // By row, which is a case, instead of errors_; the frames of cases_ are 0.
  struct RowSums {
    Moments error, bounded;
  };
  struct BinnedValue {
    uint32_t row;
    int bin;
  };
  ClusterSums row_sums(size_t error, Moments RowSums::*of) const;

  std::vector<std::vector<RowSums>> sums_;        ///< by error
  std::vector<std::vector<BinnedValue>> values_;  ///< by error
  std::vector<size_t> missed_;                    ///< hash of the frames that were not estimated
};

/// Records of one body under one estimator as one level, whatever their noise; not empty.
NoiseLevel level_of(const RecordRefs& records);

/// Levels do not change once they are read.
using NoiseLevelRef = std::shared_ptr<const NoiseLevel>;

/// Sorts records into their levels.
class NoiseLevels {
 public:
  void add(const Record& record);
  void add(const CaseSummary& summary);
  /// In order of key, each sorted.
  std::vector<NoiseLevelRef> take();
  /// In order of first appearance.
  const std::vector<Interned>& estimators() const { return estimators_; }

 private:
  NoiseLevel& level_of(const NoiseLevelKey& key);

  std::unordered_map<NoiseLevelKey, NoiseLevel, NoiseLevelKey::Hash> levels_;
  std::vector<Interned> estimators_;
};

/// Seeds where these levels have two or more between them.
ClusterBy clusters_of(std::span<const NoiseLevelRef> levels);

/// Levels that differ in level and noise alone, of a list in order of key.
std::vector<std::span<const NoiseLevelRef>> curves_of(std::span<const NoiseLevelRef> levels);

/// Of a body over the levels of its curve: the mean of their true distances, m.
double mean_distance_m(std::span<const NoiseLevelRef> curve);

}  // namespace sextant
