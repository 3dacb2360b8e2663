#include "sextant/eval/external/external_estimator.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/json.h"
#include "sextant/base/quantile.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/layout.h"
#include "sextant/eval/external/external_case.h"
#include "sextant/eval/external/external_config.h"
#include "sextant/eval/external/process.h"
#include "sextant/eval/external/program_fingerprint.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Writes the input; returns the name of the sequence in the layout.
std::string write_input(const CaseContext& context, const ExternalConfig& config, const CaseFolder& folder) {
  const NoisySequence noisy(context.sequence, context.noise, context.seed,
                            {.truth = config.write_truth,
                             .from_zero = config.renumber,
                             .zero_last_flow = config.last_flow == LastFlow::zero});
  LayoutRequest request;
  request.out = folder.input();
  request.quiet = true;
  request.between_frames = check_interrupt;
  const std::string source = find_layout(config.layout).write(noisy, request);
  const std::string name = SourceSpec::parse(source).sequence;
  return name.empty() ? noisy.info().sequence : name;
}

FrameNumbers frame_numbers(const ExternalConfig& config, const SequenceInfo& info) {
  FrameNumbers numbers{.first = info.first_frame, .last = info.last_frame};
  const bool from_zero = config.renumber || config.layout == "kitti";  // write_kitti_layout() numbers from 0
  numbers.in_files = from_zero ? 0 : info.first_frame;
  numbers.in_results = config.first_frame >= 0 ? config.first_frame : numbers.in_files;
  numbers.rate_hz = info.rate_hz;
  return numbers;
}

Placeholders placeholders(const CaseContext& context, const CaseFolder& folder, const fs::path& config_folder,
                          const FrameNumbers& numbers, const std::string& sequence) {
  const SequenceInfo& info = context.sequence.info();
  const PinholeCamera& camera = info.camera.left;
  const int n = info.last_frame - info.first_frame + 1;
  const auto text = [](const auto& value) { return fmt::format("{}", value); };
  return {{"input", folder.input().string()},
          {"output", folder.output().string()},
          {"config", config_folder.string()},
          {"calibration", folder.file("calibration.yaml").string()},
          {"sequence", sequence},
          {"first", text(numbers.in_files)},
          {"last", text(numbers.in_files + n - 1)},
          {"n", text(n)},
          {"fx", text(camera.fx)},
          {"fy", text(camera.fy)},
          {"cx", text(camera.cx)},
          {"cy", text(camera.cy)},
          {"bf", text(info.camera.bf)},
          {"rate", text(info.rate_hz)},
          {"width", text(info.width)},
          {"height", text(info.height)},
          {"seed", text(context.seed)}};
}

/// Costs of a run of the program, for the records of its frames.
struct Costs {
  double wall_ms_per_pair = 0, cpu_ms_per_pair = 0;
  double peak_memory_mb = 0;
  std::map<int, double> own_ms;  ///< by frame, if the program reports it
};

Eigen::Vector3d centroid(const PinholeCamera& camera, const Correspondences& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < points.size(); ++i)
    sum += camera.backproject(points.u[i], points.v[i], points.depth[i]);
  return sum / static_cast<double>(points.size());
}

/// Returns the program's results pair by pair.
class ExternalPairEstimator final : public PairEstimator {
 public:
  ExternalPairEstimator(ExternalResults results, std::vector<std::string> problems, Costs costs,
                        double max_depth_m)
      : results_(std::move(results)),
        problems_(std::move(problems)),
        costs_(std::move(costs)),
        max_depth_m_(max_depth_m) {
    ids_ = results_.unreadable;
    for (const auto& [key, motion] : results_.motions) ids_.insert(key.first);
  }

  FrameResult process(const FramePair& pair) override {
    FrameResult result{.prev = pair.prev, .curr = pair.curr, .dt_s = pair.dt_s, .ego = ego(pair)};
    std::set<int> seen;
    for (const ObjectObservation& observation : pair.objects) {
      seen.insert(observation.instance);
      if (is_known(observation.instance)) result.objects.push_back(object(pair, observation, result.ego));
    }
    for (const int id : ids_) {  // named by the program, but without a mask
      ObjectObservation none;
      none.instance = id;
      if (!seen.contains(id) && results_.motions.contains({id, pair.curr}))
        result.objects.push_back(object(pair, none, result.ego));
    }
    std::ranges::sort(result.objects, {}, &BodyResult::instance);
    return result;
  }

  void add_costs(int frame, Record& ego) const override {
    ego.time_ms["cpu"] = costs_.cpu_ms_per_pair;
    ego.values["peak_memory_mb"] = costs_.peak_memory_mb;
    const auto own = costs_.own_ms.find(frame);
    if (own != costs_.own_ms.end()) ego.time_ms["program"] = own->second;
  }

  std::vector<std::string> problems() const override { return problems_; }
  RecordedForm recorded() const override {
    return {&results_.camera, results_.camera_has_quaternions, results_.declared_frame,
            results_.motions_have_quaternions};
  }

 private:
  bool is_unreadable(int id) const { return results_.objects_unreadable || results_.unreadable.contains(id); }
  bool is_known(int id) const { return results_.objects_unreadable || ids_.contains(id); }

  BodyResult ego(const FramePair& pair) const {
    BodyResult body;
    body.area_fraction = body.distance_m = body.moving_share = body.speed_mps = nan;
    body.points = pair.background;
    body.noise = pair.noise_of(0);
    body.times.refine_ms = costs_.wall_ms_per_pair;
    const std::optional<SE3> T_prev_curr = results_.camera.motion(pair.prev, pair.curr);
    body.status = results_.camera_unreadable ? Status::diverged : T_prev_curr ? Status::ok : Status::lost;
    if (T_prev_curr) set_motion(T_prev_curr->inverse(), body);
    return body;
  }

  BodyResult object(const FramePair& pair, const ObjectObservation& observation,
                    const BodyResult& ego) const {
    BodyResult body;
    body.instance = observation.instance;
    body.area_fraction = observation.area_fraction;
    body.moving_share = body.speed_mps = nan;
    body.points = points_of_instance(observation, observation.instance, max_depth_m_);
    body.noise = pair.noise_of(body.instance);
    body.distance_m = nan;
    const auto motion = results_.motions.find({body.instance, pair.curr});
    body.status = is_unreadable(body.instance)       ? Status::diverged
                  : motion != results_.motions.end() ? Status::ok
                                                     : Status::lost;
    if (body.points.empty()) {
      body.centroid_m.setConstant(nan);
    } else {
      std::vector<double> depths = body.points.depth;
      body.distance_m = upper_median(depths);
      body.centroid_m = centroid(pair.camera.left, body.points);
    }
    if (body.status != Status::ok) return body;
    set_motion(motion->second, body);
    if (ego.status == Status::ok) {
      const SE3 H = object_motion_prev(ego.estimate.T_curr_prev, motion->second);
      body.speed_mps = speed_mps(H, body.centroid_m, pair.dt_s);
    }
    return body;
  }

  static void set_motion(const SE3& T_curr_prev, BodyResult& body) {
    body.estimate.status = Status::ok;
    body.estimate.T_curr_prev = T_curr_prev;
  }

  ExternalResults results_;
  std::vector<std::string> problems_;
  Costs costs_;
  double max_depth_m_;
  std::set<int> ids_;
};

/// One set of results with its name in the configuration, which is empty if there is only one set.
struct ScoredSet {
  std::string name;
  ExternalResults results;
};

std::string log_text(const ProcessRequest& request, const ProcessOutcome& outcome,
                     const std::vector<ScoredSet>& sets, int n_frames, const std::vector<std::string>& notes,
                     const std::vector<std::string>& problems) {
  std::string text = "command:";
  for (const std::string& word : request.words) text += fmt::format(" '{}'", word);
  text += fmt::format("\nin: {}\nend: {}\nwall: {:.3f} s\ncpu: {:.3f} s\npeak memory: {:.1f} MB\n",
                      request.working_directory.string(), outcome.text(), outcome.wall_s, outcome.cpu_s,
                      outcome.peak_memory_mb);
  for (const ScoredSet& set : sets) {
    if (!set.name.empty()) text += fmt::format("results {}\n", set.name);
    text += fmt::format("camera poses: {} of {} frames\nobject motions: {}\n",
                        set.results.camera.poses().size(), n_frames, set.results.motions.size());
    for (const std::string& note : set.results.notes) text += fmt::format("note: {}\n", note);
  }
  for (const std::string& note : notes) text += fmt::format("note: {}\n", note);
  for (const std::string& problem : problems) text += fmt::format("problem: {}\n", problem);
  return text;
}

class ExternalEstimator final : public CaseEstimator {
 public:
  /// `is_run`: the program will be started; otherwise its existing files are read again.
  ExternalEstimator(ExternalConfig config, fs::path config_file, bool is_run)
      : config_(std::move(config)),
        config_file_(std::move(config_file)),
        config_folder_(config_file_.parent_path()) {
    if (config_.settings.empty() || !is_run) return;
    template_ = config_folder_ / config_.settings;
    fill_template(any_placeholders());  // reports errors here and not in the first case
  }

  std::vector<NamedEstimator> begin(const CaseContext& context) const override {
    const FrameNumbers numbers = frame_numbers(config_, context.sequence.info());
    if (context.rescore) {
      const fs::path folder = fs::absolute(context.folder).lexically_normal();
      return score(context, numbers, folder, read_case(folder), nullptr);
    }
    const CaseFolder folder(context.folder, config_.keep);
    const std::string sequence = write_input(context, config_, folder);
    const SequenceInfo& info = context.sequence.info();
    write_file(folder.file("calibration.yaml"),
               encode_yaml_camera({info.camera, info.rate_hz}) +
                   fmt::format("Camera.width: {}\nCamera.height: {}\n", info.width, info.height));
    Placeholders values = placeholders(context, folder, config_folder_, numbers, sequence);
    if (!template_.empty()) {
      const fs::path settings = folder.file("settings" + template_.extension().string());
      values["settings"] = settings.string();
      write_file(settings, fill_template(values));
    }
    const ProcessRequest request{
        .words = words_of(config_.command, values),
        .working_directory = fs::absolute(fill_in(config_.working_directory, values)),
        .environment = words_of(config_.environment, values),
        .stdout_file = folder.file("stdout.txt"),
        .stderr_file = folder.file("stderr.txt"),
        .time_limit_s = config_.time_limit_s};
    const ProcessOutcome outcome = run_process(request);
    write_case(outcome, folder.path());
    return score(context, numbers, folder.path(), outcome, &request);
  }

  Json options() const override { return write_options(config_); }
  std::string label() const override { return config_.name; }
  std::optional<Fingerprint> fingerprint() const override {
    return program_fingerprint(config_, config_file_);
  }

 private:
  static constexpr FileKind template_file = {"a template of settings", 1'000'000};

  std::string fill_template(const Placeholders& values) const {
    try {
      return fill_in(read_file(template_, template_file), values);
    } catch (const Error& error) {
      const std::string path = template_.string(), what = error.what();
      fail("{}{}", what.starts_with(path) ? "" : path + ": ", what);
    }
  }

  /// Reads the files in folder/output; writes folder/log.txt if there is a `request`.
  std::vector<NamedEstimator> score(const CaseContext& context, const FrameNumbers& numbers,
                                    const fs::path& folder, const ProcessOutcome& outcome,
                                    const ProcessRequest* request) const {
    const int n_frames = numbers.last - numbers.first + 1;
    const ResultFolder output{folder / "output", numbers, outcome.ok()};
    std::vector<std::string> problems;  // of the run, then of each set
    if (!outcome.ok()) {
      const std::string last = last_line(folder / "stderr.txt");
      problems.push_back(outcome.text() + (last.empty() ? "" : fmt::format(", stderr ends \"{}\"", last)));
    }
    if (outcome.survivors) problems.emplace_back("some of its processes could not be killed");
    FrameTimes times = read_frame_times(config_.times, output);
    std::ranges::move(times.problems, std::back_inserter(problems));
    const bool has_run_well = problems.empty();
    std::vector<ScoredSet> scored;
    std::map<std::string, ExternalResultSet> sets = config_.results;
    if (sets.empty()) sets[""] = config_.set;
    for (const auto& [name, set] : sets) {
      scored.push_back({name, read_external_results(set, output, context.sequence.truth())});
      const ExternalResults& results = scored.back().results;
      std::vector<std::string> of_set = results.problems;
      const auto n_poses = static_cast<int>(results.camera.poses().size());
      if (has_run_well && of_set.empty() && n_poses < n_frames)
        of_set.push_back(fmt::format("camera poses of {} of {} frames", n_poses, n_frames));
      for (const std::string& problem : of_set)
        problems.push_back(name.empty() ? problem : fmt::format("results {}: {}", name, problem));
    }
    if (request != nullptr)
      write_file(folder / "log.txt", log_text(*request, outcome, scored, n_frames, times.notes, problems));
    for (std::string& problem : problems) {
      problem = fmt::format("{}: {} ({})", config_.name, problem,
                            context.folder.empty() ? "no logs are kept" : (folder / "log.txt").string());
    }
    const Costs costs{1000 * outcome.wall_s / (n_frames - 1), 1000 * outcome.cpu_s / (n_frames - 1),
                      outcome.peak_memory_mb, std::move(times.ms)};
    std::vector<NamedEstimator> pair_estimators;
    for (ScoredSet& set : scored) {
      pair_estimators.push_back({set.name, std::make_unique<ExternalPairEstimator>(
                                               std::move(set.results), std::exchange(problems, {}), costs,
                                               context.pipeline.max_object_distance_m)});
    }
    return pair_estimators;
  }

  ExternalConfig config_;
  fs::path config_file_, config_folder_;
  fs::path template_;  ///< template of the settings; empty: none
};

}  // namespace

std::shared_ptr<const CaseEstimator> open_external_estimator(const std::string& config,
                                                             const Json& overrides) {
  const bool is_run = !overrides.is_object() || !overrides.contains(recorded_options);
  return std::make_shared<ExternalEstimator>(read_external_config(config, overrides),
                                             fs::absolute(config).lexically_normal(), is_run);
}

void add_external_estimators() {
  static const bool added = [] {
    add_estimator_kind("external", "external:CONFIG.json", open_external_estimator);
    return true;
  }();
  SEXTANT_CHECK(added);
}

namespace {

Json read_object(const fs::path& path) {
  Json json = read_json(path);
  if (!json.is_object()) fail("{}: expected a JSON object", path.string());
  return json;
}

const Json& member(const Json& json, const char* key, const fs::path& path) {
  if (!json.contains(key))
    fail("{}: has no \"{}\": expected the run.json of a finished run, or the plan.json of a finished sweep",
         path.string(), key);
  return json[key];
}

bool is_external(const Json& name) {
  return name.is_string() && name.get<std::string>().starts_with("external:");
}

/// Replaces name and options of the estimator according to the request.
void replace_estimator(const RescoreRequest& request, Json& name, Json& options) {
  const Json changes = request.options.value("estimator", Json::object());
  if (!request.config.empty()) {
    name = "external:" + request.config;
    options = changes;
    return;
  }
  options[recorded_options] = true;
  options.merge_patch(changes);
}

}  // namespace

bool is_sweep(const fs::path& folder) {
  if (fs::exists(folder / "plan.json")) return true;
  if (!fs::exists(folder / "run.json"))
    fail("{}: holds neither run.json nor plan.json: expected the folder of a finished run or sweep",
         folder.string());
  return false;
}

RunConfig rescored_run(const RescoreRequest& request) {
  const fs::path path = request.folder / "run.json";
  const Json run = read_object(path);
  const Json recorded = member(run, "configuration", path);
  if (recorded.contains("estimators"))
    fail("{}: belongs to a sweep, but this folder has no plan.json: expected the folder of the sweep itself",
         path.string());
  RunConfig config;
  try {
    for (const Json& source : member(recorded, "sources", path))
      config.sources.push_back(find_source(source.get<std::string>(), request.data_root));
    Json name = member(recorded, "estimator", path);
    if (!is_external(name))
      fail("{}: estimator {} is not an external program: run it again instead", path.string(),
           json_excerpt(name));
    Json options = member(recorded, "options", path), changes = request.options;
    replace_estimator(request, name, options["estimator"]);
    changes.erase("estimator");
    options.merge_patch(changes);
    config.estimator = name.get<std::string>();
    config.options = options;
    config.noise = Noise(member(recorded, "noise", path));
    config.level = json_member<double>(recorded, "level", path.string());
    config.n_seeds = json_member<int>(recorded, "seeds", path.string());
  } catch (const Json::exception& error) {
    fail("{}: has no valid configuration of a run: {}", path.string(), error.what());
  }
  config.folder = request.folder / "external";
  config.rescore = true;
  return config;
}

SweepConfig rescored_sweep(const RescoreRequest& request) {
  const fs::path path = request.folder / "plan.json";
  const Json file = read_object(path);
  Json plan = member(file, "plan", path), changes = request.options;
  SweepConfig config;
  try {
    int n_external = 0;
    for (Json& estimator : plan.at("estimators")) {
      if (!is_external(estimator.at("name"))) continue;
      ++n_external;
      replace_estimator(request, estimator["name"], estimator["options"]);
    }
    if (n_external == 0) fail("{}: has no external program among its estimators", path.string());
    if (n_external > 1 && !request.config.empty())
      fail("{}: has {} external programs: --config is for one; edit their files, or use --set", path.string(),
           n_external);
    changes.erase("estimator");
    plan["options"].merge_patch(changes);
    const Json& shard = member(file, "shard", path);
    const char* wrong = nullptr;
    for (const auto& [i, number] : {std::pair{0, &config.shard}, std::pair{1, &config.n_shards}})
      if (const char* expected = internal::read_value(shard.at(i), *number)) wrong = expected;
    if (wrong != nullptr || shard.size() != 2 || config.shard >= config.n_shards)
      fail("{}: key 'shard': expected [I, N] with 0 <= I < N, got {}", path.string(), json_excerpt(shard));
  } catch (const Json::exception& error) {
    fail("{}: is not the plan file of a sweep: {}", path.string(), error.what());
  }
  config.plan = parse_plan(json_text(plan), path.string(), request.data_root);
  config.rescored = request.folder;
  return config;
}

}  // namespace sextant
