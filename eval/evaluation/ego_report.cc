#include "sextant/eval/evaluation/ego_json.h"

#include "sextant/eval/evaluation/distribution_figures.h"
#include "sextant/eval/evaluation/trajectory_figures.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {
namespace {

/// Pose change errors per frame of each run; `which` selects translation or rotation.
std::vector<RunErrors> step_errors_of_runs(const std::vector<EgoResult>& runs,
                                           std::vector<double> PerFrameErrors::*which) {
  std::vector<RunErrors> out = run_errors(runs);
  for (size_t i = 0; i < runs.size(); ++i) {
    out[i].errors = runs[i].per_frame.*which;
    out[i].steps.clear();
    for (const int row : runs[i].per_frame.row) out[i].steps.emplace_back(0, row);
  }
  return out;
}

/// Box plot of the relative errors over each of several lengths.
Figure length_box_figure(const std::vector<EgoResult>& runs, const EgoOptions& options) {
  std::vector<BoxGroup> groups;
  for (size_t i = 0; i < options.rpe_lengths.size(); ++i) {
    BoxGroup group{options.rpe_lengths[i].text(), {}};
    for (const EgoResult& run : runs) {
      if (!run.by_length[i].errors.empty()) group.samples.push_back({run.name, run.by_length[i].errors});
    }
    groups.push_back(std::move(group));
  }
  return grouped_box_figure("rpe_boxes", error_title(options), groups);
}

ReportSection warning_section(const std::vector<EgoResult>& runs, const EgoReference& reference) {
  ReportSection section{"warnings", "Warnings", {}, {}, {}, {}};
  for (const std::string& text : reference.warnings) section.paragraphs.push_back(text);
  for (const EgoResult& run : runs) {
    for (const TrajectoryWarning& warning : run.warnings)
      section.paragraphs.push_back(fmt::format("{} ({})", run.text_of(warning), warning.code));
  }
  return section;
}

}  // namespace

ReportDocument ego_document(const std::vector<EgoResult>& runs, const EgoReference& reference,
                            const EgoOptions& options, const EgoCurves& curves) {
  const std::vector<RunErrors> errors_of_runs = run_errors(runs);
  const std::vector<Distribution> systems = by_system(errors_of_runs);
  ReportDocument document;
  document.title = "Camera trajectories against " + reference.side.name;
  document.abstract =
      fmt::format("{} trajectories of {} systems, alignment {}. Definitions: docs/metrics.md, Trajectories.",
                  runs.size(), systems.size(), to_string(options.alignment));
  const Table errors = ego_error_table(runs, reference, options);
  const std::string& axis = curves.error_title;
  ReportSection section{"error", errors.title, {}, {{"errors", errors}}, {}, {}};
  section.figures.push_back(cumulative_figure("error_cdf", axis, systems));
  section.figures.push_back(box_figure("error_boxes", axis, by_run(errors_of_runs)));
  if (const Table lengths = ego_length_table(runs, options); !lengths.rows.empty()) {
    section.tables.push_back({"lengths", lengths});
    section.figures.push_back(ego_length_figure(runs, options));
    section.figures.push_back(length_box_figure(runs, options));
  }
  if (const Table consistency = ego_consistency_table(runs); !consistency.rows.empty())
    section.tables.push_back({"consistency", consistency});
  const Table comparison = ego_comparison_table(runs, options);
  if (!comparison.rows.empty()) section.tables.push_back({"comparison", comparison});
  document.sections.push_back(std::move(section));
  ReportSection paths{"paths", "Paths", {}, {}, path_figures(curves), {}};
  paths.explorers.push_back(ego_explorer(curves));
  document.sections.push_back(std::move(paths));
  document.sections.push_back({"along", "Along the path", {}, {}, along_figures(curves), {}});

  const Table steps = ego_step_table(runs, reference);
  ReportSection per_frame{"per_frame", steps.title, {}, {{"steps", steps}}, {}, {}};
  const auto Et = by_system(step_errors_of_runs(runs, &PerFrameErrors::Et_m));
  const auto ER = by_system(step_errors_of_runs(runs, &PerFrameErrors::ER_deg));
  if (!Et.empty()) per_frame.figures.push_back(cumulative_figure("step_Et_cdf", "E_t per frame [m]", Et));
  if (!ER.empty()) per_frame.figures.push_back(cumulative_figure("step_ER_cdf", "E_R per frame [deg]", ER));
  document.sections.push_back(std::move(per_frame));
  ReportSection warnings = warning_section(runs, reference);
  if (!warnings.paragraphs.empty()) document.sections.push_back(std::move(warnings));
  document.provenance = {{"sextant", fmt::format("{} ({})", version(), git_commit())},
                         {"reference", reference.side.name}};
  for (const EgoResult& run : runs) document.provenance.emplace_back("estimate of " + run.system, run.file);
  document.citation = citation();
  return document;
}

}  // namespace sextant
