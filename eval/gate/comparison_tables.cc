#include <algorithm>
#include <cmath>

#include "sextant/eval/gate/comparison.h"

namespace sextant {
namespace {

template <typename Row>
int count(const std::vector<Row>& rows, GateVerdict verdict) {
  return static_cast<int>(std::ranges::count(rows, verdict, &Row::verdict));
}

/// `value` in percent of `base`; empty if `base` is 0.
std::optional<double> percent_of(const std::optional<double>& value, double base) {
  return value && base > 0 ? std::optional(100 * *value / base) : std::nullopt;
}

std::optional<double> percent(const std::optional<double>& share) { return percent_of(share, 1); }

/// An interval in percent of `base`; empty if `base` is 0.
std::optional<Interval> percent_of(const std::optional<Interval>& interval, double base) {
  if (!interval || !(base > 0)) return std::nullopt;
  return Interval{100 * interval->low / base, 100 * interval->high / base};
}

/// Adds the ends of an interval as two columns.
template <typename Row, typename Find>
void add_percent_range(int decimals, const Find& find, Fields<Row>& fields) {
  fields.add_range(
      {Column::number("low_percent", "low", decimals), Column::number("high_percent", "high", decimals)},
      find);
}

void add_part(std::string& line, int n, const std::string& text) {
  if (n > 0) line += fmt::format("{}{} {}", line.empty() ? "" : ", ", n, text);
}

}  // namespace

std::string largest_change(const Comparison& c) {
  const auto text = [](const std::string& what, double change, const std::optional<Interval>& interval) {
    return fmt::format("{}: {:+.1f} %{}", what, 100 * change,
                       interval
                           ? fmt::format(" [{:+.1f}, {:+.1f}]", 100 * interval->low, 100 * interval->high)
                           : " (no interval: one seed)");
  };
  const FamilyRow* first = nullptr;
  for (const FamilyRow& row : c.families) {
    if (!row.is_changed()) continue;
    const bool is_larger =
        first == nullptr || (row.verdict == GateVerdict::ok && first->verdict == row.verdict &&
                             std::abs(row.worse) > std::abs(first->worse));
    if (is_larger) first = &row;
  }
  if (first != nullptr) {
    return text(fmt::format("{} {} of {}", first->body, first->metric, first->estimator), first->change,
                first->interval) +
           fmt::format(", {} of {} cases worse, {} seeds, {} sources: {}{}", first->n_worse, first->n,
                       first->n_seeds, first->n_sources, to_string(first->verdict),
                       first->too_few ? " (few seeds or cases)" : "");
  }
  const AccuracyRow* row = nullptr;
  const auto change_of = [](const AccuracyRow& r) { return r.base > 0 ? r.difference / r.base : 0; };
  for (const AccuracyRow& r : c.accuracy) {
    if (!r.is_changed()) continue;
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
           "findings that make the comparison invalid");
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
  return fmt::format(
      "{}: {}{}", to_string(c.verdict),
      parts.empty() ? largest_change(c).empty() ? "nothing changed" : "no change that counts" : parts,
      scope.empty() ? "" : fmt::format(" ({} compared)", scope));
}

Fields<Subject> subject_fields() {
  return {{Column::text("dataset").folded(), &Subject::dataset},
          {Column::text("sequence").folded(), &Subject::sequence},
          {Column::text("estimator").folded(), &Subject::estimator},
          {Column::text("noise").folded().only_in_files(), &Subject::noise},
          {Column::number("level", 3).folded(), &Subject::level},
          {Column::text("body"), &Subject::body}};
}

Table findings_table(const Comparison& c) {
  std::vector<const Mismatch*> sorted;
  for (const Mismatch& f : c.findings) sorted.push_back(&f);
  std::stable_partition(sorted.begin(), sorted.end(), [](const Mismatch* f) { return f->invalidates; });
  const Fields<Mismatch> fields = {
      {Column::text("verdict", ""), [](const Mismatch& f) { return f.invalidates ? "invalid" : "note"; }},
      {Column::text("what"), &Mismatch::what},
      {Column::text("subject", "where"), &Mismatch::subject},
      {Column::text("base", "BASE"), &Mismatch::base},
      {Column::text("new", "NEW"), &Mismatch::fresh}};
  return table_of("Differences besides the numbers", "", fields, sorted);
}

Table family_table(const Comparison& c, bool changed_only) {
  using Row = FamilyRow;
  std::vector<const Row*> rows;
  for (const Row& row : c.families) {
    if (!changed_only || row.is_changed()) rows.push_back(&row);
  }
  Fields<Row> fields = {
      {Column::text("estimator").folded(), &Row::estimator},
      {Column::text("body", "of"), &Row::body},
      {Column::text("metric", "error"), &Row::metric},
      {Column::number("change_percent", "change [%]", 2), [](const Row& row) { return 100 * row.change; }}};
  add_percent_range(
      2, [](const Row& row) { return percent_of(row.interval, 1); }, fields);
  fields.add({{Column::text("verdict"), &Row::word},
              {Column::count("n", "cases"), &Row::n},
              {Column::count("n_worse", "worse"), &Row::n_worse},
              {Column::count("n_better", "better"), &Row::n_better},
              {Column::count("n_seeds", "seeds"), &Row::n_seeds},
              {Column::count("n_sources", "sources").only_in_files(), &Row::n_sources},
              {Column::p_value("p").only_in_files(), &Row::p},
              {Column::p_value("p_corrected"), &Row::p_corrected},
              {Column::number("detectable_percent", "detectable [%]", 2),
               [](const Row& row) { return percent(row.detectable); }}});
  return table_of("Errors, pooled over sources and bodies",
                  "Change of the mean from BASE to NEW with 95 % interval over seeds; p corrected by Holm; "
                  "detectable: change that would be detected with probability 80 %.",
                  fields, rows);
}

Table accuracy_table(const Comparison& c, bool changed_only) {
  using Row = AccuracyRow;
  Fields<Row> fields;
  fields.add(subject_fields(), [](const Row& row) { return &row.subject; });
  fields.add({{Column::text("metric", "error"), &Row::metric},
              {Column::count("n", "cases"), &Row::n},
              {Column::count("n_worse", "worse"), &Row::n_worse},
              {Column::count("n_better", "better"), &Row::n_better},
              {Column::number("base", "BASE", 6), &Row::base},
              {Column::number("difference", 6).only_in_files(), &Row::difference},
              {Column::number("difference_percent", "change [%]", 2),
               [](const Row& row) { return percent_of(row.difference, row.base); }}});
  add_percent_range(
      2, [](const Row& row) { return percent_of(row.interval, row.base); }, fields);
  fields.add({{Column::p_value("p").only_in_files(), &Row::p},
              {Column::p_value("p_corrected"), &Row::p_corrected},
              {Column::number("detectable_percent", "detectable [%]", 2),
               [](const Row& row) { return percent_of(row.detectable, row.base); }},
              {Column::text("verdict"), &Row::word}});
  return table_of(
      "Errors, case by case",
      "Change of the mean from BASE to NEW over the cases that both have estimated, 95 % "
      "interval, p corrected by Holm; detectable: change that would be detected with probability 80 %.",
      fields, by_weight(c.accuracy, changed_only));
}

Table status_table(const Comparison& c) {
  using Row = StatusRow;
  Fields<Row> fields;
  fields.add(subject_fields(), [](const Row& row) { return &row.subject; });
  fields.add({{Column::count("n", "cases"), &Row::n},
              {Column::count("n_lost", "lost"), &Row::n_lost},
              {Column::count("n_gained", "gained"), &Row::n_gained},
              {Column::count("n_other", "other"), &Row::n_other},
              {Column::text("example"), &Row::example},
              {Column::text("verdict"), [](const Row& row) { return to_string(row.verdict); }}});
  return table_of("Cases lost and gained",
                  "Lost: estimated in BASE, not in NEW. Gained: estimated in NEW, not in BASE.", fields,
                  by_weight(c.statuses, false));
}

Table speed_table(const Comparison& c, bool changed_only) {
  using Row = SpeedRow;
  const auto change = [](std::optional<double> ratio) { return ratio ? Cell(100 * (*ratio - 1)) : Cell(); };
  Fields<Row> fields = {
      {Column::text("name", "time"), &Row::name},
      {Column::count("n_base", "n BASE"), &Row::n_base},
      {Column::count("n_new", "n NEW"), &Row::n_new},
      {Column::number("base_us", "BASE [us]", 2), [](const Row& row) { return row.base_ns / 1e3; }},
      {Column::number("change_percent", "change [%]", 1), [=](const Row& row) { return change(row.ratio); }}};
  add_percent_range(
      1,
      [](const Row& row) {
        return row.interval
                   ? std::optional(Interval{100 * (row.interval->low - 1), 100 * (row.interval->high - 1)})
                   : std::nullopt;
      },
      fields);
  fields.add({{Column::p_value("p"), &Row::p},
              {Column::number("cliffs_delta", "delta", 2), &Row::cliffs_delta},
              {Column::number("detectable_percent", "detectable [%]", 1),
               [=](const Row& row) { return change(row.detectable); }},
              {Column::text("verdict"), [](const Row& row) { return to_string(row.verdict); }}});
  const std::vector<const Row*> rows = by_weight(c.speed, changed_only);
  Table table = table_of(
      "Times",
      "Change of NEW against BASE by Hodges-Lehmann with 95 % interval, p by "
      "Mann-Whitney, delta: Cliff's; detectable: change that would be detected with probability 80 %.",
      fields, rows);
  if (std::ranges::any_of(rows, [](const Row* row) { return !row->interval; })) {
    table.notes.emplace_back(
        "Without an interval there are too few repetitions for a test (4 on each side): only large changes "
        "are seen (unrepeated_effect). scripts/bench_pair makes repetitions.");
  }
  return table;
}

}  // namespace sextant
