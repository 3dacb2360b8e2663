// Which decision makes the difference between the published code and ours.

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/attribution.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {
namespace {

void add_range_columns(const std::string& key, Table& table) {
  table.columns.push_back({key + "_low", "low", Align::right, 4});
  table.columns.back().range = "95 % interval";
  table.columns.push_back({key + "_high", "high", Align::right, 4});
}

}  // namespace

Table attribution_table(const Evidence& evidence) {
  Table table;
  table.title = "Table VIII (ours): from the published code to ours, one decision at a time";
  table.caption =
      "Mean E_t over the pairs that every step estimates, objects in the camera frame. A row makes one "
      "decision "
      "as we do and keeps those above it; its change is what that decision does, and changes add up. The "
      "first row of a path is the "
      "published code's function (motion_only, or joint_flow) on its points: RANSAC inliers at 0.3 px, for "
      "joint and "
      "the camera all static matches. The last row is our default.";
  table.columns = {{"set", "set", Align::left, 0, true},  {"data", "data", Align::left},
                   {"body", "body", Align::left},         {"path", "from", Align::left},
                   {"decision", "decision", Align::left}, {"Et_m", "E_t [m]", Align::right, 4}};
  add_range_columns("Et", table);
  table.columns.push_back({"change_m", "change [m]", Align::right, 4});
  add_range_columns("change", table);
  table.columns.push_back({"factor", "factor", Align::right, 2});
  for (const AttributionPath& path : attribution_paths(evidence)) {
    for (size_t k = 0; k < path.steps.size(); ++k) {
      const AttributionStep& step = path.steps[k];
      std::vector<Cell> cells = {path.set, path.data, path.body, path.path, step.decision, step.Et_m};
      add_interval(step.Et_interval, cells);
      cells.push_back(k > 0 ? Cell(step.change_m) : Cell());
      add_interval(step.change_interval, cells);
      cells.push_back(k > 0 ? Cell(step.Et_m / path.steps[k - 1].Et_m) : Cell());
      table.add_row(std::move(cells));
    }
    std::vector<Cell> cells = {path.set, path.data, path.body, path.path, std::string("all of them"), Cell()};
    add_interval(std::nullopt, cells);
    cells.emplace_back(path.whole_m);
    add_interval(path.whole_interval, cells);
    cells.emplace_back(path.steps.back().Et_m / path.steps.front().Et_m);
    table.add_row(std::move(cells));
  }
  if (table.rows.empty()) table.notes.push_back("Not measured here: no part `attribution`.");
  return table;
}

}  // namespace sextant
