#pragma once

// Rows of the paper's tables: published value beside the reproduced one.
//
//   reproduced, low, high   mean over pairs and seeds, and its 95 % interval: bootstrap with a seed's pairs
//   as one
//                           cluster; with one seed, stretches of 5 frames, which depend on each other
//   run_low, run_high       where 95 % of single runs lie (one draw of the noise, as the paper's):
//                           m +- t s sqrt(1 + 1/n) over the n seeds' means; none with one seed
//   difference              reproduced - published
//   verdict                 within: the published value lies in run_low .. run_high, or, with one seed, in
//                           low .. high. outside: it does not. "not measured here": nothing was measured.
//                           Empty where the paper has no number

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct Measured : IntervalEstimate {
  std::optional<Interval> one_run;
  int n_pairs = 0;
  int n_seeds = 0;
};

struct PaperRow {
  std::string group{};      ///< set or sequence, as the paper calls it
  std::string body{};       ///< or group of objects
  std::string noise{};      ///< where a table has several
  std::string estimator{};  ///< words behind a comma name a procedure
  std::string quantity{};
  std::optional<double> published{};
  std::optional<Measured> measured{};
  std::string data{};     ///< on which it was measured, or what is missing
  std::string dataset{};  ///< of the records
  std::string records{};  ///< the part
  std::string command{};  ///< would measure it; shown where nothing was measured
  std::map<std::string, std::optional<double>> more{};  ///< cells of the table's own columns, by key

  /// "within", "outside", "undecided", "not measured here" or "".
  std::string verdict() const;
  bool is_missing() const { return !measured && published; }
};

/// A table of the paper: its labels, then the columns of every published value, then `more` of its own.
struct PublishedTable {
  std::string number;  ///< "III": title and caption are paper().table(number)
  Fields<PaperRow> labels;
  int decimals = 3;  ///< of values
  std::vector<Column> more{};
  std::vector<PaperRow> rows{};

  Table table() const;
};

/// A number of one record.
struct RecordNumber {
  const Record* record;
  double value;
};
/// Mean of these numbers; none of none. Seeds are those of `clusters`.
std::optional<Measured> measure_mean(const std::vector<RecordNumber>& numbers, const Clusters& clusters);
/// Mean of one number of the records that have it.
std::optional<Measured> measure_mean(const RecordRefs& records, NumberMap map, const std::string& key);

/// A number per seed (a count, say): mean over seeds. `n_pairs` is for the table.
Measured measure_by_seed(const std::vector<double>& by_seed, int n_pairs);

/// The address of a part's records, as tables of the reproduction have it; empty for "".
std::string records_of_part(const std::string& part);

}  // namespace sextant
