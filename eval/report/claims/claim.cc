#include "sextant/eval/report/claims/claim.h"

#include "sextant/eval/report/fetch_lines.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {

void ClaimResult::set(const IntervalEstimate& estimate) {
  value = estimate.value;
  interval = estimate.interval;
}

Verdict is_below(double limit, double value, const std::optional<Interval>& interval) {
  if (!interval) return Verdict::undecided;
  if (value < limit && interval->high < limit) return Verdict::reproduced;
  if (value > limit && interval->low > limit) return Verdict::not_reproduced;
  return Verdict::undecided;
}

Verdict is_above(double limit, double value, const std::optional<Interval>& interval) {
  const std::optional<Interval> mirrored =
      interval ? std::optional(Interval{-interval->high, -interval->low}) : std::nullopt;
  return is_below(-limit, -value, mirrored);
}

Verdict is_between(double low, double high, double value, const std::optional<Interval>& interval) {
  const Verdict above = is_above(low, value, interval);
  const Verdict below = is_below(high, value, interval);
  if (above == Verdict::not_reproduced || below == Verdict::not_reproduced) return Verdict::not_reproduced;
  return above == below ? above : Verdict::undecided;
}

std::vector<CheckedClaim> check_claims(const Evidence& evidence) {
  std::vector<CheckedClaim> checked;
  for (const Claim& claim : claims()) checked.push_back({&claim, claim.check(evidence)});
  return checked;
}

std::vector<CheckedClaim> check_claims(const std::vector<NoiseSweep>& sweeps) {
  Evidence evidence;
  for (const NoiseSweep& sweep : sweeps) evidence.parts.push_back({"", PartRole::noise, sweep, {}});
  return check_claims(evidence);
}

Table claim_table(const std::vector<CheckedClaim>& checked) {
  Table table{
      "Statements of the paper",
      "95 % intervals: bootstrap over seeds; with one seed over stretches of frames. Reproduced or not: the "
      "whole interval agrees with the statement or contradicts it. Objects are numbered by distance, as in "
      "the paper.",
      {Column::text("claim").folded().only_in_files(),
       {.key = "statement", .title = "statement", .align = Align::left, .fold = true, .says_itself = true},
       Column::text("place").folded(),
       Column::text("dataset").folded(),
       Column::text("sequence").folded(),
       Column::text("estimator"),
       Column::text("subject"),
       Column::text("quantity"),
       {.key = "value", .title = "value", .significant = 3},
       {.key = "low", .title = "low", .range = "95 % interval", .significant = 3},
       {.key = "high", .title = "high", .significant = 3},
       Column::text("stated"),
       Column::text("verdict"),
       Column::text("records").folded()}};
  for (const auto& [claim, results] : checked) {
    if (results.empty())
      table.notes.push_back("Not tested here: " + claim->statement + " (" + claim->place + ").");
    for (const ClaimResult& r : results) {
      std::vector<Cell> cells = {claim->name, claim->statement, claim->place, r.dataset, r.sequence,
                                 r.estimator, r.subject,        r.quantity,   r.value};
      add_interval(r.interval, cells);
      cells.emplace_back(r.stated);
      cells.emplace_back(std::string(to_string(r.verdict)));
      cells.push_back(r.records.empty() ? Cell() : Cell(fmt::format("parts/{}/records.jsonl", r.records)));
      table.add_row(std::move(cells));
    }
  }
  return table;
}

std::vector<VerdictLine> claim_verdicts(const std::vector<CheckedClaim>& checked, const std::string& link) {
  std::vector<VerdictLine> lines;
  for (const auto& [claim, results] : checked) {
    std::vector<std::string> verdicts;
    for (const ClaimResult& result : results) verdicts.push_back(std::string(to_string(result.verdict)));
    const std::string line_to_measure = claim->fetch.empty() ? "sextant reproduce --out DIR" : measuring_line(claim->fetch);
    const std::string counts = results.empty() ? "no records of it; to measure it: " + line_to_measure
                                               : fmt::format("{} ({} results)", count_words(verdicts), results.size());
    VerdictLine line{claim->statement + " (" + claim->place + ")", joint_verdict(verdicts), counts,
                     results.empty() ? "" : link, "Claims"};
    line.cases = claim_table({{claim, results}});
    for (const char* said : {"statement", "place"}) {  // by the line itself
      line.cases.columns[line.cases.place(said)].detail = true;
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace sextant
