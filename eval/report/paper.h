#pragma once

// The paper as data. results/published/zhang2020.json contains the numbers that the paper prints;
// zhang2020_data.json assigns data, objects and estimators to the rows of its tables, and contains its
// statements. Tables, claims and figures take their names from these two files.

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/records/record.h"

namespace sextant {

/// Selects records of one data set and sequence, within frames first..last (current frames of pairs).
struct RecordFilter {
  std::string dataset;
  std::string sequence;
  int first_frame = 0;
  int last_frame = 1 << 30;

  bool matches(const Record& record) const;
};

/// One set of frames of the paper on one kind of data.
struct SetData {
  std::string set;  ///< the paper's name
  RecordFilter filter;
};

/// An estimator of this program with its appearance in tables and figures.
struct PaperEstimator {
  std::string name;
  std::string column;  ///< column in the paper's tables; "" if the paper does not have this estimator
  std::string title;   ///< short, for legends
  std::string colour;
  int point = 0;  ///< gnuplot's point type
};

/// A statement of the paper, or our statement about it.
struct Statement {
  std::string statement, place;
  std::string brief;  ///< wording in the answer of a reproduction; empty: not part of the answer
  std::string fetch;  ///< command that fetches its data; empty: the scenarios suffice
};

/// Title and caption of a table of the reproduction.
struct TableText {
  std::string title, caption;
  std::string data;   ///< data that the paper used; empty for our own tables
  std::string fetch;  ///< scripts that fetch the publicly available part of these data
};

/// The content of the two files.
struct Paper {
  Json published;              ///< zhang2020.json
  std::vector<SetData> sets;   ///< the paper's own data first
  std::string flow_error_set;  ///< the set whose flow errors the paper prints
  std::vector<PaperEstimator> estimators;
  /// Names of the estimators that stand for "motion only" and for the paper's method
  std::string baseline, method;
  PaperEstimator reference;    ///< recorded system that stands for the system which the paper compares with
  std::string code_procedure;  ///< the procedure of the published code
  std::string recorded_dataset, recorded_title;  ///< data set of recorded trajectories
  double recorded_rate_hz = 0;
  /// Sequences that are a section of a recorded sequence under a name of their own: own name and recorded
  /// name.
  std::vector<std::pair<std::string, std::string>> parts_of_recorded;
  /// By noise parameter: title of a panel of fig. 4, and the largest errors that the text states
  Json stated;

  /// Returns the paper's column of an estimator, ignoring a procedure after a comma; empty for our own
  /// estimators.
  std::optional<std::string> column_of(const std::string& estimator) const;
  /// Returns the mask ids of the objects that the paper calls `objects`; empty: all moving objects.
  std::set<int> ids_of(const std::string& sequence, const std::string& objects) const;
  /// Returns the paper's number of a record's sequence; empty if the paper does not have it.
  std::string sequence_of(const std::string& dataset, const std::string& sequence) const;
  /// Returns the name of the sequence under which trajectories of the record's frames are recorded.
  std::string recorded_sequence(const Record& record) const;
  /// Returns the texts of the table `number`, e.g. "III". Throws InternalError if there is none.
  TableText table(const std::string& number) const;
  Statement statement(const std::string& claim) const;
  /// Returns an entry of zhang2020_data.json.
  const Json& data(const char* key) const { return data_.at(key); }
  /// Returns the command that fetches the data of that name; "" for "". Throws InternalError for an unknown
  /// name.
  std::string fetch(const std::string& data) const;

  Paper(const Json& published, const Json& data);

 private:
  struct NamedSequence {
    std::string paper, dataset, sequence;  ///< a "*" at the end of a sequence matches any text
  };
  std::vector<NamedSequence> sequences_;
  Json data_;  ///< zhang2020_data.json
};

/// Returns the reproduced paper, which is read once from the files that come with the program.
const Paper& paper();

/// Reads a file of results/published, which comes with the program.
Json published_json(const std::string& name);

/// Returns the published number under this key; nullopt if the paper prints none (null). Throws Error if the
/// key does not exist, so that a misspelt key is not taken for a missing value.
std::optional<double> published_number(const Json& table, const std::string& key);

/// Returns the name for readers of the data on which something was measured: kind of data and sequence.
std::string data_title(const std::string& dataset, const std::string& sequence);
/// Also names the frames of the filter if it has a range: "replay of ..., frames 124-134".
std::string data_title(const RecordFilter& filter);

/// Returns the command that fetches the data and then measures. `fetch` is a command of ours (scripts/...),
/// or, for data that no script fetches, instructions, which are returned unchanged.
std::string measuring_line(const std::string& fetch);

}  // namespace sextant
