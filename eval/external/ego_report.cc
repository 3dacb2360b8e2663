#include "sextant/eval/external/ego_report.h"

#include <algorithm>
#include <filesystem>

#include "sextant/base/error.h"
#include "sextant/eval/experiment/version.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

std::vector<double> sorted(std::vector<double> values) {
  SEXTANT_CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  return values;
}

std::string joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", \\\n     ") + part;
  return text;
}

/// Errors of all runs by system, in order of first appearance.
template <typename Errors>
std::vector<ErrorSample> by_system(const std::vector<EgoResult>& runs, const Errors& errors_of) {
  std::vector<ErrorSample> samples;
  for (const EgoResult& run : runs) {
    const std::vector<double>& errors = errors_of(run);
    if (errors.empty()) continue;
    auto sample = std::ranges::find(samples, run.system, &ErrorSample::title);
    if (sample == samples.end()) sample = samples.insert(samples.end(), {run.system, {}});
    sample->values.insert(sample->values.end(), errors.begin(), errors.end());
  }
  return samples;
}

std::vector<ErrorSample> by_run(const std::vector<EgoResult>& runs) {
  std::vector<ErrorSample> samples;
  for (const EgoResult& run : runs)
    samples.push_back({std::filesystem::path(run.name).stem().string(), run.errors});
  return samples;
}

ReportSection warning_section(const std::vector<EgoResult>& runs, const EgoReference& reference) {
  ReportSection section{"warnings", "Warnings", {}, {}, {}, {}};
  for (const std::string& text : reference.warnings) section.paragraphs.push_back(text);
  for (const EgoResult& run : runs) {
    for (const TrajectoryWarning& warning : run.warnings)
      section.paragraphs.push_back(fmt::format("{}: {} ({})", run.name, warning.text, warning.code));
  }
  return section;
}

}  // namespace

Figure cumulative_figure(const std::string& name, const std::string& axis,
                         const std::vector<ErrorSample>& samples) {
  constexpr int n_steps = 100;
  Figure figure;
  figure.name = name;
  figure.caption = fmt::format("Cumulative distribution: the share of errors that are at most x. {}.", axis);
  figure.data.columns = {{"share", "share"}};
  std::vector<std::vector<double>> values;
  std::vector<std::string> lines;
  for (size_t i = 0; i < samples.size(); ++i) {
    values.push_back(sorted(samples[i].values));
    figure.data.columns.push_back({fmt::format("quantile_{}", i + 1), samples[i].title});
    lines.push_back(
        fmt::format("data using (column(\"quantile_{}\")):(column(\"share\")) with lines lw 1.5 "
                    "lc rgb \"{}\" dt {} title {}",
                    i + 1, line_colour(i), i % 5 + 1, gp_text(samples[i].title)));
  }
  for (int k = 0; k <= n_steps; ++k) {
    const double share = static_cast<double>(k) / n_steps;
    std::vector<Cell> row = {share};
    for (const std::vector<double>& of_sample : values)
      row.emplace_back(quantile_of_sorted(of_sample, share));
    figure.data.add_row(std::move(row));
  }
  figure.script = fmt::format(
      "set xlabel {}\nset ylabel \"share of errors\"\nset yrange [0:1]\nset xrange [0:*]\n"
      "set key bottom right noenhanced\nplot {}\n",
      gp_text(axis), joined(lines));
  return figure;
}

Figure box_figure(const std::string& name, const std::string& axis, const std::vector<ErrorSample>& samples) {
  Figure figure;
  figure.name = name;
  figure.caption = fmt::format("Boxes: quartiles and median; whiskers: 5 % and 95 % quantiles. {}.", axis);
  figure.data.columns = {{"position", "position"},
                         {"title", "title", Align::left},
                         {"q05", "q05"},
                         {"q25", "q25"},
                         {"q50", "q50"},
                         {"q75", "q75"},
                         {"q95", "q95"}};
  std::string tics;
  std::vector<std::string> parts;
  for (size_t i = 0; i < samples.size(); ++i) {
    const std::vector<double> values = sorted(samples[i].values);
    const auto position = static_cast<double>(i + 1);
    std::vector<Cell> row = {position, samples[i].title};
    for (const double p : {0.05, 0.25, 0.5, 0.75, 0.95}) row.emplace_back(quantile_of_sorted(values, p));
    figure.data.add_row(std::move(row));
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", gp_text(samples[i].title), position);
  }
  parts.push_back(fmt::format(
      "data using "
      "(column(\"position\")):(column(\"q25\")):(column(\"q05\")):(column(\"q95\")):(column(\"q75\")) "
      "with candlesticks whiskerbars 0.5 lc rgb \"{0}\" fs transparent solid 0.25 border lc rgb \"{0}\" "
      "notitle",
      line_colour(0)));
  parts.emplace_back(
      "data using "
      "(column(\"position\")):(column(\"q50\")):(column(\"q50\")):(column(\"q50\")):(column(\"q50\")) "
      "with candlesticks lc rgb \"black\" lw 1.5 notitle");
  figure.script = fmt::format(
      "set boxwidth 0.5\nset xrange [0.4:{}]\nset yrange [0:*]\nset xtics ({}) {}\nset ylabel {}\nplot {}\n",
      static_cast<double>(samples.size()) + 0.6, tics,
      samples.size() > 3 ? "noenhanced rotate by -30" : "noenhanced", gp_text(axis), joined(parts));
  return figure;
}

ReportDocument ego_document(const std::vector<EgoResult>& runs, const EgoReference& reference,
                            const EgoOptions& options) {
  ReportDocument document;
  document.title = "Camera trajectories against " + reference.side.name;
  document.abstract = fmt::format(
      "{} trajectories of {} systems, alignment {}. Definitions: docs/metrics.md, Trajectories.", runs.size(),
      by_system(runs, [](const EgoResult& r) -> const std::vector<double>& { return r.errors; }).size(),
      to_string(options.alignment));
  const Table errors = ego_error_table(runs, reference, options);
  std::string axis = fmt::format("{} {} [{}]", options.rpe ? "RPE" : "APE", to_string(options.relation),
                                 unit_of(options.relation));
  std::ranges::replace(axis, '_', ' ');  // gnuplot would make it a subscript
  ReportSection section{"error", errors.title, {}, {{"errors", errors}}, {}, {}};
  section.figures.push_back(cumulative_figure(
      "error_cdf", axis,
      by_system(runs, [](const EgoResult& r) -> const std::vector<double>& { return r.errors; })));
  section.figures.push_back(box_figure("error_boxes", axis, by_run(runs)));
  const Table comparison = ego_comparison_table(runs, options);
  if (!comparison.rows.empty()) section.tables.push_back({"comparison", comparison});
  document.sections.push_back(std::move(section));

  const Table steps = ego_step_table(runs, reference);
  ReportSection per_frame{"per_frame", steps.title, {}, {{"steps", steps}}, {}, {}};
  const auto Et =
      by_system(runs, [](const EgoResult& r) -> const std::vector<double>& { return r.per_frame.Et_m; });
  const auto ER =
      by_system(runs, [](const EgoResult& r) -> const std::vector<double>& { return r.per_frame.ER_deg; });
  if (!Et.empty()) per_frame.figures.push_back(cumulative_figure("step_Et_cdf", "E_t per frame [m]", Et));
  if (!ER.empty()) per_frame.figures.push_back(cumulative_figure("step_ER_cdf", "E_R per frame [deg]", ER));
  document.sections.push_back(std::move(per_frame));
  ReportSection warnings = warning_section(runs, reference);
  if (!warnings.paragraphs.empty()) document.sections.push_back(std::move(warnings));
  document.provenance = {{"sextant", fmt::format("{} ({})", version(), git_commit())},
                         {"reference", reference.side.name}};
  for (const EgoResult& run : runs) document.provenance.emplace_back("estimate of " + run.system, run.name);
  document.citation = citation();
  return document;
}

}  // namespace sextant
