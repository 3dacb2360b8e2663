#pragma once

// The tables of the paper, and our own, rebuilt from records. How to add one:
//   1. write eval/report/tables/<name>.cc: a function from evidence to rows, declared here, which returns
//      rows also for values that were not measured (verdict "not measured here");
//   2. add one line to the table in registry.cc, and title and caption to
//      results/published/zhang2020_data.json.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// Places of the paper's tables and figures in the order of the paper, then the place of our own.
enum class PaperPlace { fig_1, table_1, fig_4, table_2, table_3, fig_5, table_4, table_5, fig_6, ours };

struct PaperTable {
  std::string name;    ///< file name: "table_3_sets"
  std::string number;  ///< "III"
  PaperPlace place = PaperPlace::ours;
  /// Exactly one is set: `published` for tables of the paper, `ours` for our own.
  std::function<PublishedTable(const Evidence&)> published{};
  std::function<Table(const Evidence&)> ours{};
  std::vector<std::string> split_by{};  ///< NamedTable::split_by

  Table make(const Evidence& evidence) const { return ours ? ours(evidence) : published(evidence).table(); }
};

std::span<const PaperTable> paper_tables();

/// Reads results/systems/systems.json: for each measured published system its name in records, repository,
/// commit, modifications, and the ground truth that it reads.
Json system_descriptions();

PublishedTable classification_table(const Evidence& evidence);  // I
PublishedTable flow_error_table(const Evidence& evidence);      // II
PublishedTable sets_table(const Evidence& evidence);            // III
PublishedTable ego_motion_table(const Evidence& evidence);      // IV
PublishedTable velocity_table(const Evidence& evidence);        // V
Table limit_table(const Evidence& evidence);                    // VI
Table run_time_table(const Evidence& evidence);                 // VII
Table attribution_table(const Evidence& evidence);              // VIII
Table systems_table(const Evidence& evidence);                  // IX

/// Makes a table with the title and caption of the table `number`; `note` is added if there are no rows.
template <typename Row>
Table numbered_table(const std::string& number, const std::string& note, const Fields<Row>& fields,
                     const std::vector<Row>& rows) {
  const TableText text = paper().table(number);
  Table table = table_of(text.title, text.caption, fields, rows);
  if (rows.empty()) table.notes.push_back(note);
  return table;
}

// ---- Attribution: the change of E_t by each decision on the way from the published code's procedure to ours
// (attribution_table.cc). The evidence is the records of the experiments with role `attribution`. Their
// estimators are called "PATH > DECISION"; in the order of experiments and plans, each estimator of a path
// makes one more decision as we do. A path begins with the published code and ends with our default.
//
// Means are over the pairs and seeds that every step of a path has estimated, so that the changes add up to
// the total. Intervals: 95 %, paired bootstrap over seeds.

struct AttributionStep {
  std::string decision;
  std::string part;           ///< where its records are
  IntervalEstimate Et_m;      ///< mean E_t with this decision and those before it
  IntervalEstimate change_m;  ///< change of that mean by the decision; 0 for the first step
};

/// One body of one of the paper's sets on one kind of data.
struct AttributionPath {
  std::string set, data, body;
  /// Estimator that stands for the function of the published code with which the path begins
  std::string path;
  std::vector<AttributionStep> steps;
  IntervalEstimate whole_m;  ///< change from the first step to the last
  size_t n_pairs = 0, n_seeds = 0;
  std::optional<double> published_m;  ///< E_t that the paper prints for this function
};

/// Returns the paths in order of set, data, body and path; paths with fewer than two steps are left out.
std::vector<AttributionPath> attribution_paths(const Evidence& evidence);

}  // namespace sextant
