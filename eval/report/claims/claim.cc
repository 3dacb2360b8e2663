#include "sextant/eval/report/claims/claim.h"

#include <algorithm>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {

std::vector<Claim> collected_claims();

ClaimResult judged(ClaimResult result, const IntervalEstimate& estimate, const Limits& limits) {
  const auto& [value, interval] = estimate;
  result.value = value;
  result.interval = interval;
  if (!interval) return result;
  const auto [lowest, highest] = std::minmax({value, interval->low, interval->high});
  if (lowest > limits.low && highest < limits.high) result.verdict = Verdict::reproduced;
  if (highest < limits.low || lowest > limits.high) result.verdict = Verdict::not_reproduced;
  return result;
}

Claim paper_claim(int order, const std::string& name, ClaimCheck check) {
  return {paper().statement(name), name, order, std::move(check)};
}

std::span<const Claim> claims() {
  static const std::vector<Claim> all = [] {
    std::vector<Claim> claims = collected_claims();
    std::ranges::stable_sort(claims, {}, &Claim::order);
    return claims;
  }();
  return all;
}

std::vector<CheckedClaim> check_claims(const Evidence& evidence) {
  std::vector<CheckedClaim> checked;
  for (const Claim& claim : claims()) checked.push_back({&claim, claim.check(evidence)});
  return checked;
}

namespace {

struct ClaimRow {
  const Claim* claim;
  const ClaimResult* result;
};

}  // namespace

Table claim_table(const std::vector<CheckedClaim>& checked) {
  std::vector<ClaimRow> rows;
  std::vector<std::string> notes;
  for (const auto& [claim, results] : checked) {
    if (results.empty()) notes.push_back("Not tested here: " + claim->statement + " (" + claim->place + ").");
    for (const ClaimResult& result : results) rows.push_back({claim, &result});
  }
  Column statement = Column::text("statement").folded(), place = Column::text("place").folded();
  statement.names_its_quantity = true;
  const auto number = [](const std::string& key) { return Column::number(key, 3).with_significant(3); };
  Fields<ClaimResult> of_result = {{Column::text("dataset").folded(), &ClaimResult::dataset},
                                   {Column::text("sequence").folded(), &ClaimResult::sequence},
                                   {Column::text("estimator"), &ClaimResult::estimator},
                                   {Column::text("subject"), &ClaimResult::subject},
                                   {Column::text("quantity"), &ClaimResult::quantity},
                                   {number("value"), &ClaimResult::value}};
  Column low = number("low");
  low.range = "95 % interval";
  of_result.add_range({low, number("high")}, &ClaimResult::interval);
  of_result.add({{Column::text("stated"), &ClaimResult::stated},
                 {Column::text("verdict"), [](const ClaimResult& r) { return Cell(to_string(r.verdict)); }},
                 {Column::text("records").folded(), [](const ClaimResult& r) {
                    return r.records.empty() ? Cell() : Cell(records_of_part(r.records));
                  }}});
  Fields<ClaimRow> fields = {
      {Column::text("claim").folded().only_in_files(), [](const ClaimRow& row) { return row.claim->name; }},
      {statement, [](const ClaimRow& row) { return row.claim->statement; }},
      {place, [](const ClaimRow& row) { return row.claim->place; }}};
  fields.add(of_result, &ClaimRow::result);
  Table table = table_of(
      "Statements of the paper",
      fmt::format(
          "95 % intervals: bootstrap over seeds; with one seed over stretches of frames. Reproduced or not: "
          "the whole interval agrees with the statement or contradicts it; \"about 300 %\" counts from {} "
          "% up, \"nearly\" within {} % of the stated value. Objects are numbered by distance, as in the "
          "paper.",
          least_of_about_300_percent, 100 * nearly),
      fields, rows);
  table.notes = std::move(notes);
  return table;
}

std::vector<VerdictLine> claim_verdicts(const std::vector<CheckedClaim>& checked, const std::string& table) {
  std::vector<VerdictLine> lines;
  size_t n_parts = 0;
  for (const auto& [claim, results] : checked) {
    std::vector<std::string> verdicts;
    for (const ClaimResult& result : results) verdicts.push_back(std::string(to_string(result.verdict)));
    const std::string line_to_measure =
        claim->fetch.empty() ? "sextant reproduce --out DIR" : measuring_line(claim->fetch);
    const std::string counts = results.empty()
                                   ? "no records of it; to measure it: " + line_to_measure
                                   : fmt::format("{} ({} results)", count_words(verdicts), results.size());
    lines.push_back({claim->statement + " (" + claim->place + ")", joint_verdict(verdicts), counts,
                     results.empty() ? "" : "#" + part_anchor(table, n_parts++), "Claims"});
  }
  return lines;
}

}  // namespace sextant
