#include "sextant/eval/workflow/report_output.h"

#include "sextant/base/error.h"
#include "sextant/base/safe_paths.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/evaluation/evo_result.h"
#include "sextant/eval/evaluation/trajectory_figures.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/html/html.h"

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

}  // namespace sextant
