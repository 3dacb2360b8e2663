#pragma once

// Rows of the paper's tables: the published value and the reproduced one.
//
//   reproduced, low, high   mean over pairs and seeds with its 95 % interval: bootstrap with the pairs of a
//                           seed as one cluster; with one seed, with stretches of 5 frames, which depend on
//                           each other
//   run_low, run_high       range of 95 % of single runs (one draw of the noise, like the paper's):
//                           m +- t s sqrt(1 + 1/n) over the means of n seeds; none with one seed
//   difference              reproduced - published
//   verdict                 within: the published value lies in run_low .. run_high, or, with one seed, in
//                           low .. high. outside: it does not. "not measured here": nothing was measured.
//                           Empty if the paper has no number

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// A reproduced value.
struct Measured : IntervalEstimate {
  std::optional<Interval> one_run;
  int n_pairs = 0;
  int n_seeds = 0;
};

/// One published value with its reproduction.
struct PaperRow {
  std::string group{};      ///< set or sequence, as the paper calls it
  std::string body{};       ///< the paper's name of the body or group of objects
  std::string noise{};      ///< if the table has several noises
  std::string estimator{};  ///< the words after a comma name a procedure
  std::string quantity{};
  std::optional<double> published{};
  std::optional<Measured> measured{};
  std::string data{};     ///< data that it was measured on, or the missing data
  std::string dataset{};  ///< data set of the records
  std::string records{};  ///< experiment that holds the records
  std::string command{};  ///< command that would measure it; shown if nothing was measured
  /// Values of additional columns of this table, by key
  std::map<std::string, std::optional<double>> more{};

  /// "within", "outside", "undecided", "not measured here" or "".
  std::string verdict() const;
  bool is_missing() const { return !measured && published; }
};

/// A table of the paper: its labels, the columns that every published value has, and the columns `more` of
/// this table.
struct PublishedTable {
  std::string number;  ///< "III"; title and caption are paper().table(number)
  Fields<PaperRow> labels;
  int decimals = 3;  ///< decimals of the values
  std::vector<Column> more{};
  std::vector<PaperRow> rows{};

  Table table() const;
};

/// A number of one record.
struct RecordNumber {
  const Record* record;
  double value;
};
/// Mean of these numbers with its interval; empty if there are none. The seeds are those of `clusters`.
std::optional<Measured> measure_mean(const std::vector<RecordNumber>& numbers, const Clusters& clusters);
/// Mean of one number over the records that have it.
std::optional<Measured> measure_mean(const RecordRefs& records, NumberMap map, const std::string& key);

/// Mean over seeds of a number per seed, such as a count. `n_pairs` is only reported.
Measured measure_by_seed(const std::vector<double>& by_seed, int n_pairs);

/// Address of the records of an experiment, for links in tables; empty for "".
std::string records_of_part(const std::string& part);

}  // namespace sextant
