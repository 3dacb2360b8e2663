#include "sextant/eval/workflow/report_output.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/errors_by_level.h"
#include "sextant/eval/report/estimator_comparisons.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/trends.h"

namespace sextant {

EgoScores evaluate_ego_into(const EgoFiles& files, const EgoOptions& options, const EgoOutput& output) {
  const auto lock = lock_folder(output.out), lock_tum = lock_folder(output.tum);
  if (!output.zip.empty() && files.estimates.size() > 1)
    fail("--save-zip holds one result: give one estimate");
  EgoScores scores = evaluate_ego_files(files, options);
  if (!output.zip.empty()) write_evo_result(output.zip, scores.runs.front(), options, files.reference);
  if (!output.tum.empty()) write_tum(scores, output.tum);
  if (!output.out.empty()) {
    const EgoCurves curves = ego_curves(scores.runs, scores.reference, options, output.plane);
    OutputFiles report = report_folder(ego_document(scores.runs, scores.reference, options, curves), {});
    report.merge(curve_files(curves));
    write_output_folder(output.out, report);
  }
  return scores;
}

ObjectScores evaluate_objects_into(const ObjectFiles& files, std::span<const MetricPreset> presets,
                                   const std::string& out) {
  const auto lock = lock_folder(out), lock_tum = lock_folder(files.tum);
  ObjectScores scores = evaluate_object_files(files);
  if (!out.empty()) {
    OutputFiles report = report_folder(object_document(scores, presets), {});
    report["records.jsonl"] = write_records(scores.records);
    for (const ObjectTracks& tracks : scores.tracks)
      report[tracks_file(tracks.system, tracks.run)] = write_tracks(tracks.bodies, true);
    write_output_folder(out, report);
  }
  return scores;
}

Reproduction reproduce(const ReproduceConfig& config, bool report_only) {
  const FolderLock lock(config.out);
  if (!report_only) run_parts(config);
  const ReproductionReport report = reproduction_report(config);
  Reproduction made{.document = report.document, .tables = report.tables, .report = {}};
  const std::filesystem::path folder = make_folder_below(config.out, "report");
  OutputFiles files = report_folder(made.document, {true, config.jobs, config.quiet});
  files["paper.html"] =
      paper_page(made.document.title, made.document.abstract, report.tables, report.figures, files);
  files.merge(paper_files(report.tables));
  write_output_folder(folder, files);
  made.report = folder / "report.html";
  return made;
}

namespace {

std::string joined(const std::vector<std::filesystem::path>& folders) {
  std::string text;
  for (const std::filesystem::path& folder : folders) text += (text.empty() ? "" : ", ") + folder.string();
  return text;
}

/// Lists what sweeps that kept summaries cannot report, one row each; no rows for sweeps with records.
Table summary_limits(const std::vector<NoiseSweep>& sweeps, const std::vector<ComparisonRow>& comparisons,
                     size_t n_left_out) {
  struct Limit {
    std::string what, why;
  };
  std::vector<Limit> limits;
  bool any = false, one_seed = false;
  for (const NoiseSweep& sweep : sweeps) {
    for (const NoiseLevelRef& level : sweep.levels) {
      any = any || level->is_summed();
      one_seed = one_seed || (level->is_summed() && level->n_seeds() < 2);
    }
  }
  if (any)
    limits.push_back(
        {"quantiles", "exact within 0.5 %, the width of the histogram bins; everything else is exact"});
  if (one_seed) limits.push_back({"intervals of one seed", "need frames, which only records have"});
  if (any && n_left_out > 0) {
    limits.push_back(
        {fmt::format("{} of {} comparisons of estimators", n_left_out, n_left_out + comparisons.size()),
         "the two estimated different pairs; only records show which"});
  }
  return table_of<Limit>("What summaries leave open",
                         "These sweeps kept summaries of their cases, not records (\"keep\": \"summary\").",
                         {{Column::text("what"), &Limit::what}, {Column::text("why"), &Limit::why}}, limits);
}

const std::vector<std::string> split_keys = {"parameter", "source", "dataset", "sequence"};

std::vector<std::string> with_split_keys(const std::vector<std::string>& keys) {
  std::vector<std::string> all = split_keys;
  all.insert(all.end(), keys.begin(), keys.end());
  return all;
}

// Keys of the most important columns of each table.
const std::vector<std::string> first_of_comparisons =
    with_split_keys({"first", "second", "body", "level", "n_pairs", "Et_difference_m", "Et_low_m",
                     "Et_high_m", "Et_difference_percent", "Et_verdict", "records"});
const std::vector<std::string> first_of_levels =
    with_split_keys({"body", "estimator", "level", "coverage_percent", "Et_mean_m", "Et_mean_low_m",
                     "Et_mean_high_m", "Et_efficiency", "ER_mean_deg", "anees", "records"});
const std::vector<std::string> first_of_trends = with_split_keys(
    {"body", "estimator", "lowest", "highest", "Et_lowest_m", "Et_highest_m", "Et_relative_slope",
     "Et_relative_slope_low", "Et_relative_slope_high", "Et_rises", "records"});

}  // namespace

ReportDocument noise_document(const std::vector<std::filesystem::path>& folders, int jobs, bool quiet,
                              const std::filesystem::path& out) {
  constexpr int n_steps = 4;
  Progress progress("parts of the report", n_steps, quiet);
  const std::vector<NoiseSweep> sweeps = read_noise_sweeps(folders);
  progress.advance();
  std::vector<NoiseLevelRow> levels;
  std::vector<AchievedNoiseRow> achieved;
  for (const NoiseSweep& sweep : sweeps) {
    for (NoiseLevelRow& row : noise_levels(sweep, jobs)) levels.push_back(std::move(row));
    for (AchievedNoiseRow& row : achieved_noise_rows(sweep)) achieved.push_back(std::move(row));
  }
  progress.advance();
  ReportDocument document;
  document.title = "Noise and errors";
  document.abstract = "Errors of camera and objects by noise level, from the records of " + joined(folders) +
                      ". Intervals are 95 %, bootstrapped over seeds.";
  const RecordPlaces places = out.empty() ? RecordPlaces() : record_places(folders, sweeps);
  const auto add = [&](const char* heading, NamedTable named, std::vector<Figure> figures = {}) {
    if (named.table.rows.empty()) return;
    named.split_by = split_keys;
    ReportSection& section = document.sections.emplace_back(
        ReportSection{named.name + "-section", heading, {}, {}, std::move(figures), {}});
    section.tables.push_back(std::move(named));
  };
  const auto linked = [&](Table table, const auto& rows) {
    add_record_links(rows, places, out, table);
    return table;
  };
  std::vector<Figure> of_bodies = noise_level_figures(levels);
  const auto of_estimators = std::ranges::stable_partition(
      of_bodies, [](const Figure& figure) { return !figure.name.starts_with("estimators_"); });
  size_t n_left_out = 0;
  const std::vector<ComparisonRow> comparisons = compare_estimators(sweeps, jobs, {}, &n_left_out);
  add("Estimators compared",
      {.name = "comparisons",
       .table = linked(comparison_table(comparisons), comparisons),
       .first = first_of_comparisons},
      {of_estimators.begin(), of_estimators.end()});
  of_bodies.erase(of_estimators.begin(), of_estimators.end());
  progress.advance();
  add("Errors by noise level",
      {.name = "noise_levels", .table = linked(noise_level_table(levels), levels), .first = first_of_levels},
      std::move(of_bodies));
  add("Errors that fall", {.name = "falling_errors", .table = falling_error_table(falling_errors(sweeps))});
  const std::vector<TrendRow> trends = noise_trends(sweeps, jobs);
  add("Growth", {.name = "trends", .table = linked(trend_table(trends), trends), .first = first_of_trends});
  add("Summaries", {.name = "summaries", .table = summary_limits(sweeps, comparisons, n_left_out)});
  Table achieved_table = achieved_noise_table(achieved);
  if (!out.empty()) {
    std::vector<std::string> addresses;
    for (const AchievedNoiseRow& row : achieved) addresses.push_back(address_from(out, row.file));
    add_addresses("achieved_px", addresses, achieved_table);
  }
  add("Achieved noise",
      {.name = "achieved_noise", .table = std::move(achieved_table), .only_on_request = true},
      achieved_noise_figures(achieved));
  progress.advance();
  document.provenance = {{"records", joined(folders)}, {"report by", "sextant " + version()}};
  document.citation = citation();
  return document;
}

ReportDocument report_sweeps(const std::vector<std::filesystem::path>& folders,
                             const std::filesystem::path& out, const ReportFolderOptions& options) {
  const auto lock = lock_folder(out);
  ReportDocument document = noise_document(folders, options.jobs, options.quiet, out);
  if (document.sections.empty())
    fail("no pair with truth in any of the {} folders: nothing to report", folders.size());
  if (!out.empty()) {
    write_output_folder(out, [&](const FileWriter& write) { make_report_folder(document, options, write); });
  }
  return document;
}

}  // namespace sextant
