#include "sextant/eval/external/external_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "sextant/base/error.h"
#include "sextant/datasets/codec/yaml_camera.h"
#include "sextant/datasets/layout.h"
#include "sextant/eval/experiment/interrupt.h"
#include "sextant/eval/external/external_results.h"
#include "sextant/eval/external/noisy_sequence.h"
#include "sextant/eval/external/process.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The folder of a case: input, output, stdout.txt, stderr.txt, log.txt. What is not to be kept goes in the
/// end, also with an exception.
class CaseFolder {
 public:
  CaseFolder(const fs::path& folder, std::string keep) : keep_(folder.empty() ? "nothing" : std::move(keep)) {
    if (folder.empty()) {
      std::string name = (fs::temp_directory_path() / "sextant_case_XXXXXX").string();
      if (::mkdtemp(name.data()) == nullptr) fail("{}: cannot make this folder", name);
      path_ = name;
    } else {
      path_ = fs::absolute(folder).lexically_normal();
      fs::remove_all(path_);  // of a run that was interrupted
    }
    fs::create_directories(output());
  }
  ~CaseFolder() {
    std::error_code ignored;
    if (keep_ != "all") fs::remove_all(input(), ignored);
    if (keep_ != "all" && keep_ != "output") fs::remove_all(output(), ignored);
    if (keep_ == "nothing") fs::remove_all(path_, ignored);
  }
  CaseFolder(const CaseFolder&) = delete;
  CaseFolder& operator=(const CaseFolder&) = delete;

  fs::path input() const { return path_ / "input"; }
  fs::path output() const { return path_ / "output"; }
  fs::path file(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
  std::string keep_;
};

/// Writes the input; returns the layout's name of the sequence.
std::string write_input(const CaseContext& context, const ExternalConfig& config, const CaseFolder& folder) {
  const NoisySequence noisy(context.sequence, context.noise, context.seed, config.write_truth);
  LayoutRequest request;
  request.out = folder.input();
  request.quiet = true;
  request.between_frames = check_interrupt;
  const std::string source = find_layout(config.layout).write(noisy, request);
  const std::string name = SourceSpec::parse(source).sequence;
  return name.empty() ? noisy.info().sequence : name;
}

std::string calibration_text(const SequenceInfo& info) {
  return encode_yaml_camera({info.camera, info.rate_hz}) +
         fmt::format("Camera.width: {}\nCamera.height: {}\n", info.width, info.height);
}

FrameNumbers frame_numbers(const ExternalConfig& config, const SequenceInfo& info) {
  FrameNumbers numbers;
  numbers.first = info.first_frame;
  numbers.last = info.last_frame;
  numbers.in_files = config.layout == "kitti" ? 0 : info.first_frame;  // kitti_layout.h counts from 0
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

std::optional<MeasurementNoise> declared_noise(const FramePair& pair, int body) {
  const auto declared = pair.noise.find(body);
  return declared == pair.noise.end() ? std::nullopt : std::optional(declared->second);
}

/// Points of the object's own previous instance within reach, as the pipeline offers them to estimators:
/// what the bound is computed from.
Correspondences points_of(const ObjectObservation& object, double max_depth_m) {
  std::vector<unsigned char> keep(object.points.size());
  for (size_t i = 0; i < keep.size(); ++i)
    keep[i] = object.instance_prev[i] == object.instance && object.points.depth[i] <= max_depth_m ? 1 : 0;
  return object.points.subset(keep);
}

Eigen::Vector3d centroid(const PinholeCamera& camera, const Correspondences& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < points.size(); ++i)
    sum += camera.backproject(points.u[i], points.v[i], points.depth[i]);
  return sum / static_cast<double>(points.size());
}

/// Gives the program's results pair by pair.
class ExternalSolver final : public PairSolver {
 public:
  ExternalSolver(ExternalResults results, std::vector<std::string> problems, double ms_per_pair,
                 double max_depth_m)
      : results_(std::move(results)),
        problems_(std::move(problems)),
        ms_per_pair_(ms_per_pair),
        max_depth_m_(max_depth_m) {
    for (const auto& [key, motion] : results_.motions) ids_.insert(key.first);
  }

  FrameResult process(const FramePair& pair) override {
    FrameResult result;
    result.prev = pair.prev;
    result.curr = pair.curr;
    result.dt_s = pair.dt_s;
    result.ego = ego(pair);
    std::set<int> seen;
    for (const ObjectObservation& observation : pair.objects) {
      seen.insert(observation.instance);
      if (is_known(observation.instance)) result.objects.push_back(object(pair, observation, result.ego));
    }
    for (const int id : ids_) {  // named by the program, without a mask
      ObjectObservation none;
      none.instance = id;
      if (!seen.contains(id) && results_.motions.contains({id, pair.curr}))
        result.objects.push_back(object(pair, none, result.ego));
    }
    std::ranges::sort(result.objects, {}, &BodyResult::instance);
    return result;
  }

  std::vector<std::string> problems() const override { return problems_; }

 private:
  bool is_known(int id) const { return results_.objects_unreadable || ids_.contains(id); }

  BodyResult ego(const FramePair& pair) const {
    BodyResult body;
    body.area_fraction = body.distance_m = body.moving_share = body.speed_mps = nan;
    body.points = pair.background;
    body.noise = declared_noise(pair, 0);
    body.times.refine_ms = ms_per_pair_;
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
    body.points = points_of(observation, max_depth_m_);
    body.noise = declared_noise(pair, body.instance);
    body.distance_m = nan;
    const auto motion = results_.motions.find({body.instance, pair.curr});
    body.status = results_.objects_unreadable        ? Status::diverged
                  : motion != results_.motions.end() ? Status::ok
                                                     : Status::lost;
    if (body.points.empty()) {
      body.centroid_m.setConstant(nan);
    } else {
      std::vector<double> depths = body.points.depth;
      std::ranges::nth_element(depths, depths.begin() + static_cast<ptrdiff_t>(depths.size() / 2));
      body.distance_m = depths[depths.size() / 2];
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
  double ms_per_pair_;
  double max_depth_m_;
  std::set<int> ids_;
};

std::string log_text(const ProcessRequest& request, const ProcessOutcome& outcome,
                     const ExternalResults& results, const FrameNumbers& numbers,
                     const std::vector<std::string>& problems) {
  std::string text = "command:";
  for (const std::string& word : request.words) text += fmt::format(" '{}'", word);
  text += fmt::format("\nin: {}\nend: {}\nwall: {:.3f} s\n", request.working_directory.string(),
                      outcome.text(), outcome.wall_s);
  text += fmt::format("camera poses: {} of {} frames\nobject motions: {}\n", results.camera.poses().size(),
                      numbers.last - numbers.first + 1, results.motions.size());
  for (const std::string& note : results.notes) text += fmt::format("note: {}\n", note);
  for (const std::string& problem : problems) text += fmt::format("problem: {}\n", problem);
  return text;
}

class ExternalEstimator final : public CaseEstimator {
 public:
  ExternalEstimator(ExternalConfig config, fs::path config_folder)
      : config_(std::move(config)), config_folder_(std::move(config_folder)) {}

  std::unique_ptr<PairSolver> begin(const CaseContext& context) const override {
    const SequenceInfo& info = context.sequence.info();
    const FrameNumbers numbers = frame_numbers(config_, info);
    const CaseFolder folder(context.folder, config_.keep);
    const std::string sequence = write_input(context, config_, folder);
    write_file(folder.file("calibration.yaml"), calibration_text(info));
    const ProcessRequest request =
        request_for(placeholders(context, folder, config_folder_, numbers, sequence), folder);
    const ProcessOutcome outcome = run_process(request);
    ExternalResults results =
        read_external_results(config_, folder.output(), numbers, context.sequence.truth(), outcome.ok());
    std::vector<std::string> problems;
    if (!outcome.ok()) problems.push_back(outcome.text());
    problems.insert(problems.end(), results.problems.begin(), results.problems.end());
    const int n_frames = numbers.last - numbers.first + 1;
    const auto n_poses = static_cast<int>(results.camera.poses().size());
    if (problems.empty() && n_poses < n_frames)
      problems.push_back(fmt::format("camera poses of {} of {} frames", n_poses, n_frames));
    write_file(folder.file("log.txt"), log_text(request, outcome, results, numbers, problems));
    for (std::string& problem : problems) {
      problem = fmt::format("{}: {} ({})", config_.name, problem,
                            context.folder.empty() ? "no logs are kept" : folder.file("log.txt").string());
    }
    return std::make_unique<ExternalSolver>(std::move(results), std::move(problems),
                                            1000 * outcome.wall_s / (n_frames - 1),
                                            context.pipeline.max_object_distance_m);
  }

  Json options() const override { return write_options(config_); }
  std::string label() const override { return config_.name; }

 private:
  ProcessRequest request_for(const Placeholders& values, const CaseFolder& folder) const {
    ProcessRequest request;
    request.words = words_of(config_.command, values);
    request.working_directory = fs::absolute(fill_in(config_.working_directory, values));
    request.environment = words_of(config_.environment, values);
    request.stdout_file = folder.file("stdout.txt");
    request.stderr_file = folder.file("stderr.txt");
    request.time_limit_s = config_.time_limit_s;
    return request;
  }

  ExternalConfig config_;
  fs::path config_folder_;
};

}  // namespace

std::shared_ptr<const CaseEstimator> open_external_estimator(const std::string& config,
                                                             const Json& overrides) {
  return std::make_shared<ExternalEstimator>(read_external_config(config, overrides),
                                             fs::absolute(config).lexically_normal().parent_path());
}

void add_external_estimators() {
  static const bool added = [] {
    add_estimator_kind("external", "external:CONFIG.json", open_external_estimator);
    return true;
  }();
  SEXTANT_CHECK(added);
}

}  // namespace sextant
