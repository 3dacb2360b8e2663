#pragma once

// The tables of the paper, and our own, rebuilt from records. How to add one:
//   1. write eval/report/tables/<name>.cc: a function from evidence to rows, declared here, which returns
//      rows also for values that were not measured (verdict "not measured here");
//   2. add one line to the table in registry.cc, and title and caption to
//      results/published/zhang2020_data.json.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/tables/published_rows.h"

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

}  // namespace sextant
