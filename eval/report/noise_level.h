#pragma once

// Results of one estimator for one body at one noise level, as columns: the case and the compared errors of
// its records, about 30 bytes per record. Tables, figures and claims about noise are computed from these. A
// sweep may have kept summaries instead of records (records/case_summary.h). Then a row is a case, its sums
// are exact, its values are the centres of histogram bins, and its frames are unknown.
//
//   truth       records whose body has truth, and is not static by truth
//   estimated   records of these with status ok
//
// All numbers below refer to estimated records, except n_truth(), and n_seeds(), which counts the seeds of
// all records.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

/// Independent units (stats/bootstrap.h): seeds, or frames if all records have the same seed.
enum class ClusterBy { seeds, frames };

/// Identifies a noise level.
struct NoiseLevelKey {
  Interned dataset, sequence, body, estimator, noise;
  double level = 0;

  static NoiseLevelKey of(const Record& record);
  bool operator==(const NoiseLevelKey&) const = default;
  /// Orders by data set, sequence, body (camera first, objects by id), estimator, level and noise.
  bool operator<(const NoiseLevelKey& other) const;

  struct Hash {
    size_t operator()(const NoiseLevelKey& key) const;
  };
};

/// Returns the errors that a level stores, metrics_for(compared). An error is addressed by its index in this
/// list.
const std::vector<const MetricDefinition*>& compared_errors();
/// Returns the names of compared_errors().
const std::vector<Interned>& compared_names();
/// Returns the index of an error; throws InternalError if there is none of that name.
size_t compared_error(std::string_view name);

/// The columns of one level.
class NoiseLevel {
 public:
  explicit NoiseLevel(NoiseLevelKey key, std::vector<Interned> errors = compared_names())
      : key_(key), names_(std::move(errors)) {}

  void add(const Record& record);
  /// Adds the summary of a case. Throws Error if the level has records; the other overload throws Error if it
  /// has summaries.
  void add(uint64_t seed, const BodySums& body);
  bool is_summed() const { return !sums_.empty(); }
  /// Sorts the rows by case, after the last add().
  void sort();
  /// Returns the cases that occur more than once, in order. Needs sort().
  std::vector<SeedFrame> repeated() const;
  /// Returns the cases that both levels have. Both need sort().
  std::vector<SeedFrame> shared(const NoiseLevel& other) const;

  const NoiseLevelKey& key() const { return key_; }
  size_t n_truth() const { return n_truth_; }
  size_t n_estimated() const { return n_estimated_; }
  size_t n_seeds() const;
  /// Returns what is drawn at random: seeds if any two of them have different errors, or in summaries.
  /// Otherwise frames; without noise all seeds are copies of one.
  ClusterBy clusters() const;

  bool has(size_t error) const { return n_of_.at(error) > 0; }
  /// Return one error of the records that have it, as sums per cluster, or as values with their clusters. The
  /// clusters of summaries are always seeds.
  ClusterSums sums(size_t error, ClusterBy by) const;
  ClusteredSample sample(size_t error, ClusterBy by) const;
  /// Returns the sums of an error by seed over the records that also have a bound of it, and the moments of
  /// these bounds.
  std::pair<ClusterSums, Moments> bounded(size_t error) const;
  Moments nees() const { return nees_; }
  /// EPE before the refinement, if the true flow is known; it shows the actual noise.
  Moments epe_initial_px() const { return epe_initial_px_; }
  /// True distance of the records that have E_t.
  Moments distance_gt_m() const { return distance_gt_m_; }

  /// Returns the number of records that have a compared error.
  size_t n_with_error() const;
  /// One error of a frame pair in two levels or, in summaries, of the pairs of a seed.
  struct Common {
    uint64_t seed;
    int frame;
    Moments first, second;
  };
  /// Returns what both levels have of an error, in order of case; both need sort(). Returns nullopt if only
  /// one of them has summaries, which identify pairs by seed only, or if both have and the sets of estimated
  /// frames differ for any seed.
  std::optional<std::vector<Common>> common(const NoiseLevel& other, size_t error) const;
  size_t n_rows() const { return cases_.size(); }
  SeedFrame case_of(size_t row) const { return cases_.case_of(row); }
  /// Returns the error of a row; NaN if the row has none.
  double error(size_t error, size_t row) const { return errors_[error][row]; }

 private:
  struct Sample {
    std::vector<double> values;
    std::vector<uint64_t> clusters;
  };
  Sample select(size_t error, ClusterBy by, bool only_bounded) const;
  Moments moments(size_t error, size_t row) const;
  [[noreturn]] void fail_mixed() const;

  NoiseLevelKey key_;
  std::vector<Interned> names_;  ///< names of the errors
  size_t n_truth_ = 0, n_estimated_ = 0;
  std::vector<size_t> n_of_ = std::vector<size_t>(names_.size());  ///< by error
  std::vector<Moments> bounds_ = std::vector<Moments>(names_.size());
  Moments nees_, epe_initial_px_, distance_gt_m_;
  CaseColumns cases_;
  // Columns of records, by error and row.
  std::vector<std::vector<double>> errors_ = std::vector<std::vector<double>>(names_.size());
  std::vector<std::vector<bool>> has_bound_ = std::vector<std::vector<bool>>(names_.size());  ///< by error
  // Columns of summaries, whose rows are cases; errors_ is then empty, and the frames of cases_ are 0.
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
  std::vector<size_t> missed_;                    ///< by row; hash of the frames that were not estimated
};

/// Makes one level from the records of one body under one estimator, whatever their noise; `records` must not
/// be empty.
NoiseLevel level_of(const RecordRefs& records);

/// Shared pointer, since levels do not change once they are read.
using NoiseLevelRef = std::shared_ptr<const NoiseLevel>;

/// Sorts records into their levels.
class NoiseLevels {
 public:
  void add(const Record& record);
  void add(const CaseSummary& summary);
  /// Returns the levels in order of key, each sorted.
  std::vector<NoiseLevelRef> take();
  /// Returns the estimators in order of first appearance.
  const std::vector<Interned>& estimators() const { return estimators_; }

 private:
  NoiseLevel& level_of(const NoiseLevelKey& key);

  std::unordered_map<NoiseLevelKey, NoiseLevel, NoiseLevelKey::Hash> levels_;
  std::vector<Interned> estimators_;
};

/// Returns seeds if they are the clusters() of any level, otherwise frames.
ClusterBy clusters_of(std::span<const NoiseLevelRef> levels);

/// Groups levels that differ in level and noise only; `levels` must be in order of key.
std::vector<std::span<const NoiseLevelRef>> curves_of(std::span<const NoiseLevelRef> levels);

/// Sums of one error by cluster and level, for the levels that each cluster has.
using ClusterLevels = std::map<uint64_t, std::map<double, Moments>>;
ClusterLevels sums_by_cluster(std::span<const NoiseLevelRef> curve, size_t error, ClusterBy by);

/// Mean true distance of a body over the levels of its curve, m.
double mean_distance_m(std::span<const NoiseLevelRef> curve);

}  // namespace sextant
