#include "sextant/eval/reproduce/reproduce.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {

std::string answer_text(const std::vector<std::string>& verdicts) {
  size_t n_judged = 0, n_within = 0, n_not_comparable = 0, n_missing = 0;
  for (const std::string& verdict : verdicts) {
    const bool is_within = verdict.starts_with("within");
    n_judged += is_within || verdict.starts_with("outside");
    n_within += is_within;
    n_not_comparable += verdict == "not comparable";
    n_missing += verdict == "not measured here";
  }
  std::string text =
      n_judged == 0 ? "no published value compared"
                    : fmt::format("the published value lies within our single runs in {} of {} comparisons",
                                  n_within, n_judged);
  if (n_not_comparable > 0) text += fmt::format("; {} not comparable", n_not_comparable);
  if (n_missing > 0) text += fmt::format("; {} not measured here", n_missing);
  return text;
}

namespace {

Json read_data_json(const fs::path& folder) {
  const fs::path path = folder / "data.json";
  if (!fs::exists(path)) {
    fail("{}: no data.json: expected a folder that `sextant reproduce` has written", folder.string());
  }
  const Json data = read_json(path);
  if (!data.is_array())
    fail("{}: expected a JSON array: remove the file and run `sextant reproduce` again", path.string());
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
    SEXTANT_CHECK(!sweeps.empty());
    NoiseSweep& sweep = sweeps.front();
    for (size_t i = 1; i < sweeps.size(); ++i) add_levels(sweeps[i], sweep);
    evidence.parts.push_back(
        {part.name, part.role, std::move(sweep), read_records(folder / "records.jsonl")});
  }
  if (evidence.parts.empty())
    fail(
        "{}: no experiment is finished, so there is nothing to report: run `sextant reproduce` without "
        "--report-only",
        config.out.string());
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

/// Makes the summary line of a table of the paper.
VerdictLine verdict_line(const PaperTable& entry, const std::vector<PaperLayout>& layouts) {
  std::vector<std::string> verdicts;
  const auto layout = std::ranges::find(layouts, entry.number, &PaperLayout::number);
  for (const LayoutRow& row : layout->versions.front().rows) {
    for (const auto& cell : row.cells)
      for (const LayoutValue& value : cell)
        if (value.published) verdicts.push_back(value.measured ? value.verdict : "not measured here");
  }
  std::erase(verdicts, "");
  VerdictLine line{paper().table(entry.number).title, joint_verdict(verdicts), answer_text(verdicts),
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

/// Makes the sections of details.html with the long tables, each with the picture of its published and
/// measured values (answer_figure()), and adds the summary line of each table to `verdicts`.
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
      verdicts.push_back(verdict_line(entry, layouts));
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

/// Returns the figures that have a number in the paper and are on report.html, not on details.html, in the
/// order of the sections.
std::vector<PrintedFigure> printed_figures(const std::vector<PlacedSection>& sections) {
  std::vector<PrintedFigure> figures;
  for (const PlacedSection& placed : sections) {
    if (placed.section.is_detail || placed.place == PaperPlace::ours) continue;
    for (const Figure& figure : placed.section.figures)
      figures.push_back({placed.place, figure.caption, figure.name, figure.width_cm});
  }
  return figures;
}

// Provenance of a report: program, machine and inputs of its records, from the run.json of the experiments.
// The lines depend on these folders only.

std::string text_at(const Json& run, const char* key) { return run.value(key, std::string("unknown")); }

std::string libraries(const Json& run) {
  std::string text;
  const Json packages = run.value("packages", Json::object());
  for (const auto& [name, version] : packages.items())
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, version.get<std::string>());
  return text;
}

std::string machine(const Json& run) {
  const Json& m = run.value("machine", Json::object());
  return fmt::format("{}, {} cores", m.value("cpu", std::string("unknown")), m.value("cores", 0));
}

/// Returns the texts of all experiments, each distinct text once.
std::string distinct(const std::vector<Json>& runs, const std::function<std::string(const Json&)>& say) {
  std::vector<std::string> texts;
  for (const Json& run : runs) add_distinct(say(run), texts);
  return fmt::format("{}", fmt::join(texts, "; "));
}

/// Formats "24 files, SHA-256 1f0a..." from the digests of all files that an experiment has read, in order of
/// name.
std::string inputs_of(const Json& run) {
  size_t n = 0;
  std::string digests;
  const auto add = [&](const Json& inputs) {
    for (const auto& [path, input] : inputs.items()) {
      digests += (input.is_string() ? input : input.at("sha256")).get<std::string>() + "\n";
      ++n;
    }
  };
  if (run.contains("inputs")) add(run.at("inputs"));
  for (const Json& source : run.value("sources", Json::array())) add(source.value("inputs", Json::object()));
  if (n == 0) return "no files: scenarios built into the program";
  return fmt::format("{} files, SHA-256 {}", n, sha256(digests).substr(0, 16));
}

std::string part_line(const EvidencePart& part, const Json& run) {
  std::set<uint64_t> seeds;
  for (const Record& record : part.records) seeds.insert(record.seed);
  return fmt::format("{} records, {} seed{}; {}; parts/{}/run.json", part.records.size(), seeds.size(),
                     seeds.size() == 1 ? "" : "s", inputs_of(run), part.name);
}

/// Returns the lines, (name, value), for the experiments in `parts`/<name>. A value that several experiments
/// share is listed once.
std::vector<std::pair<std::string, std::string>> reproduction_provenance(const fs::path& parts,
                                                                         const Evidence& evidence) {
  std::vector<Json> runs;
  for (const EvidencePart& part : evidence.parts) runs.push_back(read_run_json(parts / part.name));
  std::vector<std::pair<std::string, std::string>> lines = {
      {"report by", fmt::format("sextant {}, commit {}", version(), git_commit())},
      {"records by", distinct(runs,
                              [](const Json& run) {
                                return fmt::format("sextant {}, commit {}", text_at(run, "version"),
                                                   text_at(run, "git_commit"));
                              })},
      {"compiler",
       distinct(runs,
                [](const Json& run) { return text_at(run, "compiler") + " " + text_at(run, "flags"); })},
      {"libraries", distinct(runs, libraries)},
      {"machine", distinct(runs, machine)}};
  for (size_t i = 0; i < runs.size(); ++i)
    lines.emplace_back("part " + evidence.parts[i].name, part_line(evidence.parts[i], runs[i]));
  return lines;
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

namespace {

/// Returns the verdict of a claim in the summary: "reproduced", "partly", "not reproduced", "undecided" or
/// "not measured here".
std::string verdict_of(const CheckedClaim& claim) { return claim_verdicts({claim}, "").front().verdict; }

std::string sentence(const std::string& begin, const std::vector<std::string>& items) {
  return items.empty() ? "" : fmt::format("{}: {}. ", begin, fmt::join(items, "; "));
}

}  // namespace

std::string answer_paragraph(const std::vector<CheckedClaim>& checked,
                             const std::vector<PaperLayout>& tables) {
  std::vector<std::string> holds, partly, differs, undecided;
  std::string why;
  for (const CheckedClaim& claim : checked) {
    const std::string verdict = verdict_of(claim);
    if (claim.claim->name == "gain_is_selection" && verdict == "reproduced") why = claim.claim->statement;
    if (claim.claim->brief.empty()) continue;
    if (verdict == "reproduced") holds.push_back(claim.claim->brief);
    if (verdict == "partly") partly.push_back(claim.claim->brief);
    if (verdict == "undecided") undecided.push_back(claim.claim->brief);
    if (verdict == "not reproduced") differs.push_back(claim.claim->brief);
  }
  size_t n_judged = 0, n_within = 0, n_injected = 0;
  std::vector<std::string> missing, fetch;
  for (const PaperLayout& table : tables) {
    bool is_missing = false;
    for (const LayoutRow& row : table.versions.front().rows) {
      for (const auto& cell : row.cells) {
        for (const LayoutValue& value : cell) {
          const bool is_within = value.verdict.starts_with("within");
          const bool is_judged = is_within || value.verdict.starts_with("outside");
          // A value with a factor is the size of noise that we injected as published: it cannot disagree.
          const bool is_injected = value.factor != 1;
          n_within += is_within && !is_injected;
          n_judged += is_judged && !is_injected;
          n_injected += is_judged && is_injected;
          is_missing |= value.published && !value.measured;
        }
      }
    }
    if (!is_missing) continue;
    missing.push_back(table.number + (table.versions.front().n_measured > 0 ? " (part)" : ""));
    add_distinct(paper().table(table.number).fetch, fetch);
  }
  std::string text = sentence("Holds", holds) + sentence("Holds in part", partly) +
                     sentence("Does not hold", differs) + sentence("Undecided", undecided);
  if (!why.empty()) text += fmt::format("Why Table III differs: {}. ", why);
  text += fmt::format(
      "{} of {} comparable published values lie within our runs{}. ", n_within, n_judged,
      n_injected == 0 ? "" : fmt::format(" ({} sizes of the injected noise are not counted)", n_injected));
  if (!missing.empty())
    text += fmt::format("Not measured: tables {}: {}, then sextant reproduce --data ROOT.",
                        fmt::join(missing, ", "), fmt::join(fetch, " and "));
  return text;
}

}  // namespace sextant
