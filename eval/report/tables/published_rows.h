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
//                           low .. high. outside: it does not. undecided: there is no interval. "not
//                           comparable": there is a PaperRow::reason. "not measured here": nothing was
//                           measured. Empty if the paper has no number

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sextant/base/json.h"
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

  /// Returns this value with its intervals, multiplied by `factor`.
  Measured scaled(double factor) const;
};

/// Returns the verdict on a published value: "within", "outside", "undecided", "not measured here" or "".
std::string verdict_on(const std::optional<double>& published, const std::optional<Measured>& measured);

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
  std::string records{};  ///< name of the experiment that made the records
  std::string command{};  ///< command that would measure it; shown if nothing was measured
  std::string reason{};   ///< why `measured` is not comparable with `published`; empty if it is comparable
  /// Values of additional columns of this table, by key
  std::map<std::string, std::optional<double>> more{};

  std::string verdict() const {
    return measured && published && !reason.empty() ? "not comparable" : verdict_on(published, measured);
  }
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

// ---- results/published/zhang2020_layout.json: the tables as the paper prints them, and what is comparable.

const Json& layout_data();
/// Returns true if `dataset` is of this kind of data, an element of "data" of the layout.
bool is_of_kind(const std::string& dataset, const Json& kind);
/// Returns the reason why the paper's value in a row of the layout is not comparable with a value that was
/// measured on `dataset`; empty if it is comparable.
std::string reason_of(const Json& layout_row, const std::string& dataset);
/// Sets PaperRow::reason of all rows as the layout of the table states it. A count of which the layout
/// compares the share is not comparable itself.
PublishedTable with_reasons(PublishedTable table);

/// A number of one record.
struct RecordNumber {
  const Record* record;
  double value;
};
/// Returns the mean of these numbers with its interval; nullopt if there are none. `clusters` defines the
/// number of seeds, and whether seeds or stretches of frames are resampled.
std::optional<Measured> measure_mean(const std::vector<RecordNumber>& numbers, const Clusters& clusters);
/// Returns the mean of one number over the records that have it, with its interval.
std::optional<Measured> measure_mean(const RecordRefs& records, NumberMap map, const std::string& key);

/// Returns the mean over seeds of one number per seed, such as a count. `n_pairs` is only copied to the
/// result.
Measured measure_by_seed(const std::vector<double>& by_seed, int n_pairs);

/// Returns the address of the records of an experiment, for links in tables; "" for "".
std::string records_of_part(const std::string& part);

// ---- Records of the paper's sets of frames, grouped like the paper's tables.

RecordRefs matching(const std::vector<Record>& records, const RecordFilter& filter);

/// Groups estimated records with truth by the paper's name of the body: "Ego", and "Obj1", "Obj2", .. for the
/// moving objects with truth, in order of their mean true distance. An object that was never estimated has an
/// empty group.
std::map<std::string, RecordRefs> paper_bodies(const RecordRefs& records);
/// Returns the key in paper_bodies() of a printed name: "Obj" of a set with a single object is "Obj1".
std::string paper_body(const std::string& printed);

// ---- Run times per frame pair, from the records of the experiments that were timed on one thread.

inline constexpr const char* frame_stage = "frame";  ///< extraction + camera + objects

struct RunTimes {
  std::string data, estimator, part;
  std::map<std::string, std::vector<double>> by_stage;  ///< ms, one value per frame pair
};

std::vector<RunTimes> run_times(const Evidence& evidence);

/// Times of a frame pair in ms, measured in several rounds, by round (the seed of the records) and frame.
using RoundTimes = std::map<std::pair<uint64_t, int>, double>;

/// Returns the smallest time of every frame over the rounds, since other work on the machine only adds time.
std::vector<double> best_rounds_ms(const RoundTimes& rounds);

}  // namespace sextant
