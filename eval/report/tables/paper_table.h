#pragma once

// The tables of the paper, and ours, rebuilt from records. How to add one:
//   1. write eval/report/tables/<name>.cc: a function Table f(const Evidence&), declared here, that has rows
//      also where nothing was measured (verdict "not measured here");
//   2. add one line to the table in registry.cc.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct PaperTable {
  std::string name;        ///< file name: "table_3_sets"
  std::string number;      ///< "III"
  std::string exact_data;  ///< what the paper measured on
  std::string fetch;       ///< scripts that get what can be had of it
  std::function<Table(const Evidence&)> make;
  std::vector<std::string> split_by{};  ///< NamedTable::split_by
};

std::span<const PaperTable> paper_tables();

/// results/published/zhang2020.json.
Json published_values();
/// results/systems/systems.json: of each published system that was measured its name in records, repository,
/// commit, changes and what of the truth it sees.
Json system_descriptions();

Table classification_table(const Evidence& evidence);  // I
Table flow_error_table(const Evidence& evidence);      // II
Table sets_table(const Evidence& evidence);            // III
Table ego_motion_table(const Evidence& evidence);      // IV
Table velocity_table(const Evidence& evidence);        // V
Table limit_table(const Evidence& evidence);           // VI
Table run_time_table(const Evidence& evidence);        // VII
Table attribution_table(const Evidence& evidence);     // VIII
Table systems_table(const Evidence& evidence);         // IX

}  // namespace sextant
