#include <algorithm>
#include <cmath>

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

std::string largest_change(const Comparison& c) {
  const auto text = [](const std::string& what, double change, const std::optional<Interval>& interval) {
    return fmt::format("{}: {:+.1f} %{}", what, 100 * change,
                       interval ? fmt::format(" [{:+.1f}, {:+.1f}]", 100 * interval->low, 100 * interval->high)
                                : " (no interval: one seed)");
  };
  const FamilyRow* first = nullptr;
  for (const FamilyRow& row : c.families) {
    if (row.n_worse + row.n_better == 0) continue;
    const bool is_larger = first == nullptr || (row.verdict == GateVerdict::ok && first->verdict == row.verdict &&
                                                std::abs(row.worse) > std::abs(first->worse));
    if (is_larger) first = &row;
  }
  if (first != nullptr) {
    return text(fmt::format("{} {} of {}", first->body, first->metric, first->estimator), first->change,
                first->interval) +
           fmt::format(", {} of {} cases worse, {} seeds, {} sources: {}{}", first->n_worse, first->n, first->n_seeds,
                       first->n_sources, to_string(first->verdict), first->too_few ? " (few seeds or cases)" : "");
  }
  const AccuracyRow* row = nullptr;
  const auto change_of = [](const AccuracyRow& r) { return r.base > 0 ? r.difference / r.base : 0; };
  for (const AccuracyRow& r : c.accuracy) {
    if (r.n_worse + r.n_better == 0) continue;
    if (row == nullptr || r.verdict < row->verdict ||
        (r.verdict == row->verdict && std::abs(change_of(r)) > std::abs(change_of(*row))))
      row = &r;
  }
  if (row == nullptr) return "";
  std::optional<Interval> interval = row->interval;
  if (interval && row->base > 0) interval = Interval{interval->low / row->base, interval->high / row->base};
  return text(fmt::format("{} {}", to_string(row->subject), row->metric), change_of(*row), interval) +
         fmt::format(", {} of {} cases worse: {}", row->n_worse, row->n, row->word());
}

std::string headline(const Comparison& c) {
  std::string parts;
  add_part(parts, static_cast<int>(std::ranges::count(c.findings, true, &Mismatch::invalidates)),
           "findings that forbid a comparison");
  for (const GateVerdict verdict :
       {GateVerdict::regressed, GateVerdict::inconclusive, GateVerdict::improved}) {
    const std::string word(to_string(verdict));
    add_part(parts, count(c.families, verdict), "pooled errors " + word);
    add_part(parts, count(c.accuracy, verdict), "errors " + word);
    add_part(parts, count(c.statuses, verdict), "coverages " + word);
    add_part(parts, count(c.speed, verdict), "times " + word);
  }
  std::string scope;
  if (!c.accuracy.empty()) scope = fmt::format("{} errors over {} cases", c.accuracy.size(), c.n_cases);
  if (!c.speed.empty()) scope += fmt::format("{}{} times", scope.empty() ? "" : ", ", c.speed.size());
  return fmt::format("{}: {}{}", to_string(c.verdict), parts.empty() ? largest_change(c).empty() ? "nothing changed" : "no change that counts" : parts,
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

Table family_table(const Comparison& c, bool changed_only) {
  Table table{"Errors, pooled over sources and bodies",
              "Change of the mean from BASE to NEW with 95 % interval, by seeds; p corrected by Holm; detectable: found with "
              "probability 80 %.",
              {Column::text("estimator").folded(), Column::text("body", "of"), Column::text("metric", "error"),
               Column::number("change_percent", "change [%]", 2), Column::number("low_percent", "low", 2),
               Column::number("high_percent", "high", 2), Column::text("verdict"), Column::count("n", "cases"),
               Column::count("n_worse", "worse"), Column::count("n_better", "better"), Column::count("n_seeds", "seeds"),
               Column::count("n_sources", "sources").only_in_files(), Column::p_value("p").only_in_files(),
               Column::p_value("p_corrected"), Column::number("detectable_percent", "detectable [%]", 2)}};
  const auto percent = [](std::optional<double> share) { return share ? Cell(100 * *share) : Cell(); };
  for (const FamilyRow& row : c.families) {
    if (changed_only && row.n_worse + row.n_better == 0) continue;
    const auto end = [&](double Interval::*which) {
      return row.interval ? std::optional<double>((*row.interval).*which) : std::nullopt;
    };
    table.add_row({row.estimator, row.body, row.metric, 100 * row.change, percent(end(&Interval::low)),
                   percent(end(&Interval::high)),
                   row.too_few && row.verdict == GateVerdict::ok ? "too few to judge" : std::string(to_string(row.verdict)),
                   row.n, row.n_worse, row.n_better, row.n_seeds, row.n_sources, row.p, row.p_corrected,
                   percent(row.detectable)});
  }
  return table;
}

Table accuracy_table(const Comparison& c, bool changed_only) {
  Table table = subject_table(
      "Errors, case by case",
      "Change of the mean from BASE to NEW over the cases that both have estimated, 95 % interval, p corrected by Holm; "
      "detectable: found with probability 80 %.");
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
             percent_of(row->detectable, row->base), row->word()},
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
