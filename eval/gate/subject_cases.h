#pragma once

// The records of a run as a comparison needs them: by subject, in columns, 8 bytes a number. A subject is what is judged as one:
// dataset, sequence, estimator, noise, level and body. A case is one seed and frame of it.

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/case_columns.h"
#include "sextant/eval/report/noise_level.h"

namespace sextant {

using Subject = NoiseLevelKey;

/// "synthetic s18 joint_flow level 0.1 object:2".
std::string to_string(const Subject& subject);
/// Order of subjects in tables: < 0, 0, > 0.
int compare_subjects(const Subject& a, const Subject& b);

/// Numbers of one name by row; NaN where a row has none.
struct NumberColumn {
  Interned name;
  std::vector<double> numbers;

  bool has(size_t row) const;
};

struct SubjectCases : CaseColumns {
  explicit SubjectCases(const Subject& of) : subject(of) {}

  Subject subject;
  std::vector<uint32_t> lines;  ///< of records.jsonl, from 1
  std::vector<Status> statuses;
  std::vector<Gate> gates;
  std::vector<bool> have_truth;
  // In order of name.
  std::vector<NumberColumn> errors;
  std::vector<NumberColumn> truth;  ///< what the truth alone decides
  std::vector<NumberColumn> times;  ///< of the stages of an estimator: refine, start, total [ms]

  bool is_estimated(size_t row) const {
    return statuses[row] == Status::ok || statuses[row] == Status::no_truth;
  }
};

/// Null where there is none.
const NumberColumn* find_column(const std::vector<NumberColumn>& columns, Interned name);

/// One name of two lists of columns; null where a list lacks it.
struct ColumnPair {
  Interned name;
  const NumberColumn* base;
  const NumberColumn* fresh;
};
/// In order of name.
std::vector<ColumnPair> pair_columns(const std::vector<NumberColumn>& base,
                                     const std::vector<NumberColumn>& fresh);

/// One subject of two sides; null where a side lacks it.
struct SubjectPair {
  const SubjectCases* base;
  const SubjectCases* fresh;

  const Subject& subject() const { return (base != nullptr ? base : fresh)->subject; }
};
/// Both in order, as is what comes out.
std::vector<SubjectPair> pair_subjects(const std::vector<SubjectCases>& base,
                                       const std::vector<SubjectCases>& fresh);

struct RowPair {
  uint32_t base, fresh;
};
/// Rows in order of case.
struct PairedRows {
  std::vector<RowPair> both;
  std::vector<size_t> only_base, only_fresh;
};
PairedRows pair_rows(const SubjectPair& pair);

/// Sorts records into their subjects.
class SubjectCollector {
 public:
  /// The record stands in that line of its file.
  void add(const Record& record, size_t line = 0);
  bool has_times() const { return has_times_; }
  /// In order of subject, each in order of case.
  std::vector<SubjectCases> take();

 private:
  std::unordered_map<Subject, SubjectCases, Subject::Hash> subjects_;
  bool has_times_ = false;
};

}  // namespace sextant
