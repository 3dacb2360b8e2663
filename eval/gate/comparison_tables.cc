#include <algorithm>

#include "sextant/eval/gate/comparison.h"

namespace sextant {
namespace {

template <typename Row>
int count(const std::vector<Row>& rows, GateVerdict verdict) {
  return static_cast<int>(std::ranges::count(rows, verdict, &Row::verdict));
}

Cell percent_of(const std::optional<double>& value, double base) {
  return value && base > 0 ? Cell(100 * *value / base) : Cell();
}

Table subject_table(const std::string& title, const std::string& caption) {
  Table table{title, caption, folded_columns({"dataset", "sequence", "estimator"})};
  table.add_columns({Column::text("noise").folded().only_in_files(), Column::number("level", 3).folded(),
                     Column::text("body")});
  return table;
}

/// The subject's cells, then these.
void add_row(const Subject& s, std::vector<Cell> more, Table& table) {
  std::vector<Cell> cells = {s.dataset.str(), s.sequence.str(), s.estimator.str(), s.noise.str(), s.level, s.body.str()};
  std::ranges::move(more, std::back_inserter(cells));
  table.add_row(std::move(cells));
}

void add_part(std::string& line, int n, const std::string& text) {
  if (n > 0) line += fmt::format("{}{} {}", line.empty() ? "" : ", ", n, text);
}

}  // namespace

std::string headline(const Comparison& c) {
  std::string parts;
  add_part(parts, static_cast<int>(std::ranges::count(c.findings, true, &Mismatch::invalidates)),
           "findings that forbid a comparison");
  for (const GateVerdict verdict :
       {GateVerdict::regressed, GateVerdict::inconclusive, GateVerdict::improved}) {
    const std::string word(to_string(verdict));
    add_part(parts, count(c.accuracy, verdict), "errors " + word);
    add_part(parts, count(c.statuses, verdict), "coverages " + word);
    add_part(parts, count(c.speed, verdict), "times " + word);
  }
  std::string scope;
  if (!c.accuracy.empty()) scope = fmt::format("{} errors over {} cases", c.accuracy.size(), c.n_cases);
  if (!c.speed.empty()) scope += fmt::format("{}{} times", scope.empty() ? "" : ", ", c.speed.size());
  return fmt::format("{}: {}{}", to_string(c.verdict), parts.empty() ? "nothing changed" : parts,
                     scope.empty() ? "" : fmt::format(" ({} compared)", scope));
}

Table findings_table(const Comparison& c) {
  Table table{"What differs besides the numbers",
              "",
              {Column::text("verdict", ""), Column::text("what"), Column::text("subject", "where"),
               Column::text("base", "BASE"), Column::text("new", "NEW")}};
  std::vector<const Mismatch*> sorted;
  for (const Mismatch& f : c.findings) sorted.push_back(&f);
  std::stable_partition(sorted.begin(), sorted.end(), [](const Mismatch* f) { return f->invalidates; });
  for (const Mismatch* f : sorted)
    table.add_row({f->invalidates ? "invalid" : "note", f->what, f->subject, f->base, f->fresh});
  return table;
}

Table accuracy_table(const Comparison& c, bool changed_only) {
  Table table = subject_table(
      "Errors, case by case",
      "Mean of NEW - BASE over the cases that both have estimated, 95 % interval, p by Wilcoxon's signed ranks "
      "corrected by Holm; detectable: found at 5 % with probability 80 %.");
  table.add_columns({Column::text("metric", "error"), Column::count("n", "cases"),
                     Column::count("n_worse", "worse"), Column::count("n_better", "better"),
                     Column::number("base", "BASE", 6), Column::number("difference", 6).only_in_files(),
                     Column::number("difference_percent", "change [%]", 2),
                     Column::number("low_percent", "low", 2), Column::number("high_percent", "high", 2),
                     Column::p_value("p").only_in_files(), Column::p_value("p_corrected"),
                     Column::number("detectable_percent", "detectable [%]", 2), Column::text("verdict")});
  for (const AccuracyRow* row : by_weight(c.accuracy, changed_only)) {
    const auto end = [&](double Interval::*which) {
      return row->interval ? std::optional<double>((*row->interval).*which) : std::nullopt;
    };
    add_row(row->subject,
            {row->metric, row->n, row->n_worse, row->n_better, row->base, row->difference,
             percent_of(row->difference, row->base), percent_of(end(&Interval::low), row->base),
             percent_of(end(&Interval::high), row->base), row->p, row->p_corrected,
             percent_of(row->detectable, row->base), std::string(to_string(row->verdict))},
            table);
  }
  return table;
}

Table status_table(const Comparison& c) {
  Table table = subject_table("Cases lost and gained",
                              "Lost: estimated in BASE, not in NEW. Gained: the other way round.");
  table.add_columns({Column::count("n", "cases"), Column::count("n_lost", "lost"),
                     Column::count("n_gained", "gained"), Column::count("n_other", "other"),
                     Column::text("example"), Column::text("verdict")});
  for (const StatusRow* row : by_weight(c.statuses, false)) {
    add_row(row->subject,
            {row->n, row->n_lost, row->n_gained, row->n_other, row->example,
             std::string(to_string(row->verdict))},
            table);
  }
  return table;
}

Table speed_table(const Comparison& c, bool changed_only) {
  Table table{
      "Times",
      "Change of NEW against BASE by Hodges-Lehmann with 95 % interval, p by Mann-Whitney, delta: Cliff's; "
      "detectable: found with probability 80 %.",
      {Column::text("name", "time"), Column::count("n_base", "n BASE"), Column::count("n_new", "n NEW"),
       Column::number("base_us", "BASE [us]", 2), Column::number("change_percent", "change [%]", 1),
       Column::number("low_percent", "low", 1), Column::number("high_percent", "high", 1),
       Column::p_value("p"), Column::number("cliffs_delta", "delta", 2),
       Column::number("detectable_percent", "detectable [%]", 1), Column::text("verdict")}};
  const auto change = [](std::optional<double> ratio) { return ratio ? Cell(100 * (*ratio - 1)) : Cell(); };
  bool unrepeated = false;
  for (const SpeedRow* row : by_weight(c.speed, changed_only)) {
    unrepeated = unrepeated || !row->interval;
    table.add_row({row->name, row->n_base, row->n_new, row->base_ns / 1e3, change(row->ratio),
                   row->interval ? change(row->interval->low) : Cell(),
                   row->interval ? change(row->interval->high) : Cell(), row->p, row->cliffs_delta,
                   change(row->detectable), std::string(to_string(row->verdict))});
  }
  if (unrepeated) {
    table.notes.emplace_back(
        "Without an interval there are too few repetitions for a test (4 on each side): only large changes "
        "are seen (unrepeated_effect). scripts/bench_pair makes repetitions.");
  }
  return table;
}

}  // namespace sextant
