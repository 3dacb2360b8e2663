// Table III: the paper's three sets for "motion only", "joint" and our estimator.

#include <array>

#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {
namespace {

constexpr std::array<const char*, 2> set_errors = {"Et_m", "ER_deg"};

PaperRow row_of(const Json& line, const std::string& estimator, const char* error) {
  PaperRow row{.group = line.at("set"), .body = line.at("body"), .estimator = estimator};
  row.quantity = metric(NumberMap::errors, error).heading();
  if (const auto column = paper().column_of(estimator))
    row.published = published_number(line.at(*column), error);
  return row;
}

/// Adds the rows of one line of the paper for one kind of data; returns false if it was not measured.
bool add_measured(const Json& line, const SetData& data, const EvidencePart& part, PublishedTable& table) {
  const RecordRefs records = matching(part.records, data.filter);
  const auto groups = by_estimator(records);
  const std::string body = paper_body(line.at("body"));
  for (const std::string& estimator : distinct(records, &Record::estimator)) {
    const auto bodies = paper_bodies(groups.at(estimator));
    const RecordRefs* of_body = find_in(bodies, body);
    for (const char* error : set_errors) {
      PaperRow row = row_of(line, estimator, error);
      if (of_body) row.measured = measure_mean(*of_body, NumberMap::errors, error);
      if (!row.published && !row.measured)
        continue;  // a system that estimates only the camera has no objects
      row.data = data_title(data.filter);
      row.dataset = data.filter.dataset;
      row.records = part.name;
      table.rows.push_back(std::move(row));
    }
  }
  return !records.empty();
}

/// Lines of the paper's table by set, in order.
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

PublishedTable sets_table(const Evidence& evidence) {
  PublishedTable table{.number = "III",
                       .labels = {{Column::text("set").folded(), &PaperRow::group},
                                  {Column::text("body"), &PaperRow::body},
                                  {Column::text("estimator"), &PaperRow::estimator}},
                       .decimals = 4};
  for (const auto& [set, lines] : published_sets(evidence.published.at("tab:mot_all"))) {
    bool measured = false;
    for (const PartRole role : {PartRole::sets, PartRole::sets_paper}) {
      for (const EvidencePart* part : evidence.with(role)) {
        for (const SetData& data : paper().sets) {
          if (data.set != set) continue;
          for (const Json& line : lines) measured |= add_measured(line, data, *part, table);
        }
      }
    }
    if (measured) continue;
    for (const Json& line : lines) {
      for (const std::string& estimator : {paper().baseline, paper().method}) {
        for (const char* error : set_errors) table.rows.push_back(row_of(line, estimator, error));
      }
    }
  }
  return table;
}

}  // namespace sextant
