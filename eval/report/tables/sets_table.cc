// Table III: motion_only, joint_flow and joint_flow_depth on the paper's three sets.

#include <array>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_sets.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {
namespace {

constexpr std::array<const char*, 2> quantities = {"Et_m", "ER_deg"};

std::string title_of(const char* error) { return metric(NumberMap::errors, error).heading(); }

/// Column of the paper for an estimator; none for ours.
std::optional<std::string> published_column(const std::string& estimator) {
  if (estimator.starts_with("motion_only")) return "motion_only";
  if (estimator == "joint_flow" || estimator.starts_with("joint_flow,")) return "joint";
  return std::nullopt;
}

struct SetRows {
  const Json& published;  ///< row of the paper
  const SetData& data;
  const EvidencePart& part;
};

/// Rows of one line of the paper on one kind of data; false where that was not measured.
bool add_measured(const SetRows& rows, Table& table) {
  const RecordRefs records = matching(rows.part.records, rows.data.filter);
  const auto groups = by_estimator(records);
  const std::string body = rows.published.at("body");
  for (const std::string& estimator : distinct(records, &Record::estimator)) {
    const auto bodies = paper_bodies(groups.at(estimator));
    const RecordRefs* of_body =
        find_in(bodies, body == "Obj" ? "Obj1" : body);  // "Obj" of the sets that have one object
    const std::optional<std::string> column = published_column(estimator);
    for (const char* error : quantities) {
      PaperRow row{{rows.data.set, body, estimator}, title_of(error)};
      if (column) row.published = published_number(rows.published.at(*column), error);
      if (of_body) row.measured = measure_mean(*of_body, NumberMap::errors, error);
      if (!row.published && !row.measured) continue;  // a system of the camera alone has no objects
      row.data = set_data_title(rows.data.filter);
      row.records = rows.part.name;
      add_published_row(row, table);
    }
  }
  return !records.empty();
}

void add_missing(const Json& published, Table& table) {
  for (const char* estimator : {"motion_only", "joint_flow"}) {
    for (const char* error : quantities) {
      PaperRow row{{published.at("set"), published.at("body"), estimator}, title_of(error)};
      row.published = published_number(published.at(*published_column(estimator)), error);
      add_published_row(row, table);
    }
  }
}

/// Lines of the paper's table by set, in its order.
std::vector<std::pair<std::string, std::vector<Json>>> published_sets(const Json& published) {
  std::vector<std::pair<std::string, std::vector<Json>>> sets;
  for (const Json& line : published.at("rows")) {
    const std::string set = line.at("set");
    if (sets.empty() || sets.back().first != set) sets.push_back({set, {}});
    sets.back().second.push_back(line);
  }
  return sets;
}

}  // namespace

Table sets_table(const Evidence& evidence) {
  Table table = published_table(
      "Table III: motion only and joint optimisation",
      "Preset paper: mean over pairs of E_t and E_R, objects in the camera frame. Noise on exact depth and flow: "
      "delta_d 0.2 px, flow of Table II. Estimators with a name behind the comma follow a procedure "
      "(eval/procedures): release, the published code, under its own noise (delta_d 0.15 px, one draw a frame); "
      "table, which points fit the printed numbers best; text, what the paper says. joint_flow_depth is ours.",
      {Column::text("set").folded(), Column::text("body"), Column::text("estimator")}, 4);
  for (const auto& [set, lines] : published_sets(evidence.published.at("tab:mot_all"))) {
    bool measured = false;
    for (const PartRole role : {PartRole::sets, PartRole::sets_paper}) {
      for (const EvidencePart* part : evidence.with(role)) {
        for (const SetData& data : set_data()) {
          if (data.set != set) continue;
          for (const Json& line : lines) measured |= add_measured({line, data, *part}, table);
        }
      }
    }
    if (!measured) {
      for (const Json& line : lines) add_missing(line, table);
    }
  }
  return table;
}

}  // namespace sextant
