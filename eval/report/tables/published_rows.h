#pragma once

// Rows of the paper's tables: published value beside the reproduced one.
//
//   reproduced, low, high   mean over pairs and seeds, and its 95 % interval: bootstrap with a seed's pairs as one
//                           cluster; with one seed, stretches of 5 frames, which depend on each other
//   run_low, run_high       where 95 % of single runs lie (one draw of the noise, as the paper's):
//                           m +- t s sqrt(1 + 1/n) over the n seeds' means; none with one seed
//   difference              reproduced - published
//   verdict                 within: the published value lies in run_low .. run_high, or, with one seed, in
//                           low .. high. outside: it does not. "not measured here": nothing was measured.
//                           Empty where the paper has no number

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
  std::vector<std::string> labels;
  std::string quantity;
  std::optional<double> published;
  std::optional<Measured> measured;
  std::string data;     ///< on which it was measured, or what is missing
  std::string records;  ///< the part
};

/// Mean of one number of the records that have it; none where no record has.
std::optional<Measured> measure_mean(const RecordRefs& records, NumberMap map, const std::string& key);

/// A number per seed (a count, say): mean over seeds. `n_pairs` is for the table.
Measured measure_by_seed(const std::vector<double>& by_seed, int n_pairs);

std::string published_verdict(const std::optional<double>& published,
                              const std::optional<Measured>& measured);

/// A table with `labels` as first columns, ready for add_published_row().
Table published_table(const std::string& title, const std::string& caption, std::vector<Column> labels,
                      int decimals);
/// The cells of a row; tables with columns of their own append to them.
std::vector<Cell> published_cells(const PaperRow& row);
void add_published_row(const PaperRow& row, Table& table);

/// The address of a part's records, as tables of the reproduction have it; empty for "".
std::string records_of_part(const std::string& part);

inline constexpr const char* comparison_caption =
    "95 % interval: of the mean (bootstrap over seeds; with one seed over stretches of 5 frames). Single runs: "
    "where 95 % of them lie. Verdict: whether the published value, which is one run, lies there (with one seed: "
    "in the interval).";

}  // namespace sextant
