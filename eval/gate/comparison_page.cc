#include "sextant/eval/gate/comparison.h"

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>

#include "sextant/base/files.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/record_places.h"

namespace sextant {
namespace {

constexpr size_t most_shown = 40;

using Case = std::pair<uint64_t, int>;  // seed, frame

struct Place {
  double value = 0;
  size_t line = 0;
};

/// The errors of these rows, by row and case.
std::vector<std::map<Case, Place>> places_of(const std::vector<const AccuracyRow*>& rows,
                                             const fs::path& file) {
  std::unordered_map<Subject, std::vector<size_t>, Subject::Hash> by_subject;
  for (size_t i = 0; i < rows.size(); ++i)
    by_subject[rows[i]->subject].push_back(i);
  std::vector<std::map<Case, Place>> places(rows.size());
  size_t line = 0;
  for_each_record(file, [&](Record& record) {
    ++line;
    if (record.status != Status::ok) return;
    const auto found = by_subject.find(Subject::of(record));
    if (found == by_subject.end()) return;
    for (const size_t i : found->second) {
      if (record.errors.contains(rows[i]->metric))
        places[i][{record.seed, record.frame}] = {record.errors.at(rows[i]->metric), line};
    }
  });
  return places;
}

struct Change {
  Case where;
  Place base, fresh;
};

/// Where NEW is furthest above BASE; below it for errors that got better.
std::optional<Change> largest_case_change(const std::map<Case, Place>& base,
                                          const std::map<Case, Place>& fresh, bool worse) {
  std::optional<Change> largest;
  for (const auto& [where, in_base] : base) {
    const auto in_fresh = fresh.find(where);
    if (in_fresh == fresh.end()) continue;
    const double change = (in_fresh->second.value - in_base.value) * (worse ? 1 : -1);
    if (!largest || change > (largest->fresh.value - largest->base.value) * (worse ? 1 : -1))
      largest = {where, in_base, in_fresh->second};
  }
  return largest;
}

void add(const char* name, const char* heading, Table table, ReportDocument& document) {
  if (table.rows.empty()) return;
  ReportSection section{std::string(name) + "-section", heading};
  section.tables = {{name, std::move(table), {"dataset", "sequence", "estimator"}}};
  document.sections.push_back(std::move(section));
}

/// " --source SOURCE" where a folder has several and says which of them has this frame.
std::string source_flag(const fs::path& folder, const Subject& subject, int frame) {
  if (!fs::exists(folder / "run.json")) return "";
  const Json sources = read_run_json(folder).value("sources", Json::array());
  if (!sources.is_array() || sources.size() < 2) return "";
  const std::string where = (folder / "run.json").string();
  for (const Json& source : sources) {
    if (!source.is_object() || json_member<std::string>(source, "dataset", where, "") != subject.dataset ||
        json_member<std::string>(source, "sequence", where, "") != subject.sequence ||
        frame <= json_member<int>(source, "first_frame", where, 0) || frame > json_member<int>(source, "last_frame", where, 0))
      continue;
    return " --source " + shell_word(json_member<std::string>(source, "source", where));
  }
  return "";
}

/// One row and one line for a shell per error that changed.
ReportSection frames_section(const Comparison& c, const fs::path& out) {
  ReportSection section{"frames-section", "Where it shows"};
  std::vector<const AccuracyRow*> rows = by_weight(c.accuracy, /*changed_only=*/true);
  if (rows.size() > most_shown) {
    section.paragraphs.push_back(fmt::format("{} of {} errors that changed.", most_shown, rows.size()));
    rows.resize(most_shown);
  }
  const fs::path base = fs::path(c.base) / "records.jsonl", fresh = fs::path(c.fresh) / "records.jsonl";
  std::error_code ignored;
  if (rows.empty() || !fs::exists(base, ignored) || !fs::exists(fresh, ignored)) return section;
  Table table{"",
              "",
              {Column::text("dataset").folded(), Column::text("sequence").folded(),
               Column::text("estimator").folded(), Column::number("level", 3).folded(), Column::text("body"),
               Column::text("metric", "error"), Column::count("seed"), Column::count("frame"),
               Column::number("base", "BASE", 6), Column::number("new", "NEW", 6),
               Column::count("base_line", "line in BASE"), Column::count("new_line", "line in NEW"),
               Column::text("verdict"), Column::text("base_records").only_in_files(),
               Column::text("new_records").only_in_files(), Column::text("page").only_in_files()}};
  const auto leads = [&](const char* key, const char* to) {
    table.columns[table.place(key)].leads_to = to;
  };
  leads("frame", "page");
  leads("base_line", "base_records");
  leads("new_line", "new_records");
  const auto in_base = places_of(rows, base), in_fresh = places_of(rows, fresh);
  std::map<std::string, std::string> pages;  // by command, without --out
  for (size_t i = 0; i < rows.size(); ++i) {
    const auto change =
        largest_case_change(in_base[i], in_fresh[i], rows[i]->verdict != GateVerdict::improved);
    if (!change) continue;
    const Subject& s = rows[i]->subject;
    const std::string command = fmt::format("sextant view {} {}{} --estimator {} --level {} --seed {}", shell_word(c.base),
                                            shell_word(c.fresh), source_flag(c.base, s, change->where.second),
                                            shell_word(s.estimator.str()), s.level, change->where.first);
    const auto [page, is_new] = pages.try_emplace(command, fmt::format("view_{}", pages.size() + 1));
    if (is_new) section.commands.push_back(command + " --out " + shell_word((out / page->second).string()));
    table.add_row(
        {s.dataset.str(), s.sequence.str(), s.estimator.str(), s.level, s.body.str(), rows[i]->metric, change->where.first,
         change->where.second, change->base.value, change->fresh.value, change->base.line, change->fresh.line,
         rows[i]->word(), address_from(out, base), address_from(out, fresh),
         fmt::format("{}/index.html#frame={}&body={}", page->second, change->where.second, s.body.str())});
  }
  section.paragraphs.push_back(
      "The case in which each error changed most. Its frame leads to a page with both runs, once the line for it below has been "
      "run; lines lead to the records.");
  section.tables = {{"frames", std::move(table), {"dataset", "sequence", "estimator"}}};
  return section;
}

/// Two of its columns lead to the records of BASE and of NEW, where they are files.
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
  add("findings", "What differs besides the numbers", findings_table(c), document);
  add("families", "Errors, pooled over sources and bodies", family_table(c, /*changed_only=*/false), document);
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
