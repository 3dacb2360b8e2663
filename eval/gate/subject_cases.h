#pragma once

// Records of a run arranged for a comparison: by subject, in columns of 8 bytes per number. A subject is the
// unit that is judged: data set, sequence, estimator, noise, level and body. A record of it is one seed and
// frame.

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/noise_level.h"

namespace sextant {

using Subject = NoiseLevelKey;

/// Formats "synthetic s18 joint_flow level 0.1 object:2".
std::string to_string(const Subject& subject);
/// Names of subjects that are used as keys: to_string(), with the noise where it is not clear from the level,
/// because a plan has the same levels of several kinds of noise.
class SubjectNames {
 public:
  void add(const Subject& subject);
  std::string operator()(const Subject& subject) const;

 private:
  std::map<std::string, std::set<std::string>> noises_;
};
/// Order in which tables list subjects: object:2 comes before object:10.
struct SubjectOrder {
  bool operator()(const Subject& a, const Subject& b) const;
};

/// A number of every row, by name; NaN in a row that does not have it.
using NumberColumns = std::map<Interned, std::vector<double>>;

/// All records of one subject, in order of seed and frame.
struct SubjectCases : CaseColumns {
  std::vector<uint32_t> lines;  ///< line in records.jsonl, from 1
  std::vector<Status> statuses;
  std::vector<Gate> gates;
  std::vector<bool> have_truth;
  NumberColumns errors;
  NumberColumns truth;  ///< values that depend on the truth only
  /// `dynamic`: 1 if the body was classified as dynamic, 0 if as static; `nees`: of the estimator's own
  /// covariance
  NumberColumns values;
  NumberColumns times;            ///< times of the estimator's stages refine, start and total, ms
  uint64_t n_without_errors = 0;  ///< number of records for which lacks_errors() is true

  bool is_estimated(size_t row) const {
    return statuses[row] == Status::ok || statuses[row] == Status::no_truth;
  }
  /// Returns false if the body was gated for another reason than its decision, so that this has no effect.
  bool has_decision(size_t row) const {
    return statuses[row] != Status::gated || gates[row] == Gate::is_static;
  }
};

using Subjects = std::map<Subject, SubjectCases, SubjectOrder>;

/// Sorts records into subjects.
class SubjectCollector {
 public:
  /// Adds a record; `line` is its line in the file.
  void add(const Record& record, size_t line = 0);
  bool has_times() const { return has_times_; }
  /// Returns the subjects, each with its records in order.
  Subjects take();

 private:
  std::unordered_map<Subject, SubjectCases, Subject::Hash> subjects_;
  bool has_times_ = false;
};

/// Returns the number of a row; empty if the row, or the column, does not have it.
std::optional<double> number_at(const std::vector<double>* column, size_t row);

/// An entry of a map on both sides; the pointer of a side that lacks it is null.
template <typename T>
struct OnBothSides {
  const T* base = nullptr;
  const T* fresh = nullptr;
};
/// Pairs the entries of two maps, such as subjects or columns, by key.
template <typename Key, typename T, typename Order>
std::map<Key, OnBothSides<T>, Order> by_key(const std::map<Key, T, Order>& base,
                                            const std::map<Key, T, Order>& fresh) {
  std::map<Key, OnBothSides<T>, Order> pairs;
  for (const auto& [key, value] : base) pairs[key].base = &value;
  for (const auto& [key, value] : fresh) pairs[key].fresh = &value;
  return pairs;
}

/// Rows of the same record on both sides.
struct RowPair {
  uint32_t base, fresh;
};
/// Returns the numbers of a row on both sides; empty unless both have it.
std::optional<std::pair<double, double>> numbers_at(const OnBothSides<std::vector<double>>& column,
                                                    const RowPair& row);
/// Rows of the records that both sides have, and of those that only one side has, in order of seed and frame.
struct PairedRows {
  std::vector<RowPair> both;
  std::vector<size_t> only_base, only_fresh;
};
PairedRows pair_rows(const OnBothSides<SubjectCases>& pair);

/// Formats "seed 3 frame 2".
std::string case_name(const SubjectCases& cases, size_t row);

/// A subject that both sides have, with the records that they share.
struct PairedCases {
  Subject subject;
  const SubjectCases& base;
  const SubjectCases& fresh;
  std::string name;  ///< subject, with the noise if the level does not determine it
  std::vector<RowPair> rows;

  std::string name_of(const RowPair& row) const { return name + " " + case_name(base, row.base); }
};

}  // namespace sextant
