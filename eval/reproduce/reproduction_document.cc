#include <algorithm>
#include <array>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/fetch_lines.h"
#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/eval/reproduce/figures.h"
#include "sextant/eval/reproduce/reproduce.h"

namespace sextant {
namespace {

Json read_data_json(const fs::path& folder) {
  const fs::path path = folder / "data.json";
  if (!fs::exists(path)) {
    fail("{}: no data.json: expected a folder that `sextant reproduce` has written", folder.string());
  }
  const Json data = read_json(path);
  if (!data.is_array()) fail("{}: expected a JSON array; remove it and run again", path.string());
  return data;
}

/// The records of every finished part.
Evidence read_evidence(const ReproduceConfig& config) {
  Evidence evidence;
  evidence.published = published_values();
  for (const Part& part : config.parts) {
    const fs::path folder = config.out / "parts" / part.name;
    if (!fs::exists(folder / "records.jsonl") || fs::exists(folder / "journal.jsonl")) continue;
    std::vector<NoiseSweep> sweeps = read_noise_sweeps({folder});
    SEXTANT_CHECK(sweeps.size() == 1);
    evidence.parts.push_back(
        {part.name, part.role, std::move(sweeps.front()), read_records(folder / "records.jsonl")});
  }
  if (evidence.parts.empty()) fail("{}: no part is finished: nothing to report", config.out.string());
  return evidence;
}

/// Which parts there are, on what data, and how to get the others.
Table data_table(const Json& data, const Evidence& evidence) {
  Table table{
      "What was measured",
      "ROOT is the folder given by --data or SEXTANT_DATA. Virtual KITTI and KITTI have their own licences "
      "(CC BY-NC-SA 3.0).",
      {{"part", "part", Align::left},
       {"title", "what", Align::left},
       {"state", "state", Align::left},
       {"records", "records", Align::right, 0},
       {"missing", "missing", Align::left},
       {"fetch", "how to get it", Align::left}}};
  std::vector<std::string> records;
  for (const Json& entry : data) {
    const auto text = [&](const char* key) { return json_member<std::string>(entry, key, "data.json"); };
    const std::string name = text("part");
    const auto part = std::find_if(evidence.parts.begin(), evidence.parts.end(),
                                   [&](const EvidencePart& p) { return p.name == name; });
    const bool measured = part != evidence.parts.end();
    const std::string missing = text("missing");
    const std::string state = measured ? "measured" : missing.empty() ? "not finished" : "not measured here";
    table.add_row({name, text("title"), state,
                   measured ? Cell(static_cast<double>(part->records.size())) : Cell(), missing,
                   missing.empty() ? std::string() : measuring_line(text("fetch"))});
    records.push_back(measured ? records_of_part(name) : "");
  }
  add_addresses("records", records, table);
  return table;
}

/// The verdicts that a table's rows have.
std::vector<std::string> verdicts_of(const Table& table) {
  std::vector<std::string> verdicts;
  const auto verdict = table.find_column("verdict");
  if (!verdict) return verdicts;
  for (const std::vector<Cell>& row : table.rows) {
    const auto* text = std::get_if<std::string>(&row[*verdict]);
    if (text != nullptr && !text->empty()) verdicts.push_back(*text);
  }
  return verdicts;
}

/// Rows of published values that were not measured say which command would.
void name_commands(const PaperTable& entry, Table& table) {
  const auto verdict = table.find_column("verdict"), published = table.find_column("published"),
             data = table.find_column("data");
  if (entry.fetch.empty() || !verdict || !published || !data) return;
  for (std::vector<Cell>& row : table.rows) {
    if (row[*verdict] != Cell("not measured here") || std::holds_alternative<std::monostate>(row[*published])) continue;
    const auto* why = std::get_if<std::string>(&row[*data]);
    const bool says_why = why != nullptr && !why->empty() && *why != "none";
    row[*data] = (says_why ? *why + "; measured by: " : "measured by: ") + measuring_line(entry.fetch);
  }
}

void add_paper_tables(const Evidence& evidence, ReportDocument& document) {
  for (const PaperTable& entry : paper_tables()) {
    Table table = entry.make(evidence);
    const std::vector<std::string> verdicts = verdicts_of(table);
    const bool ours = verdicts.empty() && !table.rows.empty();  // no published value to be judged by
    VerdictLine line{table.title, ours ? "measured" : joint_verdict(verdicts),
                     ours ? "no published values" : answer_text(table), "#" + entry.name};
    const bool of_paper = table.title.find("(ours)") == std::string::npos;
    line.group = of_paper ? "Tables of the paper" : "Tables of ours";
    auto figure = of_paper ? answer_figure(entry.name, table) : std::nullopt;
    if (figure) line.figures.push_back(std::move(*figure));
    document.verdicts.push_back(std::move(line));
    name_commands(entry, table);
    ReportSection section{entry.name + "-section", table.title};
    if (!entry.exact_data.empty()) {
      section.paragraphs.push_back("The paper measured on: " + entry.exact_data +
                                   ". To get what is public of it: " + entry.fetch + ".");
    }
    section.tables.push_back({entry.name, std::move(table), entry.split_by});
    document.sections.push_back(std::move(section));
  }
}

/// As the paper prints them; then what is ours, as it comes.
void put_in_paper_order(std::vector<ReportSection>& sections) {
  static constexpr std::array<const char*, 9> order = {"Fig. 1", "Table I:",  "Fig. 4",    "Table II:", "Table III:",
                                                       "Fig. 5", "Table IV:", "Table V:", "Fig. 6"};
  std::ranges::stable_sort(sections, {}, [](const ReportSection& section) {
    return std::ranges::find_if(order, [&](const char* begin) { return section.heading.starts_with(begin); }) - order.begin();
  });
}

}  // namespace

ReportDocument reproduction_document(const ReproduceConfig& config) {
  const Json data = read_data_json(config.out);
  const Evidence evidence = read_evidence(config);
  const std::vector<CheckedClaim> checked = check_claims(evidence);
  ReportDocument document;
  document.title = "Reproduction of Robust Ego and Object 6-DoF Motion Estimation and Tracking";
  document.abstract =
      "Every table, figure and claim of the paper (Zhang, Henein, Mahony, Ila, IROS 2020), "
      "rebuilt from records beside the published values.";
  add_paper_tables(evidence, document);
  add_figure_sections(config.out / "parts", evidence, config.jobs, document);
  put_in_paper_order(document.sections);
  std::ranges::move(claim_verdicts(checked, "#claims"), std::back_inserter(document.verdicts));
  ReportSection claims{"claims-section", "Claims", {}, {{"claims", claim_table(checked), {"statement", "records"}}}, {}, {}};
  claims.in_summary = true;
  document.sections.insert(document.sections.begin(), std::move(claims));
  document.sections.push_back({"data-section", "Data", {}, {{"data", data_table(data, evidence)}}, {}, {}});
  document.provenance = reproduction_provenance(config.out / "parts", evidence);
  document.citation = citation();
  return document;
}

}  // namespace sextant
