#include "sextant/eval/workflow/workflow.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/eval/check/check_report.h"
#include "sextant/eval/diagnosis/motion_readings.h"
#include "sextant/eval/evaluation/ego_report.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/noise_tables.h"
#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/report/trends.h"
#include "sextant/eval/view/run_report.h"

namespace sextant {

// ---- runs and sweeps

namespace {

/// Merges the options below "noise" over the noise of the configuration. The scale of a profile is merged
/// over `text`, from which that noise was parsed, because Noise::options() has the profile's numbers in its
/// place.
void set_noise(const std::string& text, RunConfig& config) {
  const auto given = config.options.find("noise");
  if (given == config.options.end()) return;
  const bool is_scale = given->is_object() && given->contains("scale") && text.starts_with('{');
  Json noise = is_scale ? parse_json(text, "noise") : config.noise.options();
  noise.merge_patch(*given);
  config.noise = Noise(noise);
  config.options.erase("noise");
}

/// Smallest errors and true motions of a body, by their RMS in a frame, from which they are compared. A
/// camera is estimated more accurately than objects.
struct LeastMotion {
  double error = 0, truth = 0;
};

/// Returns true if the errors exceed a quarter of the true values. Both are given as squares and compared by
/// their RMS without the largest fifth.
bool deviates(const std::vector<double>& errors, const std::vector<double>& truths,
              const LeastMotion& least) {
  constexpr double largest_share = 0.25;
  const auto error = trimmed_mean(errors, 1), truth = trimmed_mean(truths, 1);
  return error && truth && *truth >= least.truth * least.truth && *error > least.error * least.error &&
         *error > largest_share * largest_share * *truth;
}

/// Returns true if the estimated steps of the track deviate from the true ones, by their translations or by
/// their rotations, or if those of a camera that moves do not exist.
bool contradicts_truth(const BodyTrack& track) {
  constexpr double least_step_m = 0.05;
  const bool is_camera = track.body == "ego";
  const LeastMotion least_m = is_camera ? LeastMotion{.error = 0.01} : LeastMotion{.truth = least_step_m};
  const LeastMotion least_rad =
      is_camera ? LeastMotion{.error = 0.1 * degree} : LeastMotion{.truth = 0.3 * degree};
  std::vector<double> steps, turns, errors_of_steps, errors_of_turns;
  bool moves = false;
  for (size_t i = 1; i < track.points.size(); ++i) {
    const TrackPoint &before = track.points[i - 1], &at = track.points[i];
    const auto r0 = before.truth(), r1 = at.truth();
    if (at.frame != before.frame + 1 || !r0 || !r1) continue;
    const SE3 truth = r0->inverse() * *r1;
    moves = moves || truth.translation().norm() > least_step_m;
    const auto g0 = before.estimate(), g1 = at.estimate();
    if (!g0 || !g1) continue;
    const SE3 error = (g0->inverse() * *g1).inverse() * truth;
    steps.push_back(truth.translation().squaredNorm());
    turns.push_back(std::pow(rotation_angle_rad(truth.rotation()), 2));
    errors_of_steps.push_back(error.translation().squaredNorm());
    errors_of_turns.push_back(std::pow(rotation_angle_rad(error.rotation()), 2));
  }
  if (steps.empty()) return is_camera && moves;
  return deviates(errors_of_steps, steps, least_m) || deviates(errors_of_turns, turns, least_rad);
}

/// Checks the conventions of a source if its camera or one of its objects contradicts the truth, because an
/// estimator cannot be better than its input. Returns failures_of() the source.
std::vector<std::string> mistakes_of_input(const RunConfig& config, const SourceRun& run, SourceSpec spec) {
  if (std::ranges::none_of(run.tracks, contradicts_truth)) return {};
  spec.add_options(config.options.value("source", Json::object()));
  return failures_of(spec, config.jobs);
}

}  // namespace

RunConfig run_config(const RunRequest& request, const RunOutput& output) {
  RunConfig config;
  for (const std::string& source : request.sources)
    config.sources.push_back(find_source(source, request.data_root));
  config.estimator = request.estimator;
  config.options = request.options;
  if (request.consistency) config.options["pipeline"]["consistency"] = true;
  const bool with_noise = request.noise == noise_of_procedure;
  if (!with_noise) config.noise = Noise::parse(request.noise);
  config.level = request.level;
  if (!request.procedure.empty()) {
    follow_procedure(request.procedure, with_noise, config);
  } else if (with_noise) {
    fail("--noise procedure takes the noise from a procedure: give --procedure NAME, too");
  }
  set_noise(request.noise, config);
  config.n_seeds = request.n_seeds;
  config.jobs = request.jobs;
  config.quiet = request.quiet;
  config.folder = std::filesystem::path(output.out) / "external";
  return config;
}

std::vector<std::string> noise_warnings(const RunRequest& request, const RunConfig& config) {
  if (!config.noise.none()) return {};
  std::vector<std::string> warnings;
  if (request.noise != "none" || request.options.contains("noise")) {
    warnings.emplace_back(
        "the noise that is given changes nothing, because the size of every model in it is 0");
  } else if (config.level != 0) {
    warnings.push_back(fmt::format(
        "the records state the noise level {}, but there is no noise: give --noise", config.level));
  }
  if (config.n_seeds > 1) {
    warnings.push_back(fmt::format(
        "without noise {} seeds are {} equal runs, which count as {} clusters: a seed changes the noise "
        "alone",
        config.n_seeds, config.n_seeds, config.n_seeds));
  }
  return warnings;
}

WrittenRun run_into_folder(const RunConfig& config, const RunOutput& output) {
  const MetricPreset& preset = find_preset(output.preset);
  const FolderLock lock(output.out);
  const Json configuration = resolved_configuration(config);
  check_output_folder(output.out, configuration, output.force);

  Json identity = configuration;
  if (const Fingerprints versions = run_fingerprints(config); !versions.empty())
    identity[fingerprints_key] = fingerprints_json(versions);
  RunJournal journal(output.out, identity);
  RunConfig resumable = config;
  if (!config.rescore)
    resumable.journal = &journal;  // the files that a rescored run reads may change between two attempts
  WorstFrames worst(preset);
  resumable.on_pair = [&](const FrameResult& pair, std::span<const Record> of_pair) {
    worst.add(pair, of_pair);
  };
  WrittenRun folder{.result = run(resumable), .warnings = {}};
  RunResult& result = folder.result;
  for (size_t i = 0; i < result.sources.size(); ++i)
    std::ranges::move(mistakes_of_input(config, result.sources[i], config.sources[i]),
                      std::back_inserter(result.sources[i].problems));
  const Table summary = summary_table(result.records, preset);
  OutputFiles files = run_files(result);
  try {
    files["report.html"] =
        report_page(run_document({config, result, preset, output.data_root}, worst), config.jobs);
  } catch (const Error& error) {  // a failing gnuplot must not lose the results of a long run
    folder.warnings.push_back(fmt::format("no report.html: {}", error.what()));
    std::error_code ignored;
    std::filesystem::remove(std::filesystem::path(output.out) / "report.html", ignored);
  }
  files["summary.md"] = to_markdown(summary);
  files["summary.csv"] = to_csv(summary);
  write_output_folder(output.out, files);
  journal.remove();
  return folder;
}

RescoredFolder rescore_into_folder(const RescoreRequest& request, const SweepConfig& config,
                                   const RunOutput& output) {
  std::error_code ignored;
  if (std::filesystem::equivalent(request.folder, output.out, ignored))
    fail("--out {}: is the folder that is being rescored: choose another one", output.out);
  if (!is_sweep(request.folder)) {
    RunConfig run = rescored_run(request);
    run.jobs = config.jobs;
    run.quiet = config.quiet;
    return {.run = run_into_folder(run, output), .sweep = {}};
  }
  SweepConfig rescored = rescored_sweep(request);
  rescored.cache = config.cache;
  rescored.jobs = config.jobs;
  rescored.quiet = config.quiet;
  rescored.on_message = config.on_message;
  rescored.out = output.out;
  rescored.replace = output.force;
  return {.run = {}, .sweep = sweep(rescored)};
}

// ---- reports

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
    replace_report(output.out, report);
  }
  return scores;
}

ObjectScores evaluate_objects_into(const ObjectFiles& files, std::span<const MetricPreset> presets,
                                   const std::string& out) {
  const auto lock = lock_folder(out), lock_tum = lock_folder(files.tum), lock_zip = lock_folder(files.zip);
  ObjectScores scores = evaluate_object_files(files);
  if (!out.empty()) {
    OutputFiles report = report_folder(object_document(scores, presets), {});
    report["records.jsonl"] = write_records(scores.records);
    for (const ObjectTracks& tracks : scores.tracks)
      report[tracks_file(tracks.system, tracks.run)] = write_tracks(tracks.bodies, true);
    replace_report(out, report);
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
        {"quantiles",
         "exact within 0.5 %, the width of the histogram bins; the ends of their intervals may differ more, "
         "because values of one bin count as ties; everything else is exact"});
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

/// Returns the smallest number of clusters behind an interval of the tables; nullopt if they have none.
std::optional<size_t> fewest_clusters(const std::vector<NoiseLevelRow>& levels,
                                      const std::vector<ComparisonRow>& comparisons,
                                      const std::vector<TrendRow>& trends) {
  std::optional<size_t> fewest;
  const auto count = [&](size_t n) {
    if (n >= 2) fewest = std::min(n, fewest.value_or(n));  // one cluster has no interval
  };
  for (const NoiseLevelRow& row : levels) {
    for (const auto& [name, summary] : row.errors) count(summary.n_clusters);
  }
  for (const ComparisonRow& row : comparisons) {
    for (const auto& [name, comparison] : row.errors) {
      if (comparison.interval) count(static_cast<size_t>(comparison.n_clusters));
    }
  }
  for (const TrendRow& row : trends) {
    if (!row.errors.empty()) count(static_cast<size_t>(row.n_clusters));
  }
  return fewest;
}

/// Warns of intervals whose coverage is below the nominal one because they are of few clusters.
void warn_of_few_clusters(std::optional<size_t> fewest, std::vector<std::string>& warnings) {
  constexpr size_t enough = 5;
  if (!fewest || *fewest >= enough) return;
  warnings.push_back(fmt::format(
      "some 95 % intervals are of {} clusters (seeds; frames where there is one seed): they cannot exceed "
      "the range of the clusters' means, so they cover the mean of a symmetric law with a probability of at "
      "most 1 - 2^(1 - {}) = {:.3g} %: use at least {} seeds, better 10",
      *fewest, *fewest, 100 * (1 - std::ldexp(1.0, 1 - static_cast<int>(*fewest))), enough));
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
  ReportDocument document;
  const std::vector<NoiseSweep> sweeps = read_noise_sweeps(folders, &document.warnings);
  progress.advance();
  std::vector<NoiseLevelRow> levels;
  std::vector<AchievedNoiseRow> achieved;
  for (const NoiseSweep& sweep : sweeps) {
    for (NoiseLevelRow& row : noise_levels(sweep, jobs)) levels.push_back(std::move(row));
    for (AchievedNoiseRow& row : achieved_noise_rows(sweep)) achieved.push_back(std::move(row));
  }
  progress.advance();
  document.title = "Noise and errors";
  const bool has_one_seed = std::ranges::count(levels, 1, &NoiseLevelRow::n_seeds) > 0;
  document.abstract = fmt::format(
      "Errors of camera and objects by noise level, from the records of {}. Intervals are 95 %, bootstrapped "
      "over seeds{}.",
      joined(folders), has_one_seed ? ", or over stretches of 5 frames where there is one seed" : "");
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
  const auto of_estimators =
      std::stable_partition(of_bodies.begin(), of_bodies.end(),
                            [](const Figure& figure) { return !figure.name.starts_with("estimators_"); });
  size_t n_left_out = 0;
  const std::vector<ComparisonRow> comparisons = compare_estimators(sweeps, jobs, {}, &n_left_out);
  add("Estimators compared",
      {.name = "comparisons",
       .table = linked(comparison_table(comparisons), comparisons),
       .first = first_of_comparisons},
      {of_estimators, of_bodies.end()});
  of_bodies.erase(of_estimators, of_bodies.end());
  progress.advance();
  add("Errors by noise level",
      {.name = "noise_levels", .table = linked(noise_level_table(levels), levels), .first = first_of_levels},
      std::move(of_bodies));
  add("Errors that fall", {.name = "falling_errors", .table = falling_error_table(falling_errors(sweeps))});
  const std::vector<TrendRow> trends = noise_trends(sweeps, jobs);
  warn_of_few_clusters(fewest_clusters(levels, comparisons, trends), document.warnings);
  for (const std::string& warning : document.warnings) document.abstract += " Warning: " + warning + ".";
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
