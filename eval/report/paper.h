#pragma once

// The paper as data: results/published/zhang2020.json holds the numbers that it prints, zhang2020_data.json
// which data, objects and estimators stand for its rows, and what it states. Tables, claims and figures
// take their names from here.

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/records/record.h"

namespace sextant {

/// Records of one dataset and sequence, within frames first..last (current frames of pairs).
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

/// An estimator of this program as tables and figures show it.
struct PaperEstimator {
  std::string name;
  std::string column;  ///< of the paper's tables; "" for one that the paper does not have
  std::string title;   ///< short, for legends
  std::string colour;
  int point = 0;  ///< gnuplot's point type
};

/// A statement of the paper, or of ours about it.
struct Statement {
  std::string statement, place;
  std::string brief;  ///< in the answer of a reproduction; empty: it is not in the answer
  std::string fetch;  ///< gets the data it needs; empty: the scenarios are enough
};

/// Title and caption of a table of the reproduction.
struct TableText {
  std::string title, caption;
  std::string data;   ///< what the paper measured on; empty for tables of ours
  std::string fetch;  ///< scripts that get what can be had of it
};

struct Paper {
  Json published;              ///< zhang2020.json
  std::vector<SetData> sets;   ///< the paper's own data first
  std::string flow_error_set;  ///< the set whose flow errors the paper prints
  std::vector<PaperEstimator> estimators;
  std::string baseline,
      method;  ///< names of the estimators that stand for "motion only" and for the paper's method
  PaperEstimator reference;    ///< the recorded system that stands for the one which the paper compares with
  std::string code_procedure;  ///< the procedure of the published code
  std::string recorded_dataset, recorded_title;  ///< data set of recorded trajectories
  double recorded_rate_hz = 0;
  Json stated;  ///< by noise parameter: title of a panel of fig. 4, largest errors that the text states

  /// The column of the paper for an estimator, whatever procedure its name has behind a comma; none for ours.
  std::optional<std::string> column_of(const std::string& estimator) const;
  /// Ids in the masks of the objects that the paper calls so; empty: all that move.
  std::set<int> ids_of(const std::string& sequence, const std::string& objects) const;
  /// The paper's number of a record's sequence; empty for a sequence that it does not have.
  std::string sequence_of(const std::string& dataset, const std::string& sequence) const;
  /// Sequences that are a part of a recorded one under their own name: own name and recorded one.
  const std::vector<std::pair<std::string, std::string>>& parts_of_recorded() const {
    return parts_of_recorded_;
  }
  /// The sequence under which trajectories of the record's frames are recorded.
  std::string recorded_sequence(const Record& record) const;
  /// Text of the table of that number: "III". Throws InternalError where there is none.
  TableText table(const std::string& number) const;
  Statement statement(const std::string& claim) const;
  /// The line that gets the data of that name. Throws InternalError for an unknown name.
  std::string fetch(const std::string& data) const;

  explicit Paper(const Json& published, const Json& data);

 private:
  struct NamedSequence {
    std::string paper, dataset, sequence;  ///< "*" at the end of a sequence stands for anything
  };
  struct Objects {
    std::string sequence, objects;
    std::set<int> ids;
  };
  std::vector<NamedSequence> sequences_;
  std::vector<Objects> objects_;
  std::vector<std::pair<std::string, std::string>> parts_of_recorded_;
  Json tables_, claims_, fetch_;
};

/// The paper that is reproduced, read once from the files that come with the program.
const Paper& paper();

/// A file of results/published, which come with the program.
Json published_json(const std::string& name);

/// The number at this path of the published values; none where the paper prints none. Throws Error where the
/// path does not exist: a misspelt key must not look like a missing value.
std::optional<double> published_number(const Json& table, const std::string& key);

/// Where a record was measured, for people: kind of data and sequence.
std::string data_title(const std::string& dataset, const std::string& sequence);
/// The same with the frames of the filter, if it has a range: "replay of ..., frames 124-134".
std::string data_title(const RecordFilter& filter);

/// What fetches the data and then measures; where no script of ours fetches them, what to do instead.
std::string measuring_line(const std::string& fetch);

}  // namespace sextant
