// Which decision makes the difference between the published code and ours.

#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/attribution.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {
Table attribution_table(const Evidence& evidence) {
  Table table{
      "Table VIII (ours): from the published code to ours, one decision at a time",
      "Mean E_t over the pairs that every step estimates, objects in the camera frame. A row makes one "
      "decision as we do and keeps those above it; its change is what that decision does, and changes add "
      "up. The first row of a path is the published code's function (motion_only, or joint_flow) on its "
      "points: RANSAC inliers at 0.3 px, for joint and the camera all static matches. The last row is our "
      "default.",
      {Column::text("set").folded(), Column::text("data"), Column::text("body"), Column::text("path", "from"),
       Column::text("decision"), Column::number("Et_m", "E_t [m]", 4)}};
  table.add_columns(range_columns("Et_low", "Et_high", 4));
  table.columns.push_back(Column::number("change_m", "change [m]", 4));
  table.add_columns(range_columns("change_low", "change_high", 4));
  table.columns.push_back(Column::number("factor", 2));
  std::vector<std::string> records;
  for (const AttributionPath& path : attribution_paths(evidence)) {
    for (size_t k = 0; k < path.steps.size(); ++k) {
      const AttributionStep& step = path.steps[k];
      const bool is_first = k == 0;
      std::vector<Cell> cells = {path.set, path.data, path.body, path.path, step.decision};
      add_estimate(step.Et_m, cells);
      add_estimate(is_first ? std::nullopt : std::optional(step.change_m), cells);
      cells.push_back(is_first ? Cell() : Cell(step.Et_m.value / path.steps[k - 1].Et_m.value));
      table.add_row(std::move(cells));
      records.push_back(records_of_part(step.part));
    }
    std::vector<Cell> cells = {path.set, path.data, path.body, path.path, std::string("all of them")};
    add_estimate(std::nullopt, cells);
    add_estimate(path.whole_m, cells);
    cells.emplace_back(path.steps.back().Et_m.value / path.steps.front().Et_m.value);
    table.add_row(std::move(cells));
    records.push_back(records_of_part(path.steps.back().part));
  }
  add_addresses("decision", records, table);
  if (table.rows.empty()) table.notes.push_back("Not measured here: no part `attribution`.");
  return table;
}

}  // namespace sextant
