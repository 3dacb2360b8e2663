#include "sextant/eval/evaluation/object_report.h"

#include <algorithm>
#include <array>
#include <set>

#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

struct ErrorTitle {
  const char* key;
  const char* file;
  const char* title;
};
constexpr auto error_titles =
    std::to_array<ErrorTitle>({{"Et_m", "Et_camera", "E_t, camera frame [m]"},
                               {"ER_deg", "ER_camera", "E_R, camera frame [deg]"},
                               {"Et_world_m", "Et_world", "E_t, world frame [m]"},
                               {"ER_world_deg", "ER_world", "E_R, world frame [deg]"},
                               {"Et_body_m", "Et_body", "E_t, body frame [m]"},
                               {"ER_body_deg", "ER_body", "E_R, body frame [deg]"}});

/// Selects the entries of error_titles that the presets use.
std::vector<ErrorTitle> errors_of(std::span<const MetricPreset> presets) {
  std::vector<ErrorTitle> used;
  std::ranges::copy_if(error_titles, std::back_inserter(used), [&](const ErrorTitle& error) {
    return std::ranges::any_of(presets, [&](const MetricPreset& preset) {
      return preset.object_Et_key == error.key || preset.object_ER_key == error.key;
    });
  });
  return used;
}

/// Pooled aggregate with its interval, for one error of one system.
std::vector<Cell> pooled_cells(const std::vector<SystemSummary>& summaries, const std::string& system,
                               Aggregate how) {
  const auto s = std::ranges::find(summaries, system, &SystemSummary::name);
  if (s == summaries.end()) return {Cell(), Cell(), Cell()};
  const std::optional<Interval>& interval = how == Aggregate::rmse ? s->rmse_interval : s->mean_interval;
  return {how == Aggregate::rmse ? s->pooled.rmse : s->pooled.mean, interval ? Cell(interval->low) : Cell(),
          interval ? Cell(interval->high) : Cell()};
}

/// Counts of a system: its runs, and its true and estimated steps.
struct SystemCount {
  std::map<uint64_t, int> runs;
  int n_truth = 0, n_estimated = 0;
};

std::map<std::string, SystemCount> counts_of(const std::vector<Record>& records) {
  std::map<std::string, SystemCount> counts;
  for (const Record& record : records) {
    SystemCount& count = counts[record.estimator];
    ++count.runs[record.seed];
    count.n_truth += record.status != Status::no_truth;
    count.n_estimated += record.status == Status::ok;
  }
  return counts;
}

/// Section with the paths of the camera and the objects, and states, speeds and errors over time.
ReportSection path_section(const ObjectScores& scores, const MetricPreset& preset) {
  const std::vector<Record>& records = scores.records;
  ReportSection section{"paths", "Paths and steps over time", {}, {}, object_path_figures(scores.tracks), {}};
  Explorer explorer = object_explorer(scores.tracks, records, preset.object_Et_key, preset.object_ER_key);
  if (!explorer.paths.empty()) section.explorers.push_back(std::move(explorer));
  std::ranges::move(object_state_figures(records), std::back_inserter(section.figures));
  std::ranges::move(speed_figures(records, {}), std::back_inserter(section.figures));
  std::ranges::move(timeline_figures(records, preset), std::back_inserter(section.figures));
  Figure tracklets = tracklet_figure(records);
  if (!tracklets.data.rows.empty()) section.figures.push_back(std::move(tracklets));
  return section;
}

/// Returns the errors called `key` of all records that have it, grouped by run; the systems are the
/// estimators of the records.
std::vector<RunErrors> object_run_errors(const std::vector<Record>& records, const std::string& key) {
  std::vector<RunErrors> runs;
  std::map<std::pair<uint64_t, std::string>, size_t> known;
  for (const Record& record : records) {
    const auto [run, is_new] = known.try_emplace({record.seed, record.estimator}, runs.size());
    if (is_new)
      runs.push_back({record.estimator, fmt::format("{} {}", record.estimator, record.seed + 1), {}, {}, 0});
    const auto error = find_number(record.errors, key);
    if (!error) continue;
    runs[run->second].errors.push_back(*error);
    runs[run->second].steps.emplace_back(body_order(record.body), record.frame);
  }
  return runs;
}

}  // namespace

Table object_system_table(const std::vector<Record>& records, std::span<const MetricPreset> presets) {
  Table table{
      "All objects and runs of each system",
      "Errors of all runs pooled, never averaged as RMSEs; 95 % intervals by the bootstrap over runs, which "
      "needs five.",
      {Column::text("preset"), Column::text("system"), Column::count("runs"),
       Column::number("coverage_percent", "coverage [%]", 1), Column::number("Et_m", "E_t [m]", 4),
       Column::number("Et_low_m", "from", 4), Column::number("Et_high_m", "to", 4),
       Column::number("ER_deg", "E_R [deg]", 4), Column::number("ER_low_deg", "from", 4),
       Column::number("ER_high_deg", "to", 4)}};
  const auto counts = counts_of(records);
  for (const MetricPreset& preset : presets) {
    const auto Et = summarize_systems(object_run_errors(records, preset.object_Et_key));
    const auto ER = summarize_systems(object_run_errors(records, preset.object_ER_key));
    for (const auto& [system, count] : counts) {
      std::vector<Cell> row = {preset.name, system, count.runs.size(),
                               count.n_truth > 0 ? Cell(100.0 * count.n_estimated / count.n_truth) : Cell()};
      std::ranges::move(pooled_cells(Et, system, preset.aggregate), std::back_inserter(row));
      std::ranges::move(pooled_cells(ER, system, preset.aggregate), std::back_inserter(row));
      table.add_row(std::move(row));
    }
  }
  return table;
}

Table object_comparison_table(const std::vector<Record>& records, std::span<const MetricPreset> presets) {
  Table table{
      "Comparison of systems: difference of mean error",
      "Over the steps that both have. Sign-flip test over blocks of successive frames, two-sided, p adjusted "
      "after Holm within each error. The differences of the objects of a frame are averaged first, because "
      "they share the error of the camera.",
      {Column::text("error"), Column::text("a"), Column::text("b"), Column::count("n_common", "steps"),
       Column::count("stretches", "blocks"), Column::number("mean_difference", "a - b", 5),
       Column::p_value("p")}};
  for (const ErrorTitle& error : errors_of(presets)) {
    const std::vector<SystemComparison> comparisons =
        compare_systems(object_run_errors(records, error.key), IndependentUnit::blocks);
    for (const SystemComparison& c : comparisons)
      table.add_row({error.title, c.a, c.b, c.n_common, c.n_blocks, c.difference, c.p_corrected});
    for (std::string& note : notes_on_missing_p(comparisons)) add_distinct(std::move(note), table.notes);
  }
  return table;
}

std::string FrameRate::text() const { return fmt::format("{:.6g} Hz ({})", hz, source); }

std::string ObjectScores::rate_text() const {
  std::set<std::string> texts;
  for (const auto& [system, rate] : rates) texts.insert(rate.text());
  if (texts.size() == 1) return "Frame rate: " + *texts.begin();
  std::vector<std::string> of_systems;
  for (const auto& [system, rate] : rates) of_systems.push_back(system + " " + rate.text());
  return fmt::format("Frame rates: {}", fmt::join(of_systems, ", "));
}

void warn_of_other_truth(ObjectScores& scores) {
  using Run = std::pair<std::string, uint64_t>;
  std::map<Run, std::map<ObjectFrame, double>> speeds_of;  // km/h
  std::vector<Run> runs;
  for (const Record& record : scores.records) {
    const auto v_kmh = find_number(record.values, "v_gt_kmh");
    if (!v_kmh) continue;
    const Run run(record.estimator, record.seed);
    add_distinct(run, runs);
    speeds_of[run][{body_order(record.body), record.frame}] = *v_kmh;
  }
  constexpr double least_kmh = 1, least_share = 0.05;
  for (size_t i = 1; i < runs.size(); ++i) {
    const auto &first = speeds_of[runs[0]], &speeds = speeds_of[runs[i]];
    size_t n_common = 0, n_different = 0;
    std::string example;
    for (const ObjectFrame& step : common_keys<std::map<ObjectFrame, double>>({&first, &speeds})) {
      const double a = first.at(step), b = speeds.at(step);
      ++n_common;
      if (std::abs(a - b) <= least_kmh + least_share * std::max(a, b)) continue;
      if (++n_different == 1)
        example = fmt::format("object {} at frame {}: {:.1f} and {:.1f} km/h", step.first, step.second, b, a);
    }
    if (2 * n_different <= n_common) continue;
    DataWarning warning{
        "other_truth",
        fmt::format(
            "{} run {}: its true speeds differ from those of {} run {} at {} of {} common steps ({}): "
            "logs of another recording, or other object ids? Then their comparison means nothing",
            runs[i].first, runs[i].second + 1, runs[0].first, runs[0].second + 1, n_different, n_common,
            example)};
    scores.warnings.push_back(warning.text);
    scores.diagnoses.push_back(std::move(warning));
  }
}

void leave_out_repeated_runs(ObjectScores& scores) {
  std::map<std::string, std::map<uint64_t, std::vector<const Record*>>> systems;
  for (const Record& record : scores.records) systems[record.estimator][record.seed].push_back(&record);
  const auto is_same = [](const Record* a, const Record* b) {
    return a->body == b->body && a->frame == b->frame && a->status == b->status && a->errors == b->errors;
  };
  std::set<std::pair<std::string, uint64_t>> repeated;
  for (const auto& [system, runs] : systems) {
    for (auto run = runs.begin(); run != runs.end(); ++run) {
      const auto same = std::find_if(runs.begin(), run, [&](const auto& other) {
        return std::ranges::equal(run->second, other.second, is_same);
      });
      if (same == run) continue;
      repeated.emplace(system, run->first);
      scores.warnings.push_back(
          fmt::format("{}: run {} has the same errors as run {}: a log given twice, or a system without any "
                      "randomness? Run {} is left out",
                      system, run->first + 1, same->first + 1, run->first + 1));
    }
  }
  const auto is_repeated = [&](const auto& result) { return repeated.contains({result.system, result.run}); };
  std::erase_if(scores.paths, is_repeated);
  std::erase_if(scores.consistency, is_repeated);
  std::erase_if(scores.tracks, is_repeated);
  std::erase_if(scores.records, [&](const Record& r) { return repeated.contains({r.estimator, r.seed}); });
}

Json object_json(const ObjectScores& scores, std::span<const MetricPreset> presets) {
  const std::vector<Record>& records = scores.records;
  Json json;
  json["schema"] = 1;
  json["rates"] = Json::array();
  for (const auto& [system, rate] : scores.rates)
    json["rates"].push_back({{"system", system}, {"hz", rate.hz}, {"source", rate.source}});
  json["presets"] = Json::array();
  for (const MetricPreset& preset : presets) {
    json["presets"].push_back({{"preset", preset.name},
                               {"aggregate", std::string(to_string(preset.aggregate))},
                               {"rows", rows_to_json(object_table(records, {&preset, 1}))}});
  }
  json["systems"] = rows_to_json(object_system_table(records, presets));
  json["comparisons"] = rows_to_json(object_comparison_table(records, presets));
  json["poses"] = rows_to_json(object_path_table(scores.paths));
  json["pose_axes"] = rows_to_json(object_axis_table(scores.paths));
  json["nees"] = rows_to_json(object_consistency_table(scores.consistency));
  json["diagnoses"] = Json::array();
  for (const DataWarning& diagnosis : scores.diagnoses)
    json["diagnoses"].push_back({{"code", diagnosis.code}, {"text", diagnosis.text}});
  json["warnings"] = scores.warnings;
  return json;
}

const MetricPreset& usual_preset(const std::vector<Record>& records) {
  for (const MetricPreset& preset : metric_presets()) {
    const auto has_error = [&](const Record& record) {
      return find_number(record.errors, preset.object_Et_key).has_value();
    };
    if (std::ranges::any_of(records, has_error)) return preset;
  }
  return metric_presets().front();
}

Table object_screen_table(const std::vector<Record>& records, const MetricPreset& preset) {
  Table table = with_columns(object_table(records, {&preset, 1}),
                             {"estimator", "object", "n_truth", "n_estimated", "coverage_percent", "Et_m",
                              "ER_deg", "Ev_kmh", "v_gt_kmh", "other"});
  table.title = "Object motions";
  table.caption = fmt::format("Preset {}: {} ({}). --preset all prints the others.", preset.name,
                              preset.description, to_string(preset.aggregate));
  table.notes.clear();
  return table;
}

std::string ObjectScores::frame_text() const {
  std::string text;
  for (const auto& [system, frame] : assumed_frames) {
    text += fmt::format(
        "{}Frame of the motions of {}: {}, which nothing in the log can confirm, because it holds no poses "
        "of the objects; --truth SOURCE checks it, --frame changes it.",
        text.empty() ? "" : " ", system, to_string(frame));
  }
  return text;
}

ReportDocument object_document(const ObjectScores& scores, std::span<const MetricPreset> presets) {
  const std::vector<Record>& records = scores.records;
  const std::vector<std::string>&folders = scores.folders, &warnings = scores.warnings;
  ReportDocument document;
  document.title = "Object motions";
  document.abstract = fmt::format(
      "{} of logs under {} presets. {}. {}{}Definitions: docs/metrics.md.",
      folders.size() == 1 ? "One folder" : fmt::format("{} folders", folders.size()), presets.size(),
      scores.rate_text(), scores.frame_text(), scores.assumed_frames.empty() ? "" : " ");
  const Table systems = object_system_table(records, presets), objects = object_table(records, presets),
              comparison = object_comparison_table(records, presets);
  ReportSection overall{"overall", systems.title, {}, {{"systems", systems}}, {}, {}};
  if (!comparison.rows.empty()) overall.tables.push_back({"comparison", comparison});
  document.sections.push_back(std::move(overall));
  document.sections.push_back(
      path_section(scores, presets.size() == 1 ? presets.front() : usual_preset(records)));
  document.sections.push_back(
      {"per_object", objects.title, {}, {{"objects", objects, {"preset", "estimator"}}}, {}, {}});
  if (!scores.paths.empty()) {
    const Table paths = object_path_table(scores.paths), axes = object_axis_table(scores.paths);
    ReportSection poses{"object_paths", paths.title, {}, {{"poses", paths}}, {}, {}};
    if (!axes.rows.empty()) poses.tables.push_back({"pose_axes", axes});
    document.sections.push_back(std::move(poses));
  }
  if (!scores.consistency.empty()) {
    const Table nees = object_consistency_table(scores.consistency);
    document.sections.push_back({"consistency", nees.title, {}, {{"nees", nees}}, {}, {}});
  }
  ReportSection distributions{"distributions", "Distribution of the errors per step", {}, {}, {}, {}};
  const SystemStyles styles = styles_of(records);
  for (const ErrorTitle& error : errors_of(presets)) {
    const std::vector<RunErrors> runs = object_run_errors(records, error.key);
    const auto colour = [&](const RunErrors& run, size_t) { return styles.colour(run.system); };
    const std::vector<Distribution> of_systems = by_system(runs, colour);
    if (of_systems.empty()) continue;
    distributions.figures.push_back(
        cumulative_figure(fmt::format("{}_cdf", error.file), error.title, of_systems));
    distributions.figures.push_back(
        box_figure(fmt::format("{}_boxes", error.file), error.title, by_run(runs, colour)));
  }
  if (!distributions.figures.empty()) document.sections.push_back(std::move(distributions));
  if (!warnings.empty()) document.sections.push_back({"warnings", "Warnings", warnings, {}, {}, {}});
  document.provenance = {{"sextant", fmt::format("{} ({})", version(), git_commit())}};
  for (const std::string& folder : folders) document.provenance.emplace_back("logs", folder);
  document.citation = citation();
  return document;
}

}  // namespace sextant
