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

/// Reads the records of every finished experiment.
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
  if (evidence.parts.empty())
    fail("{}: no experiment is finished, so there is nothing to report", config.out.string());
  return evidence;
}

/// Lists the experiments with their data, and the commands that obtain missing data.
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
      "Data and state of every experiment",
      "ROOT is the folder given by --data or SEXTANT_DATA. Virtual KITTI and KITTI have their own licences "
      "(CC BY-NC-SA 3.0).",
      fields, rows);
}

/// Summary line of a table of the paper.
VerdictLine verdict_line(const PaperTable& entry, const PublishedTable& table,
                         const std::vector<PaperLayout>& layouts) {
  std::vector<std::string> verdicts;
  const auto layout = std::ranges::find(layouts, entry.number, &PaperLayout::number);
  for (const LayoutRow& row : layout->versions.front().rows) {
    for (const auto& cell : row.cells)
      for (const LayoutValue& value : cell)
        if (value.published && !value.verdict.empty()) verdicts.push_back(value.verdict);
  }
  VerdictLine line{paper().table(entry.number).title, joint_verdict(verdicts), answer_text(table.rows),
                   "#" + entry.name};
  line.group = "Tables of the paper";
  return line;
}

VerdictLine verdict_line(const PaperTable& entry, const Table& ours) {
  const bool measured = !ours.rows.empty();
  VerdictLine line{ours.title, measured ? "measured" : joint_verdict({}),
                   measured ? "no published values" : answer_text({}), "#" + entry.name};
  line.group = "Tables of ours";
  return line;
}

/// Sections with the long tables and the figures of their answers, for the details of the page.
std::vector<PlacedSection> long_table_sections(const Evidence& evidence,
                                               const std::vector<PublishedTable>& published,
                                               const std::vector<PaperLayout>& layouts,
                                               std::vector<VerdictLine>& verdicts) {
  std::vector<PlacedSection> sections;
  for (const PaperTable& entry : paper_tables()) {
    const TableText text = paper().table(entry.number);
    Table shown;
    std::vector<Figure> figures;
    if (entry.published) {
      PublishedTable table = *std::ranges::find(published, entry.number, &PublishedTable::number);
      verdicts.push_back(verdict_line(entry, table, layouts));
      if (auto figure = answer_figure(entry.name, table)) figures.push_back(std::move(*figure));
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
    section.figures = std::move(figures);
    section.tables.push_back({entry.name, std::move(shown), entry.split_by});
    section.is_detail = true;
    sections.push_back({entry.place, std::move(section)});
  }
  return sections;
}

/// Figures of the paper's numbers that the page shows directly, in the paper's order.
std::vector<PrintedFigure> printed_figures(const std::vector<PlacedSection>& sections) {
  std::vector<PrintedFigure> figures;
  for (const PlacedSection& placed : sections) {
    if (placed.section.is_detail || placed.place == PaperPlace::ours) continue;
    for (const Figure& figure : placed.section.figures)
      figures.push_back({placed.place, figure.caption, figure.name, figure.width_cm});
  }
  return figures;
}

}  // namespace

ReproductionReport reproduction_report(const ReproduceConfig& config) {
  const Json data = read_data_json(config.out);
  const Evidence evidence = read_evidence(config);
  const std::vector<CheckedClaim> checked = check_claims(evidence);
  std::vector<PublishedTable> published;
  for (const PaperTable& entry : paper_tables())
    if (entry.published) published.push_back(entry.published(evidence));
  ReproductionReport report;
  report.tables = paper_layouts(published);
  ReportDocument& document = report.document;
  document.title = "Reproduction of Robust Ego and Object 6-DoF Motion Estimation and Tracking";
  document.abstract = answer_paragraph(checked, report.tables);
  document.lead = paper_fragment(report.tables);
  document.details_abstract =
      "The long tables behind report.html, one row a measured value, and our "
      "own forms of the figures.";
  std::vector<PlacedSection> sections =
      long_table_sections(evidence, published, report.tables, document.verdicts);
  std::ranges::move(figure_sections(config.out / "parts", evidence, config.jobs),
                    std::back_inserter(sections));
  std::ranges::stable_sort(sections, {}, &PlacedSection::place);
  report.figures = printed_figures(sections);
  for (PlacedSection& placed : sections) document.sections.push_back(std::move(placed.section));
  std::ranges::move(claim_verdicts(checked, "claims"), std::back_inserter(document.verdicts));
  ReportSection claims{
      "claims-section", "Claims", {}, {{"claims", claim_table(checked), {"statement"}}}, {}, {}};
  claims.is_detail = true;
  document.sections.push_back(std::move(claims));
  ReportSection measured{"data-section", "Data", {}, {{"data", data_table(data, evidence)}}, {}, {}};
  measured.is_detail = true;
  document.sections.push_back(std::move(measured));
  document.provenance = reproduction_provenance(config.out / "parts", evidence);
  document.citation = citation();
  return report;
}

}  // namespace sextant
