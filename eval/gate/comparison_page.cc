#include "sextant/eval/gate/comparison.h"

#include <algorithm>
#include <map>

#include "sextant/base/files.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/report/record_places.h"

namespace sextant {
namespace {

constexpr size_t most_shown = 40;

void add(const char* name, const char* heading, Table table, ReportDocument& document) {
  if (table.rows.empty()) return;
  ReportSection section{std::string(name) + "-section", heading};
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

/// Lists one row and one shell command per error that changed.
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
      "The case in which each error changed most. Its frame links to a page with both runs, after the command "
      "for it below has been run; line numbers link to the records.");
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
  add("findings", "Differences besides the numbers", findings_table(c), document);
  add("families", "Errors, pooled over sources and bodies", family_table(c, /*changed_only=*/false),
      document);
  ReportSection frames = frames_section(c, out);
  if (!frames.tables.empty()) document.sections.push_back(std::move(frames));
  add("statuses", "Cases lost and gained", with_records(c, out, status_table(c), "n_lost", "n_gained"),
      document);
  add("accuracy", "Errors, case by case",
      with_records(c, out, accuracy_table(c, /*changed_only=*/false), "base", "difference_percent"),
      document);
  add("speed", "Times",
      with_records(c, out, speed_table(c, /*changed_only=*/false), "base_us", "change_percent"), document);
  document.provenance = {{"BASE", c.base},
                         {"NEW", c.fresh},
                         {"page by", fmt::format("sextant {}, commit {}", version(), git_commit())}};
  return document;
}

}  // namespace sextant
