#include "sextant/eval/experiment/run.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <future>
#include <numeric>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

// ---- options

namespace {

/// Sets tree[a][b][c] = value for the key "a.b.c".
void set_option(Json& tree, const std::string& assignment) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    fail("--set {}: expected key=value, e.g. pipeline.max_object_distance_m=30", assignment);
  }
  Json* node = &tree;
  for (const std::string& part : split(assignment.substr(0, equals), '.')) {
    if (part.empty())
      fail("--set {}: the key has an empty part: expected key=value, e.g. pipeline.max_object_distance_m=30",
           assignment);
    if (!node->is_object())
      fail("--set {}: '{}' stands below a key that has a value: expected a group of options there",
           assignment, part);
    node = &(*node)[part];
    if (node->is_null()) *node = Json::object();
  }
  const std::string text = assignment.substr(equals + 1);
  *node = try_parse_json(text).value_or(Json(text));
}

}  // namespace

Json options_tree(const std::string& options, std::span<const std::string> sets) {
  Json tree = Json::object();
  if (options.starts_with('@')) {
    tree = read_json(options.substr(1));
  } else if (!options.empty()) {
    tree = parse_json(options, "--options");
  }
  if (!tree.is_object()) fail("--options: expected a JSON object, got {}", json_excerpt(tree));
  for (const std::string& assignment : sets) set_option(tree, assignment);
  return tree;
}

ResolvedOptions resolve_options(const Json& tree) {
  if (!tree.is_object()) fail("options: expected a JSON object, got {}", json_excerpt(tree));
  const std::vector<std::string> known = {"extraction", "pipeline", "estimator", "source"};
  ResolvedOptions options;
  for (const auto& item : tree.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      fail("unknown option key '{}': {}", item.key(), suggest(item.key(), known));
    }
    if (!item.value().is_object())
      fail("option {}: expected an object, got {}", item.key(), json_excerpt(item.value()));
    if (item.key() == "extraction") read_options(item.value(), options.extraction, "extraction");
    if (item.key() == "pipeline") read_options(item.value(), options.pipeline, "pipeline");
    if (item.key() == "estimator") options.estimator = item.value();
    if (item.key() == "source") options.source = item.value();
  }
  return options;
}

std::vector<OptionHelp> run_options(const std::string& estimator) {
  std::vector<OptionHelp> all;
  const auto add = [&](const std::vector<OptionHelp>& options) {
    all.insert(all.end(), options.begin(), options.end());
  };
  add(describe_options(ExtractionOptions{}, "extraction"));
  add(describe_options(PipelineOptions{}, "pipeline"));
  const std::vector<EstimatorEntry> known = all_estimators();
  add(find_entry(std::span<const EstimatorEntry>(known), estimator, "estimator").options());
  add(describe_noise_options());
  return all;
}

std::vector<OptionHelp> plan_options() {
  return {
      {"plan.keep", std::string(to_string(Plan().keep)), "",
       "what a sweep keeps of a case, a key of its plan: records, or summary (counts, sums, histograms)"}};
}

// ---- runs

namespace {

using Clock = std::chrono::steady_clock;

/// Expresses the run as a plan with one estimator and one level.
Plan plan_of(const RunConfig& config) {
  if (config.n_seeds < 1) fail("seeds = {}: must be >= 1", config.n_seeds);
  if (!(config.level >= 0) || !std::isfinite(config.level))
    fail("level = {}: must be finite and >= 0", config.level);
  const ResolvedOptions options = resolve_options(config.options);
  const auto estimator = make_case_estimator(config.estimator, options.estimator);
  Plan plan;
  plan.sources = config.sources;
  for (SourceSpec& spec : plan.sources) spec.add_options(options.source);
  plan.extraction = options.extraction;
  plan.pipeline = options.pipeline;
  plan.estimators = {{config.estimator, estimator->label(), estimator->options(), options.extraction,
                      options.pipeline, estimator}};
  plan.levels = {{config.level, config.noise}};
  plan.seeds.resize(static_cast<size_t>(config.n_seeds));
  std::iota(plan.seeds.begin(), plan.seeds.end(), uint64_t{0});
  return plan;
}

/// Returns the cases of a source, one per seed.
std::vector<CaseSettings> cases_of(const RunConfig& config, const Plan& plan, size_t source,
                                   const SequenceInfo& info) {
  std::vector<CaseSettings> cases;
  for (size_t i = 0; i < plan.seeds.size(); ++i) {
    CaseSettings settings = case_settings(plan, plan.at(source * plan.seeds.size() + i));
    settings.rescore = config.rescore;
    if (!config.folder.empty()) settings.folder = config.folder / case_folder(info, i);
    cases.push_back(std::move(settings));
  }
  return cases;
}

SourceOutcome estimate_source(const RunConfig& config, const Plan& plan, size_t source,
                              const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  // The next window is decoded while the current one is in the pipeline.
  PairReader reader(sequence, plan.extraction, config.noise, config.jobs);
  std::vector<ExtractedPair> window;
  std::future<std::vector<ExtractedPair>> ahead;
  const auto read_ahead = [&] {
    ahead = std::async(config.jobs > 1 ? std::launch::async : std::launch::deferred,
                       [&] { return reader.next(); });
  };
  const auto next = [&]() -> std::span<const ExtractedPair> {
    window = ahead.get();
    if (!window.empty()) read_ahead();
    return window;
  };
  Progress progress(info.sequence + " pairs", info.last_frame - info.first_frame, config.quiet);
  const auto on_pair = [&](const FrameResult& result, std::span<const Record> of_pair) {
    if (config.on_pair) config.on_pair(result, of_pair);
    progress.advance();
  };
  read_ahead();
  std::vector<CaseOutcome> seeds =
      run_cases(sequence, cases_of(config, plan, source, info), next, config.jobs, on_pair);
  SourceOutcome out{std::move(seeds.front()), sequence.inputs().entries()};
  for (CaseOutcome& seed : std::span(seeds).subspan(1)) {
    std::ranges::move(seed.records, std::back_inserter(out.records));
    std::ranges::move(seed.problems, std::back_inserter(out.problems));
    out.noise.merge(seed.noise);
  }
  return out;
}

SourceRun run_source(const RunConfig& config, const Plan& plan, size_t source, const Sequence& sequence,
                     std::vector<Record>& records) {
  std::optional<SourceOutcome> done = config.journal ? config.journal->find(source) : std::nullopt;
  if (!done) {
    done = estimate_source(config, plan, source, sequence);
    if (config.journal) config.journal->append(source, *done);
  }
  std::ranges::move(done->records, std::back_inserter(records));
  SourceRun out;
  out.source = config.sources[source].text;
  out.info = sequence.info();
  out.truth = sequence.truth().camera;
  out.tracks = body_tracks(done->motions, sequence.truth(), out.info);
  out.motions = std::move(done->motions);
  if (!config.noise.none()) out.noise = done->noise.json(config.noise.options());
  out.problems = std::move(done->problems);
  if (const std::string warning = config.noise.baseline_warning(out.info.camera); !warning.empty())
    out.problems.push_back(fmt::format("{}: {}", out.source, warning));
  out.inputs = std::move(done->inputs);
  return out;
}

/// Throws Error if two sources would give records that look alike.
void check_distinct(const std::vector<std::unique_ptr<Sequence>>& sequences,
                    const std::vector<SourceSpec>& specs) {
  for (size_t i = 0; i < sequences.size(); ++i) {
    const SequenceInfo& info = sequences[i]->info();
    for (size_t j = 0; j < i; ++j) {
      if (share_pairs(info, sequences[j]->info())) {
        fail("sources '{}' and '{}' are frames of the same {} sequence '{}': list each frame pair once",
             specs[j].text, specs[i].text, info.dataset, info.sequence);
      }
      if (folder_name(info) == folder_name(sequences[j]->info())) {
        fail("sources '{}' and '{}' would both write into '{}': run each into a folder of its own",
             specs[j].text, specs[i].text, folder_name(info));
      }
    }
  }
}

}  // namespace

std::string folder_name(const SequenceInfo& info) {
  std::string name =
      fmt::format("{}_{}_{}-{}", info.dataset, info.sequence, info.first_frame, info.last_frame);
  return safe_file_name(name);
}

std::string case_folder(const SequenceInfo& info, uint64_t seed) {
  return fmt::format("{}_seed{}", folder_name(info), seed);
}

std::string case_folder(uint64_t number) { return fmt::format("case_{:06}", number); }

void follow_procedure(const std::string& name, bool with_noise, RunConfig& config) {
  Json options = procedure_options(name, config.estimator);
  options.merge_patch(config.options);
  config.options = std::move(options);
  if (!with_noise) return;
  const Json noise = find_procedure(name).at("noise");
  config.noise = Noise(noise.at("noise"));
  config.level = noise.at("level");
}

Json resolved_configuration(const RunConfig& config) {
  const Plan plan = plan_of(config);
  Json json;
  json["sources"] = Json::array();
  for (const SourceSpec& spec : config.sources) json["sources"].push_back(spec.text);
  json["estimator"] = config.estimator;
  json["options"] = {{"extraction", write_options(plan.extraction)},
                     {"pipeline", write_options(plan.pipeline)},
                     {"estimator", plan.estimators.front().options},
                     {"source", resolve_options(config.options).source}};
  json["noise"] = config.noise.options();
  json["level"] = config.level;
  json["seeds"] = config.n_seeds;
  return json;
}

Fingerprints run_fingerprints(const RunConfig& config) {
  if (!config.rescore) return present_fingerprints(plan_of(config));
  const fs::path folder = config.folder.parent_path();
  if (!fs::exists(folder / "run.json")) return {};  // the run is not finished yet
  return fingerprints_in(read_run_json(folder), (folder / "run.json").string());
}

RunResult run(const RunConfig& config) {
  const Clock::time_point start = Clock::now();
  if (config.sources.empty()) fail("no source given: expected at least one ADAPTER:PATH");
  if (config.jobs < 1) fail("jobs = {}: must be >= 1", config.jobs);
  const Plan plan = plan_of(config);
  std::vector<std::unique_ptr<Sequence>> sequences;
  for (const SourceSpec& spec : plan.sources) {
    sequences.push_back(open_source(spec));
    check_runnable(spec, *sequences.back());
  }
  check_distinct(sequences, plan.sources);

  RunResult result{.configuration = resolved_configuration(config),
                   .fingerprints = run_fingerprints(config),
                   .jobs = config.jobs};
  for (size_t i = 0; i < sequences.size(); ++i) {
    result.sources.push_back(run_source(config, plan, i, *sequences[i], result.records));
    sequences[i].reset();
  }
  if (const fs::path rescored = config.folder.parent_path();
      config.rescore && fs::exists(rescored / "run.json"))
    check_unchanged_data(rescored, run_provenance(result));
  result.wall_time_s = std::chrono::duration<double>(Clock::now() - start).count();
  return result;
}

namespace {

std::string matrix_line(const SE3& T) {
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m = T.matrix().topRows<3>();
  return fmt::format("{}", fmt::join(m.data(), m.data() + m.size(), " "));
}

std::string tum_text(const Trajectory& trajectory, const SequenceInfo& info) {
  std::string text;
  for (const auto& [frame, pose] : trajectory.poses()) {
    if (frame < info.first_frame || frame > info.last_frame) continue;
    const Eigen::Vector3d& t = pose.translation();
    const Eigen::Quaterniond& q = pose.rotation();
    text += fmt::format("{} {} {} {} {} {} {} {}\n", frame / info.rate_hz, t.x(), t.y(), t.z(), q.x(), q.y(),
                        q.z(), q.w());
  }
  return text;
}

Json source_json(const SourceRun& source) {
  Json json;
  json["source"] = source.source;
  json["dataset"] = source.info.dataset;
  json["sequence"] = source.info.sequence;
  json["first_frame"] = source.info.first_frame;
  json["last_frame"] = source.info.last_frame;
  json["rate_hz"] = source.info.rate_hz;
  json["width_px"] = source.info.width;
  json["height_px"] = source.info.height;
  const StereoCamera& camera = source.info.camera;
  json["camera"] = {{"fx_px", camera.left.fx},
                    {"fy_px", camera.left.fy},
                    {"cx_px", camera.left.cx},
                    {"cy_px", camera.left.cy},
                    {"bf_px_m", camera.bf}};
  json["provenance"] = source.info.provenance;
  json["warnings"] = source.info.all_warnings();
  json["estimated_poses"] = source.motions.estimated.poses().size();
  json["world_origin"] = source.motions.starts_at_truth ? "true pose of the first frame" : "first frame";
  if (!source.noise.is_null()) json["noise"] = source.noise;
  json["inputs"] = inputs_json(source.inputs);
  return json;
}

}  // namespace

OutputFiles run_files(const RunResult& result) {
  OutputFiles files;
  files["records.jsonl"] = write_records(result.records);
  files["run.json"] = json_text(run_provenance(result));
  for (const SourceRun& source : result.sources) {
    const std::string folder = result.sources.size() == 1 ? "" : folder_name(source.info) + "/";
    std::string& kitti = files[folder + "est_camera_kitti.txt"];
    for (const auto& [frame, pose] : source.motions.estimated.poses()) kitti += matrix_line(pose) + '\n';
    files[folder + "est_camera_tum.txt"] = tum_text(source.motions.estimated, source.info);
    const std::string truth = tum_text(source.truth, source.info);
    if (!truth.empty()) files[folder + "gt_camera_tum.txt"] = truth;
    files[folder + "tracks.csv"] = write_tracks(source.tracks);
    for (const auto& [id, motions] : source.motions.objects) {
      std::string& text = files[fmt::format("{}obj_{}_motion.txt", folder, id)];
      for (const auto& [frame, H_world] : motions)
        text += fmt::format("{} {}\n", frame, matrix_line(H_world));
    }
  }
  return files;
}

Json run_provenance(const RunResult& result) {
  Json json = build_provenance();
  json["configuration"] = result.configuration;
  if (!result.fingerprints.empty()) json[fingerprints_key] = fingerprints_json(result.fingerprints);
  json["jobs"] = result.jobs;
  json["wall_time_s"] = result.wall_time_s;
  json["records"] = result.records.size();
  json["sources"] = Json::array();
  for (const SourceRun& source : result.sources) json["sources"].push_back(source_json(source));
  return json;
}

namespace {

Json pose_json(const SE3& T) {
  const Eigen::Quaterniond& q = T.rotation();
  const Eigen::Vector3d& t = T.translation();
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

SE3 pose_from(const Json& json) {
  const auto v = json.get<std::array<double, 7>>();
  return SE3::from_parts({v[0], v[1], v[2], v[3]}, {v[4], v[5], v[6]});
}

Json poses_json(const std::map<int, SE3>& poses) {
  Json json = Json::array();
  for (const auto& [frame, pose] : poses) json.push_back({frame, pose_json(pose)});
  return json;
}

Json note_of(const SourceOutcome& outcome) {
  Json objects = Json::array();
  for (const auto& [id, motions] : outcome.motions.objects) objects.push_back({id, poses_json(motions)});
  return {{"starts_at_truth", outcome.motions.starts_at_truth},
          {"camera", poses_json(outcome.motions.estimated.poses())},
          {"objects", objects},
          {"sums", outcome.noise.sums()},
          {"problems", outcome.problems},
          {"inputs", inputs_json(outcome.inputs)}};
}

SourceOutcome outcome_of(const Json& note, std::string_view records) {
  SourceOutcome outcome;
  outcome.records = parse_records(records, "journal");
  outcome.motions.starts_at_truth = note.at("starts_at_truth").get<bool>();
  for (const Json& entry : note.at("camera"))
    outcome.motions.estimated.set(entry.at(0).get<int>(), pose_from(entry.at(1)));
  for (const Json& object : note.at("objects")) {
    std::map<int, SE3>& motions = outcome.motions.objects[object.at(0).get<int>()];
    for (const Json& entry : object.at(1)) motions[entry.at(0).get<int>()] = pose_from(entry.at(1));
  }
  outcome.noise = NoiseVerification::from_sums(note.at("sums"), "journal");
  outcome.problems = note.at("problems").get<std::vector<std::string>>();
  for (const auto& [path, entry] : note.at("inputs").items())
    outcome.inputs[path] = {entry.at("bytes").get<uint64_t>(), entry.at("sha256").get<std::string>()};
  return outcome;
}

}  // namespace

Json inputs_json(const std::map<std::string, InputLog::Entry>& inputs) {
  Json json = Json::object();
  for (const auto& [path, entry] : inputs) json[path] = {{"bytes", entry.bytes}, {"sha256", entry.sha256}};
  return json;
}

bool same_inputs(const Json& inputs) {
  for (const auto& [path, input] : inputs.items()) {
    if (!fs::exists(path) || input.at("sha256") != sha256(read_file(path))) return false;
  }
  return true;
}

RunJournal::RunJournal(fs::path folder, const Json& configuration)
    : path_(std::move(folder) / "unfinished.jsonl"),
      owner_(sha256(json_line({{"run", configuration}, {"program", program_identity()}}))) {
  if (fs::exists(path_)) open();
}

void RunJournal::open() {
  journal_.emplace(path_, owner_, [](uint64_t, std::string_view) { return true; });
}

std::optional<SourceOutcome> RunJournal::find(size_t source) const {
  if (!journal_) return std::nullopt;
  const auto block = journal_->blocks().find(source);
  if (block == journal_->blocks().end() || !same_inputs(block->second.noise.at("inputs")))
    return std::nullopt;
  return outcome_of(block->second.noise, journal_->content(block->second));
}

void RunJournal::append(size_t source, const SourceOutcome& outcome) {
  if (!journal_) open();
  journal_->append(source, outcome.records.size(), write_records(outcome.records), note_of(outcome));
}

void RunJournal::remove() {
  journal_.reset();
  fs::remove(path_);
}

}  // namespace sextant
