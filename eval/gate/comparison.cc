#include "sextant/eval/gate/comparison.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <map>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/report/record_places.h"

namespace sextant {

namespace {

/// Reports repetitions with another number of records than the first one; only the first repetition is
/// judged.
void check_repetitions(const Side& side, const Policy& policy, std::vector<Mismatch>& findings) {
  for (const RunFolder& run : side.runs) {
    const size_t n = side.runs.front().n_cases;
    if (run.n_cases == n) continue;
    findings.push_back(mismatch(policy.same.cases, "cases", run.path + ": repetition",
                                fmt::format("{} records in the first", n),
                                fmt::format("{} here", run.n_cases)));
  }
  if (!policy.accuracy.judge || side.runs.size() < 2) return;
  findings.push_back(
      mismatch(Strictness::note, "repetitions",
               fmt::format("{}: errors and statuses are judged in {} only, the first of {} runs", side.path,
                           fs::path(side.runs.front().path).filename().string(), side.runs.size()),
               "", ""));
}

void compare_records(const Side& base, const Side& fresh, const Policy& policy, int jobs, Comparison& out) {
  if (base.runs.empty() != fresh.runs.empty()) {
    const auto state = [](const Side& side) { return side.runs.empty() ? "missing" : "there"; };
    out.findings.push_back(mismatch(Strictness::must, "cases", "records.jsonl", state(base), state(fresh)));
  }
  if (base.runs.empty() || fresh.runs.empty()) return;
  check_repetitions(base, policy, out.findings);
  check_repetitions(fresh, policy, out.findings);
  compare_accuracy(base.runs.front().subjects, fresh.runs.front().subjects, policy, jobs, out);
}

}  // namespace

Comparison compare_paths(const std::filesystem::path& base, const std::filesystem::path& fresh,
                         const Policy& policy, int jobs) {
  Comparison out;
  out.base = base.string();
  out.fresh = fresh.string();
  try {
    // Both sides are read at the same time, because reading takes most of the time.
    std::future<Side> reading =
        std::async(jobs > 1 ? std::launch::async : std::launch::deferred, [&] { return read_side(base); });
    const Side second = read_side(fresh), first = reading.get();
    out.findings = compare_provenance(first, second, policy);
    compare_records(first, second, policy, jobs, out);
    if (policy.speed.judge) {
      out.speed = compare_speed(first, second, policy, out.findings);
      if (out.speed.empty() && !first.runs.empty() && !second.runs.empty()) {
        const auto state = [](const Side& side) { return side.runs.front().has_times ? "there" : "missing"; };
        out.findings.push_back(
            mismatch(Strictness::note, "times", "times are not judged", state(first), state(second)));
      }
    }
    if (out.accuracy.empty() && out.speed.empty()) {
      out.findings.push_back(
          mismatch(Strictness::must, "cases", "everything", "nothing to compare", "nothing to compare"));
    }
  } catch (const Error& error) {
    out.findings.insert(out.findings.begin(), mismatch(Strictness::must, "input", error.what(), "", ""));
  }
  out.verdict = out.worst_verdict();
  for (const SpeedRow& row : out.speed) out.verdict = std::min(out.verdict, row.verdict);
  return out;
}

namespace {

template <typename Row>
int count(const std::vector<Row>& rows, GateVerdict verdict) {
  return static_cast<int>(std::ranges::count(rows, verdict, &Row::verdict));
}

/// Returns `value` in percent of `base`; nullopt if there is no value or `base` is 0.
std::optional<double> percent_of(const std::optional<double>& value, double base) {
  return value && base > 0 ? std::optional(100 * *value / base) : std::nullopt;
}

/// Returns an interval in percent of `base`; nullopt if there is no interval or `base` is 0.
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

/// Columns that identify the subject of a row.
Fields<Subject> subject_fields() {
  return {{Column::text("dataset").folded(), &Subject::dataset},
          {Column::text("sequence").folded(), &Subject::sequence},
          {Column::text("estimator").folded(), &Subject::estimator},
          {Column::text("noise").folded().only_in_files(), &Subject::noise},
          {Column::number("level", 3).folded(), &Subject::level},
          {Column::text("body"), &Subject::body}};
}

/// Returns the rows with the worst verdict first, and rows of equal verdict in the given order.
/// `changed_only` leaves out rows whose verdict is ok, unless too_few is set.
template <typename Row>
std::vector<const Row*> by_weight(const std::vector<Row>& rows, bool changed_only) {
  std::vector<const Row*> sorted;
  for (const Row& row : rows) {
    bool is_shown = !changed_only || row.verdict != GateVerdict::ok;
    if constexpr (requires { row.too_few; }) is_shown = is_shown || row.too_few;
    if (is_shown) sorted.push_back(&row);
  }
  std::ranges::stable_sort(sorted, {}, [](const Row* row) { return row->verdict; });
  return sorted;
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
                           : " (no interval)");
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
           fmt::format(", {} of {} records worse, {} seeds, {} sources: {}{}", first->n_worse, first->n,
                       first->n_seeds, first->n_sources, to_string(first->verdict),
                       first->too_few ? " (few seeds or records)" : "");
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
         fmt::format(", {} of {} records worse: {}", row->n_worse, row->n, row->word());
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
    add_part(parts, count(c.statuses, verdict), "coverages or decisions " + word);
    add_part(parts, count(c.speed, verdict), "times " + word);
  }
  std::string scope;
  if (!c.accuracy.empty()) scope = fmt::format("{} errors over {} records", c.accuracy.size(), c.n_cases);
  if (!c.speed.empty()) scope += fmt::format("{}{} times", scope.empty() ? "" : ", ", c.speed.size());
  const auto is_changed = [](const SpeedRow& row) {
    return std::abs(std::log(row.ratio)) > std::log1p(SpeedPolicy{}.minimum_effect);
  };
  const bool nothing =
      largest_change(c).empty() && c.statuses.empty() && std::ranges::none_of(c.speed, is_changed);
  if (parts.empty()) parts = nothing ? "nothing changed" : "no change that counts";
  return fmt::format("{}: {}{}", to_string(c.verdict), parts,
                     scope.empty() ? "" : fmt::format(" ({} compared)", scope));
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
              {Column::count("n", "records"), &Row::n},
              {Column::count("n_worse", "worse"), &Row::n_worse},
              {Column::count("n_better", "better"), &Row::n_better},
              {Column::count("n_seeds", "seeds"), &Row::n_seeds},
              {Column::count("n_sources", "sources").only_in_files(), &Row::n_sources},
              {Column::p_value("p").only_in_files(), &Row::p},
              {Column::p_value("p_corrected"), &Row::p_corrected},
              {Column::number("detectable_percent", "detectable [%]", 2),
               [](const Row& row) { return percent_of(row.detectable, 1); }}});
  return table_of(
      "Errors, pooled over sources and bodies",
      "Change of the mean from BASE to NEW with 95 % interval over seeds and frames; p corrected by Holm (a "
      "verdict without p: no record contradicts the change); detectable: increase that would be proven with "
      "probability 80 %.",
      fields, rows);
}

Table accuracy_table(const Comparison& c, bool changed_only) {
  using Row = AccuracyRow;
  Fields<Row> fields;
  fields.add(subject_fields(), [](const Row& row) { return &row.subject; });
  fields.add({{Column::text("metric", "error"), &Row::metric},
              {Column::count("n", "records"), &Row::n},
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
  return with_distinct(
      table_of(
          "Errors, record by record",
          "Change of the mean from BASE to NEW over the records that both have estimated, 95 % "
          "interval, p corrected by Holm; detectable: change that would be detected with probability 80 %.",
          fields, by_weight(c.accuracy, changed_only)),
      {"level"});
}

Table status_table(const Comparison& c) {
  using Row = StatusRow;
  Fields<Row> fields;
  fields.add(subject_fields(), [](const Row& row) { return &row.subject; });
  fields.add({{Column::count("n", "records"), &Row::n},
              {Column::count("n_lost", "lost"), &Row::n_lost},
              {Column::count("n_gained", "gained"), &Row::n_gained},
              {Column::count("n_bad", "bad"), &Row::n_bad},
              {Column::count("n_wrong", "wrong"), &Row::n_wrong},
              {Column::count("n_corrected", "corrected"), &Row::n_corrected},
              {Column::count("n_other", "other"), &Row::n_other},
              {Column::text("example"), &Row::example},
              {Column::text("verdict"), [](const Row& row) { return to_string(row.verdict); }}});
  return with_distinct(
      table_of(
          "Records lost and gained, and decisions between dynamic and static",
          "Lost: estimated in BASE, not in NEW. Gained: estimated in NEW, not in BASE. Bad: the same, with a "
          "gross error. Wrong: the decision "
          "contradicts the truth in NEW, not in BASE. Corrected: in BASE, not in NEW. Other: another "
          "status without an estimate, or another decision that is not judged.",
          fields, by_weight(c.statuses, false)),
      {"level"});
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
      "Change of NEW against BASE by Hodges-Lehmann with 95 % interval, p by Mann-Whitney, delta: Cliff's; "
      "detectable: change that would be detected with probability 80 %.",
      fields, rows);
  if (std::ranges::any_of(rows, [](const Row* row) { return !row->interval; })) {
    table.notes.emplace_back(
        "Without an interval there are too few repetitions for a test (4 on each side): only large changes "
        "are seen (unrepeated_effect). scripts/bench_pair makes repetitions.");
  }
  return table;
}

namespace {

constexpr size_t most_shown = 40;

void add(const char* name, Table table, ReportDocument& document) {
  if (table.rows.empty()) return;
  ReportSection section{std::string(name) + "-section", table.title};
  section.tables = {{name, std::move(table), {"dataset", "sequence", "estimator"}}};
  document.sections.push_back(std::move(section));
}

/// Returns " --source SOURCE" if a folder has several sources; SOURCE is the one that contains this frame.
std::string source_flag(const fs::path& folder, const Subject& subject, int frame) {
  if (!fs::exists(folder / "run.json")) return "";
  const Json sources = read_run_json(folder).value("sources", Json::array());
  if (!sources.is_array() || sources.size() < 2) return "";
  const std::string where = (folder / "run.json").string();
  for (const Json& source : sources) {
    if (!source.is_object() || json_member<std::string>(source, "dataset", where, "") != subject.dataset ||
        json_member<std::string>(source, "sequence", where, "") != subject.sequence ||
        frame <= json_member<int>(source, "first_frame", where, 0) ||
        frame > json_member<int>(source, "last_frame", where, 0))
      continue;
    return " --source " + shell_word(json_member<std::string>(source, "source", where));
  }
  return "";
}

/// Lists one row per error that is not ok or has too few records to judge, and the shell commands that make
/// the pages to which the rows link.
ReportSection frames_section(const Comparison& c, const fs::path& out) {
  struct Row {
    const AccuracyRow* error;
    std::string page;
    const ErrorPair& pair() const { return error->largest_change(); }
  };
  ReportSection section{"frames-section", "Frames with the largest changes"};
  std::vector<const AccuracyRow*> changed = by_weight(c.accuracy, /*changed_only=*/true);
  if (changed.size() > most_shown) {
    section.paragraphs.push_back(fmt::format("{} of {} errors that changed.", most_shown, changed.size()));
    changed.resize(most_shown);
  }
  const fs::path base = fs::path(c.base) / "records.jsonl", fresh = fs::path(c.fresh) / "records.jsonl";
  std::error_code ignored;
  if (changed.empty() || !fs::exists(base, ignored) || !fs::exists(fresh, ignored)) return section;
  std::map<std::string, std::string> pages;  // by command, without --out
  std::vector<Row> rows;
  for (const AccuracyRow* row : changed) {
    const Subject& s = row->subject;
    const auto& [seed, frame] = row->largest_change().at;
    const std::string command = fmt::format(
        "sextant view {} {}{} --estimator {} --level {} --seed {}", shell_word(c.base), shell_word(c.fresh),
        source_flag(c.base, s, frame), shell_word(s.estimator.str()), s.level, seed);
    const auto [page, is_new] = pages.try_emplace(command, fmt::format("view_{}", pages.size() + 1));
    if (is_new) section.commands.push_back(command + " --out " + shell_word((out / page->second).string()));
    rows.push_back({row, fmt::format("{}/index.html#frame={}&body={}", page->second, frame, s.body.str())});
  }
  Fields<Row> fields;
  fields.add(subject_fields(), [](const Row& row) { return &row.error->subject; });
  fields.add(
      {{Column::text("metric", "error"), [](const Row& row) { return row.error->metric; }},
       {Column::count("seed"), [](const Row& row) { return row.pair().at.first; }},
       {Column::count("frame").leading_to("page"), [](const Row& row) { return row.pair().at.second; }},
       {Column::number("base", "BASE", 6), [](const Row& row) { return row.pair().base; }},
       {Column::number("new", "NEW", 6), [](const Row& row) { return row.pair().fresh; }},
       {Column::count("base_line", "line in BASE").leading_to("base_records"),
        [](const Row& row) { return row.pair().base_line; }},
       {Column::count("new_line", "line in NEW").leading_to("new_records"),
        [](const Row& row) { return row.pair().fresh_line; }},
       {Column::text("verdict"), [](const Row& row) { return row.error->word(); }},
       {Column::text("base_records").only_in_files(), [&](const Row&) { return address_from(out, base); }},
       {Column::text("new_records").only_in_files(), [&](const Row&) { return address_from(out, fresh); }},
       {Column::text("page").only_in_files(), &Row::page}});
  section.paragraphs.push_back(
      "The record in which each error changed most. Its frame links to a page with both runs, after the "
      "command for it below has been run; line numbers link to the records.");
  section.tables = {{"frames", table_of("", "", fields, rows), {"dataset", "sequence", "estimator"}}};
  return section;
}

/// Makes two columns of a table link to the records of BASE and of NEW, if these are files.
Table with_records(const Comparison& c, const fs::path& out, Table table, const char* base_column,
                   const char* new_column) {
  std::error_code ignored;
  for (const auto& [folder, column] : {std::pair(c.base, base_column), std::pair(c.fresh, new_column)}) {
    const fs::path file = fs::path(folder) / "records.jsonl";
    if (fs::exists(file, ignored))
      add_addresses(column, std::vector(table.rows.size(), address_from(out, file)), table);
  }
  return table;
}

}  // namespace

ReportDocument comparison_document(const Comparison& c, const fs::path& out) {
  ReportDocument document;
  document.title = fmt::format("{}: {} against {}", to_string(c.verdict), c.fresh, c.base);
  const std::string largest = largest_change(c);
  document.abstract = (largest.empty() ? "" : largest + ". ") + headline(c) + ".";
  add("findings", findings_table(c), document);
  add("families", family_table(c, /*changed_only=*/false), document);
  ReportSection frames = frames_section(c, out);
  if (!frames.tables.empty()) document.sections.push_back(std::move(frames));
  add("statuses", with_records(c, out, status_table(c), "n_lost", "n_gained"), document);
  add("accuracy",
      with_records(c, out, accuracy_table(c, /*changed_only=*/false), "base", "difference_percent"),
      document);
  add("speed", with_records(c, out, speed_table(c, /*changed_only=*/false), "base_us", "change_percent"),
      document);
  document.provenance = {{"BASE", c.base},
                         {"NEW", c.fresh},
                         {"page by", fmt::format("sextant {}, commit {}", version(), git_commit())}};
  return document;
}

}  // namespace sextant
