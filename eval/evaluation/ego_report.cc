#include "sextant/eval/evaluation/ego_report.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/run_summary.h"

namespace sextant {
namespace {

/// Adds how many steps E_t and E_R leave out.
void note_left_out(const std::vector<EgoResult>& runs, Table& table) {
  for (const EgoResult& r : runs) {
    if (r.per_frame.n_left_out == 0) continue;
    table.notes.push_back(fmt::format(
        "{}: E_t and E_R leave out {} of {} steps between matched poses, which are not one frame apart",
        r.name, r.per_frame.n_left_out, r.per_frame.n_left_out + r.per_frame.Et_m.size()));
  }
}

/// The columns of statistics of errors, without the sum of squares.
Fields<ErrorStatistics> statistics_fields() {
  return {{Column::number("rmse", 6), &ErrorStatistics::rmse},
          {Column::number("mean", 6), &ErrorStatistics::mean},
          {Column::number("median", 6), &ErrorStatistics::median},
          {Column::number("std", 6), &ErrorStatistics::std},
          {Column::number("min", 6), &ErrorStatistics::min},
          {Column::number("max", 6), &ErrorStatistics::max}};
}

/// Returns the function that computes a statistic of errors per frame; its cell is empty without errors.
auto statistic_of(std::vector<double> PerFrameErrors::*errors, double ErrorStatistics::*statistic) {
  return [errors, statistic](const EgoResult& r) {
    const std::vector<double>& values = r.per_frame.*errors;
    return values.empty() ? Cell() : Cell(error_statistics(values).*statistic);
  };
}

std::optional<double> translation_percent(const EgoResult& r) { return r.kitti.all.translation_percent; }
std::optional<double> rotation_deg_per_m(const EgoResult& r) { return r.kitti.all.rotation_deg_per_m; }

/// A row of the table of errors: one run, or all runs of a system together, for which `run` is null.
struct ErrorRow {
  std::string name;
  size_t n = 0;
  ErrorStatistics statistics;
  const EgoResult* run = nullptr;
};

Fields<ErrorRow> error_fields(const std::vector<EgoResult>& runs, const EgoOptions& options, bool steps) {
  const auto any = [&](const auto& has) { return steps && std::ranges::any_of(runs, has); };
  Fields<EgoResult> matched, of_steps;
  matched.add(Column::count("n_matched", "matched"), [](const EgoResult& r) { return r.estimate.size(); });
  if (any([](const EgoResult& r) { return !r.per_frame.Et_m.empty(); })) {
    of_steps.add(Column::number("Et_mean_m", "E_t [m]", 4),
                 statistic_of(&PerFrameErrors::Et_m, &ErrorStatistics::mean));
    of_steps.add(Column::number("ER_mean_deg", "E_R [deg]", 4),
                 statistic_of(&PerFrameErrors::ER_deg, &ErrorStatistics::mean));
  }
  if (any([](const EgoResult& r) { return r.kitti.all.n > 0; })) {
    of_steps.add(Column::number("translation_percent", "t_rel [%]", 4), translation_percent);
    of_steps.add(Column::number("rotation_deg_per_m", "r_rel [deg/m]", 6), rotation_deg_per_m);
  }
  Fields<ErrorRow> fields = {{Column::text("estimate"), &ErrorRow::name}};
  fields.add(matched, &ErrorRow::run);
  if (!steps || options.rpe()) fields.add(Column::count("n"), &ErrorRow::n);
  fields.add(statistics_fields(), [](const ErrorRow& row) { return &row.statistics; });
  if (!steps) fields.add(Column::number("sse", 6), [](const ErrorRow& row) { return row.statistics.sse; });
  return fields.add(of_steps, &ErrorRow::run);
}

/// Pose change errors per frame of each run; `which` selects translation or rotation.
std::vector<RunErrors> step_errors_of_runs(const std::vector<EgoResult>& runs,
                                           std::vector<double> PerFrameErrors::*which) {
  std::vector<RunErrors> out = run_errors(runs);
  for (size_t i = 0; i < runs.size(); ++i) {
    if (out[i].errors.empty()) continue;  // the same run as another one
    out[i].errors = runs[i].per_frame.*which;
    out[i].steps.clear();
    for (const int row : runs[i].per_frame.row) out[i].steps.emplace_back(0, row);
  }
  return out;
}

/// Returns the colour of run k in all figures of the page. A system has the colour of its first run.
std::string colour_of_run(const RunErrors&, size_t k) { return line_colour(k + 1); }

/// Box plot of the relative errors over each of several lengths.
Figure length_box_figure(const std::vector<EgoResult>& runs, const EgoOptions& options) {
  std::vector<BoxGroup> groups;
  for (size_t i = 0; i < options.rpe_lengths.size(); ++i) {
    BoxGroup group{options.rpe_lengths[i].text(), {}};
    for (const EgoResult& run : runs) {
      if (run.by_length[i].errors.empty()) continue;
      const auto place = static_cast<size_t>(&run - runs.data());
      group.samples.push_back({run.name, run.by_length[i].errors, colour_of_run({}, place)});
    }
    groups.push_back(std::move(group));
  }
  return grouped_box_figure("rpe_boxes", error_title(options), groups);
}

ReportSection warning_section(const std::vector<EgoResult>& runs, const EgoReference& reference) {
  ReportSection section{"warnings", "Warnings", {}, {}, {}, {}};
  for (const std::string& text : reference.warnings) section.paragraphs.push_back(text);
  for (const EgoResult& run : runs) {
    for (const DataWarning& warning : run.warnings)
      section.paragraphs.push_back(fmt::format("{} ({})", run.text_of(warning), warning.code));
  }
  return section;
}

}  // namespace

Table ego_error_table(const std::vector<EgoResult>& runs, const EgoReference& reference,
                      const EgoOptions& options, bool steps) {
  std::vector<ErrorRow> rows;
  std::vector<std::string> intervals;
  for (const EgoResult& r : runs) rows.push_back({r.name, r.errors.size(), r.statistics, &r});
  if (runs.size() > 1) {
    for (const SystemSummary& s : summarize_systems(run_errors(runs))) {
      if (s.n_runs < 2) continue;
      rows.push_back({fmt::format("{}: {} runs pooled", s.name, s.n_runs), s.n_errors, s.pooled});
      if (s.rmse_interval) {
        intervals.push_back(fmt::format(
            "{}: 95 % interval over runs of rmse {:.6f} .. {:.6f}, of mean {:.6f} .. {:.6f}", s.name,
            s.rmse_interval->low, s.rmse_interval->high, s.mean_interval->low, s.mean_interval->high));
      }
    }
  }
  const bool all_pairs = options.rpe() && options.rpe()->all_pairs;
  Table table =
      table_of(fmt::format("{} {} [{}]{}{}", options.rpe() ? "RPE" : "APE", to_string(options.relation),
                           unit_of(options.relation), options.rpe() ? " over " + options.rpe()->text() : "",
                           all_pairs ? ", all pairs" : ""),
               fmt::format("reference {} ({} poses), alignment {}", reference.side.name,
                           reference.poses.size(), to_string(options.alignment)),
               error_fields(runs, options, steps), rows);
  for (const EgoResult& r : runs) {
    if (r.offset) {
      table.notes.push_back(
          fmt::format("{}: {:+.6f} s added to its time stamps, 95 % interval {:+.6f} .. {:+.6f} s", r.name,
                      r.offset->offset_s, r.offset->low_s, r.offset->high_s));
    }
    if (r.interpolation) {
      table.notes.push_back(fmt::format(
          "{}: reference interpolated over gaps up to {:.4g} s; {} poses lie outside of it, {} in gaps "
          "longer than {:.4g} s",
          r.name, r.interpolation->largest_gap_s, r.interpolation->n_outside,
          r.interpolation->n_in_longer_gaps, *options.interpolate_max_gap_s));
    }
  }
  if (steps) note_left_out(runs, table);
  std::ranges::move(intervals, std::back_inserter(table.notes));
  return table;
}

Table ego_length_table(const std::vector<EgoResult>& runs, const EgoOptions& options) {
  if (options.rpe_lengths.size() < 2) return {};
  struct Row {
    std::string name;
    const ErrorsOverLength* over;
  };
  std::vector<Row> rows;
  for (const EgoResult& r : runs) {
    for (const ErrorsOverLength& over : r.by_length) rows.push_back({r.name, &over});
  }
  Fields<Row> fields = {{Column::text("estimate"), &Row::name},
                        {Column::text("length"), [](const Row& row) { return row.over->length.text(); }},
                        {Column::count("n"), [](const Row& row) { return row.over->errors.size(); }}};
  fields.add(statistics_fields(), [](const Row& row) { return row.over->statistics; });
  Table table =
      table_of(fmt::format("RPE {} [{}] over several lengths{}", to_string(options.relation),
                           unit_of(options.relation), options.rpe()->all_pairs ? ", all pairs" : ""),
               "", fields, rows);
  if (std::ranges::any_of(rows, [](const Row& row) { return !row.over->statistics; }))
    table.notes.push_back("-: no pair of poses is that far apart.");
  return table;
}

namespace {

/// RMSE of the relative errors over the length, one line per run.
Figure ego_length_figure(const std::vector<EgoResult>& runs, const EgoOptions& options) {
  Figure figure;
  figure.name = "rpe_lengths";
  const DeltaUnit unit = options.rpe_lengths.front().unit;
  const bool is_one_unit =
      std::ranges::all_of(options.rpe_lengths, [&](const PairSelection& s) { return s.unit == unit; });
  figure.caption = fmt::format("RMSE of the relative errors ({}) against the length between the poses.",
                               to_string(options.relation));
  figure.data.columns = {Column::number("length", 6)};
  for (size_t k = 0; k < runs.size(); ++k)
    figure.data.columns.push_back(Column::number(fmt::format("rmse_{}", k + 1), 9));
  for (size_t i = 0; i < options.rpe_lengths.size(); ++i) {
    std::vector<Cell> row = {is_one_unit ? options.rpe_lengths[i].delta : static_cast<double>(i + 1)};
    for (const EgoResult& r : runs) {
      const auto& statistics = r.by_length[i].statistics;
      row.push_back(statistics ? Cell(statistics->rmse) : Cell());
    }
    figure.data.add_row(std::move(row));
  }
  const std::string unit_text = is_one_unit ? std::string(to_string(unit)) : "number in the list";
  Panel panel{"",
              fmt::format("set xlabel {} noenhanced offset 0,0.4\nset ylabel {} noenhanced offset 0.6,0\n"
                          "set yrange [0:*]\n",
                          gp_text(fmt::format("length [{}]", unit_text)),
                          gp_text(fmt::format("RPE {} RMSE [{}]", to_string(options.relation),
                                              unit_of(options.relation)))),
              {}};
  std::vector<LegendEntry> legend;
  for (size_t k = 0; k < runs.size(); ++k) {
    const std::string style =
        fmt::format("with linespoints lc rgb '{}' pt {}", line_colour(k + 1), filled_point(k));
    panel.plots.push_back(
        fmt::format("data using (column(\"length\")):(column(\"rmse_{}\")) {}", k + 1, style));
    legend.push_back({runs[k].name, style});
  }
  set_panels({.panel_height_cm = 5.8}, legend, {panel}, figure);
  return figure;
}

}  // namespace

Table ego_consistency_table(const std::vector<EgoResult>& runs) {
  Fields<TrajectoryConsistency> of_run = {{Column::count("n"), &TrajectoryConsistency::n},
                                          {Column::count("dof", "expected"), &TrajectoryConsistency::dof}};
  Fields<EgoResult> fields = {{Column::text("estimate"), &EgoResult::name}};
  fields.add(of_run.add(consistency_fields()), &EgoResult::consistency);
  std::vector<const EgoResult*> rows;  // runs with covariances
  for (const EgoResult& r : runs) {
    if (r.consistency) rows.push_back(&r);
  }
  Table table = table_of("Consistency of the covariances: NEES after the alignment", "", fields, rows);
  table.notes.push_back(
      "The interval holds for independent errors. Errors of neighbouring poses depend on each other, so the "
      "actual interval is wider.");
  return table;
}

Table ego_step_table(const std::vector<EgoResult>& runs, const EgoReference& reference) {
  using E = PerFrameErrors;
  using S = ErrorStatistics;
  const Fields<EgoResult> fields = {
      {Column::text("estimate"), &EgoResult::name},
      {Column::count("n", "steps"), [](const EgoResult& r) { return r.per_frame.Et_m.size(); }},
      {Column::number("Et_mean_m", "E_t mean [m]", 4), statistic_of(&E::Et_m, &S::mean)},
      {Column::number("Et_rmse_m", "RMSE", 4), statistic_of(&E::Et_m, &S::rmse)},
      {Column::number("ER_mean_deg", "E_R mean [deg]", 4), statistic_of(&E::ER_deg, &S::mean)},
      {Column::number("ER_rmse_deg", "RMSE", 4), statistic_of(&E::ER_deg, &S::rmse)},
      {Column::number("ER_float_acos_mean_deg", "in floats [deg]", 4),
       statistic_of(&E::ER_float_acos_deg, &S::mean)},
      {Column::count("n_stretches", "stretches"), [](const EgoResult& r) { return r.kitti.all.n; }},
      {Column::number("translation_percent", "t_rel [%]", 4), translation_percent},
      {Column::number("rotation_deg_per_m", "r_rel [deg/m]", 6), rotation_deg_per_m},
      {Column::number("umeyama_scale", "scale", 4), &EgoResult::umeyama_scale}};
  Table table = table_of("Per frame (paper) and KITTI odometry errors", "", fields, runs);
  for (const EgoResult& r : runs) {
    if (r.kitti.all.n == 0 && r.has_rotations()) {
      table.notes.push_back(
          fmt::format("{}: KITTI odometry errors need 100 m of path; the reference has {:.1f} m", r.name,
                      r.kitti.path_m));
    }
  }
  note_left_out(runs, table);
  table.remarks.emplace_back(
      "in floats: mean E_R as computed by programs in single precision, by acos of the trace; only values "
      "above 0 count. It is too large for small angles; numbers published for ORB-SLAM3 are of this kind.");
  for (const EgoResult& r : runs) {
    if (const auto errors = step_errors(r.per_frame.row, r.per_frame.step_error_m))
      table.remarks.push_back(fmt::format("{}: estimated minus true step: {}", r.name, errors->text()));
  }
  if (reference.step_floor_m) {
    table.notes.push_back(fmt::format(
        "Ground-truth floor: the true steps have errors of {:.4f} m RMS along the path; E_t cannot be "
        "resolved below this.",
        *reference.step_floor_m));
  }
  return table;
}

Table ego_comparison_table(const std::vector<EgoResult>& runs, const EgoOptions& options) {
  const bool has_blocks = unit_of_errors(options) == IndependentUnit::blocks;
  using C = SystemComparison;
  Fields<C> fields = {{Column::text("a"), &C::a},
                      {Column::text("b"), &C::b},
                      {Column::count("n_common", "poses"), &C::n_common}};
  if (has_blocks) fields.add(Column::count("stretches", "blocks"), &C::n_blocks);
  if (!has_blocks) fields.add(Column::count("runs_a", "runs of a"), &C::n_runs_a);
  if (!has_blocks) fields.add(Column::count("runs_b", "runs of b"), &C::n_runs_b);
  fields.add(Column::number("mean_difference", "a - b", 6), &C::difference);
  fields.add(Column::number("p", 4), &C::p_corrected);
  const std::vector<C> comparisons = compare_systems(run_errors(runs), unit_of_errors(options));
  Table table = table_of(
      fmt::format("Comparison of systems: difference of mean error [{}]", unit_of(options.relation)),
      has_blocks ? "Sign-flip test over blocks of successive poses, two-sided, p adjusted after Holm."
                 : "Exact Mann-Whitney test of the mean errors of the runs, two-sided, p adjusted after "
                   "Holm: absolute errors along one path depend on each other, so the runs are the "
                   "independent units.",
      fields, comparisons);
  int fewest_a = 0, fewest_b = 0;
  for (const C& c : comparisons) {
    if (!has_blocks && c.p && (fewest_a == 0 || c.n_runs_a + c.n_runs_b < fewest_a + fewest_b)) {
      fewest_a = c.n_runs_a;
      fewest_b = c.n_runs_b;
    }
  }
  if (fewest_a > 0) {
    table.notes.push_back(fmt::format("The smallest p that {} and {} runs can give is {:.4f}, before Holm.",
                                      fewest_a, fewest_b, smallest_p_of_runs(fewest_a, fewest_b)));
  }
  std::ranges::move(notes_on_missing_p(comparisons), std::back_inserter(table.notes));
  return table;
}

ReportDocument ego_document(const std::vector<EgoResult>& runs, const EgoReference& reference,
                            const EgoOptions& options, const EgoCurves& curves) {
  const std::vector<RunErrors> errors_of_runs = run_errors(runs);
  const std::vector<Distribution> systems = by_system(errors_of_runs, colour_of_run);
  ReportDocument document;
  document.title = "Camera trajectories against " + reference.side.name;
  document.abstract =
      fmt::format("{} trajectories of {} systems, alignment {}. Definitions: docs/metrics.md, Trajectories.",
                  runs.size(), systems.size(), to_string(options.alignment));
  const Table errors = ego_error_table(runs, reference, options);
  const std::string& axis = curves.error_title;
  ReportSection section{"error", errors.title, {}, {{"errors", errors}}, {}, {}};
  section.figures.push_back(cumulative_figure("error_cdf", axis, systems));
  section.figures.push_back(box_figure("error_boxes", axis, by_run(errors_of_runs, colour_of_run)));
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
  NamedTable named{.name = "steps", .table = steps};
  named.first = {"estimate",    "n",           "Et_mean_m",           "Et_rmse_m",
                 "ER_mean_deg", "ER_rmse_deg", "translation_percent", "rotation_deg_per_m"};
  ReportSection per_frame{"per_frame", steps.title, {}, {std::move(named)}, {}, {}};
  const auto Et = by_system(step_errors_of_runs(runs, &PerFrameErrors::Et_m), colour_of_run);
  const auto ER = by_system(step_errors_of_runs(runs, &PerFrameErrors::ER_deg), colour_of_run);
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
