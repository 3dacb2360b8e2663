#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/tables/paper_table.h"
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
  evidence.published = paper().published;
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
  struct PartState {
    std::string name, title, missing, fetch;
    const EvidencePart* measured = nullptr;
  };
  std::vector<PartState> rows;
  for (const Json& entry : data) {
    const auto text = [&](const char* key) { return json_member<std::string>(entry, key, "data.json"); };
    PartState row{text("part"), text("title"), text("missing"), text("fetch")};
    const auto part = std::ranges::find(evidence.parts, row.name, &EvidencePart::name);
    if (part != evidence.parts.end()) row.measured = &*part;
    rows.push_back(std::move(row));
  }
  const Fields<PartState> fields = {
      {Column::text("part"), &PartState::name},
      {Column::text("title", "what"), &PartState::title},
      {Column::text("state"),
       [](const PartState& part) {
         return part.measured ? "measured" : part.missing.empty() ? "not finished" : "not measured here";
       }},
      {Column::count("records").leading_to("records_file"),
       [](const PartState& part) { return part.measured ? Cell(part.measured->records.size()) : Cell(); }},
      {Column::text("missing"), &PartState::missing},
      {Column::text("fetch", "how to get it"),
       [](const PartState& part) { return part.missing.empty() ? "" : measuring_line(part.fetch); }},
      {Column::text("records_file").only_in_files(),
       [](const PartState& part) { return part.measured ? Cell(records_of_part(part.name)) : Cell(); }}};
  return table_of(
      "What was measured",
      "ROOT is the folder given by --data or SEXTANT_DATA. Virtual KITTI and KITTI have their own licences "
      "(CC BY-NC-SA 3.0).",
      fields, rows);
}

/// What the summary says of a table of the paper.
VerdictLine verdict_line(const PaperTable& entry, const PublishedTable& table) {
  std::vector<std::string> verdicts;
  for (const PaperRow& row : table.rows) {
    if (!row.verdict().empty()) verdicts.push_back(row.verdict());
  }
  const bool judged = !verdicts.empty() || table.rows.empty();
  VerdictLine line{paper().table(entry.number).title, judged ? joint_verdict(verdicts) : "measured",
                   judged ? answer_text(table.rows) : "no published values", "#" + entry.name};
  line.group = "Tables of the paper";
  if (auto figure = answer_figure(entry.name, table)) line.figures.push_back(std::move(*figure));
  return line;
}

VerdictLine verdict_line(const PaperTable& entry, const Table& ours) {
  const bool measured = !ours.rows.empty();
  VerdictLine line{ours.title, measured ? "measured" : joint_verdict({}),
                   measured ? "no published values" : answer_text({}), "#" + entry.name};
  line.group = "Tables of ours";
  return line;
}

std::vector<PlacedSection> paper_table_sections(const Evidence& evidence,
                                                std::vector<VerdictLine>& verdicts) {
  std::vector<PlacedSection> sections;
  for (const PaperTable& entry : paper_tables()) {
    const TableText text = paper().table(entry.number);
    Table shown;
    if (entry.published) {
      PublishedTable table = entry.published(evidence);
      verdicts.push_back(verdict_line(entry, table));
      for (PaperRow& row : table.rows) row.command = measuring_line(text.fetch);
      shown = table.table();
    } else {
      shown = entry.ours(evidence);
      verdicts.push_back(verdict_line(entry, shown));
    }
    ReportSection section{entry.name + "-section", shown.title};
    if (!text.data.empty()) {
      section.paragraphs.push_back("The paper measured on: " + text.data +
                                   ". To get what is public of it: " + text.fetch + ".");
    }
    section.tables.push_back({entry.name, std::move(shown), entry.split_by});
    sections.push_back({entry.place, std::move(section)});
  }
  return sections;
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
  std::vector<PlacedSection> sections = paper_table_sections(evidence, document.verdicts);
  std::ranges::move(figure_sections(config.out / "parts", evidence, config.jobs),
                    std::back_inserter(sections));
  std::ranges::stable_sort(sections, {}, &PlacedSection::place);
  for (PlacedSection& placed : sections) document.sections.push_back(std::move(placed.section));
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
