#include "sextant/eval/view/viewed_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/crlb.h"
#include "sextant/metrics/pair_errors.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

std::string listed(const std::vector<std::string>& names) {
  constexpr size_t most = 8;
  std::string text;
  for (size_t i = 0; i < std::min(most, names.size()); ++i) text += (i > 0 ? ", " : "") + names[i];
  return names.size() > most ? fmt::format("{} and {} more", text, names.size() - most) : text;
}

}  // namespace

size_t place_of(const std::string& wanted, const std::vector<std::string>& names, const std::string& what,
                const fs::path& folder) {
  if (names.empty()) fail("{}: its configuration has no {}", folder.string(), what);
  if (wanted.empty()) return 0;
  const auto it = std::ranges::find(names, wanted);
  if (it == names.end()) fail("{}: has no {} '{}': it has {}", folder.string(), what, wanted, listed(names));
  return static_cast<size_t>(it - names.begin());
}

namespace {

/// Converts the configuration of a run to a plan with one estimator and one level; that of a sweep is already
/// a plan.
Json plan_of(const Json& configuration, const std::string& where) {
  if (configuration.contains("estimators")) return configuration;
  const Json options = json_object(configuration, "options", where);
  Json plan;
  plan["sources"] = Json::array();
  for (const Json& source : json_list(configuration, "sources", where)) {
    if (!source.is_string()) fail("{}: sources: expected texts, got {}", where, json_excerpt(source));
    plan["sources"].push_back({{"source", source}, {"options", json_object(options, "source", where)}});
  }
  plan["estimators"] = {{{"name", json_member<std::string>(configuration, "estimator", where)},
                         {"options", json_object(options, "estimator", where)}}};
  plan["noise"] = {{{"level", json_member<double>(configuration, "level", where, 0)},
                    {"noise", json_object(configuration, "noise", where)}}};
  plan["seeds"] = json_member<uint64_t>(configuration, "seeds", where, 1);
  plan["options"] = {{"extraction", json_object(options, "extraction", where)},
                     {"pipeline", json_object(options, "pipeline", where)}};
  return plan;
}

/// Reduces `plan` to the requested source, so that the other sources need not exist. Returns its index.
size_t choose_source(Json& plan, const std::string& wanted, const fs::path& folder) {
  std::vector<std::string> names;
  for (const Json& source : json_list(plan, "sources", folder.string()))
    names.push_back(json_member<std::string>(source, "source", (folder / "run.json").string()));
  const size_t place = place_of(wanted, names, "source", folder);
  plan["sources"] = Json::array({plan["sources"][place]});
  return place;
}

/// Reduces `plan` to the requested estimator, so that the others need not exist here. Plans of sweeps label
/// their estimators; a run has one, which choose_case() checks. Returns its index.
size_t choose_estimator(Json& plan, const std::string& wanted, const fs::path& folder) {
  std::vector<std::string> labels;
  const std::string where = (folder / "run.json").string();
  const Json estimators = json_list(plan, "estimators", where);
  if (estimators.size() == 1) return 0;
  for (const Json& estimator : estimators)
    labels.push_back(json_member<std::string>(estimator, "label", where));
  const size_t place = place_of(wanted, labels, "estimator", folder);
  plan["estimators"] = Json::array({estimators[place]});
  return place;
}

/// Changes the entry of an estimator so that it can be opened where its files do not exist: an external
/// program gets the options that the results recorded, so that CONFIG is not read; a function of Python,
/// which is not called, is replaced by a placeholder with its label.
void open_without_its_files(Json& estimator, const std::string& where) {
  const auto name = json_member<std::string>(estimator, "name", where);
  if (name.starts_with(external_prefix)) estimator["options"]["recorded"] = true;
  if (!name.starts_with(python_prefix)) return;
  const auto label = json_member<std::string>(estimator, "label", where, name.substr(python_prefix.size()));
  estimator = {{"name", "joint_flow"}, {"label", label}};
}

/// Returns the index of the requested level, which is the first level if nothing is requested. Throws Error
/// if there is none, and if there are several that only their noise distinguishes.
size_t level_of(const Plan& plan, const CaseChoice& choice, const std::vector<std::string>& levels,
                const fs::path& folder) {
  if (!choice.level && choice.noise.empty()) return place_of("", levels, "level", folder);
  std::vector<size_t> found;
  std::vector<std::string> noises;  // of the requested level
  if (choice.level) place_of(fmt::format("{}", *choice.level), levels, "level", folder);
  for (size_t i = 0; i < plan.levels.size(); ++i) {
    if (choice.level && plan.levels[i].level != *choice.level) continue;
    noises.push_back(plan.levels[i].noise.name());
    if (choice.noise.empty() || choice.noise == noises.back()) found.push_back(i);
  }
  if (found.empty()) place_of(choice.noise, noises, "noise", folder);
  if (found.size() > 1) {
    fail("{}: {} stands for several cases, with the noise {}: give --level and --noise NAME", folder.string(),
         choice.noise.empty() ? fmt::format("level {}", *choice.level) : "noise '" + choice.noise + "'",
         listed(noises));
  }
  return found.front();
}

PlanCase choose_case(const Plan& plan, const CaseChoice& choice, const fs::path& folder) {
  PlanCase c;
  std::vector<std::string> labels, levels, seeds;
  for (const PlanEstimator& estimator : plan.estimators) labels.push_back(estimator.label);
  for (const PlanLevel& level : plan.levels) levels.push_back(fmt::format("{}", level.level));
  for (const uint64_t seed : plan.seeds) seeds.push_back(std::to_string(seed));
  c.estimator = place_of(choice.estimator, labels, "estimator", folder);
  c.level = level_of(plan, choice, levels, folder);
  c.seed = plan.seeds[place_of(choice.seed ? std::to_string(*choice.seed) : "", seeds, "seed", folder)];
  return c;
}

/// Selects points evenly, the same ones in every run.
DrawnPoints drawn_points(const BodyResult& body, const PinholeCamera& camera) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  DrawnPoints drawn;
  const Correspondences& points = body.points;
  const MotionEstimate& estimate = body.estimate;
  const bool is_estimated = body.status == Status::ok && estimate.inliers.size() == points.size();
  const bool is_refined = is_estimated && estimate.refined_flow_u.size() == points.size();
  PointFlow predicted;
  if (is_estimated) predicted = induced_flow(camera, estimate.T_curr_prev, points);
  drawn.n_all = static_cast<int>(points.size());
  const size_t n = points.size(), kept = std::min<size_t>(n, max_drawn_points);
  for (size_t k = 0; k < kept; ++k) {
    const size_t i = k * n / kept;
    if (!points.has_pixels(i)) continue;
    drawn.points.push_back(
        {points.u[i], points.v[i], points.flow_u[i], points.flow_v[i], is_estimated ? predicted.u[i] : none,
         is_estimated ? predicted.v[i] : none, is_refined ? estimate.refined_flow_u[i] : none,
         is_refined ? estimate.refined_flow_v[i] : none, is_estimated && estimate.inliers[i] != 0});
  }
  return drawn;
}

std::vector<Record> without_times(std::vector<Record> records) {
  for (Record& record : records) record = strip_times(std::move(record));
  return records;
}

/// Runs the case again and keeps what the page shows. `case_folder` has the files of an external program.
void add_pairs(const Plan& plan, const PlanCase& c, const fs::path& case_folder, int jobs, bool quiet,
               ViewedRun& run) {
  const Sequence& sequence = *run.sequence;
  const SequenceInfo& info = sequence.info();
  CaseSettings settings = case_settings(plan, c);
  settings.rescore = true;  // external programs are not started
  settings.folder = case_folder;
  PairReader reader(sequence, plan.estimators[c.estimator].extraction, settings.noise, jobs);
  std::vector<ExtractedPair> window;
  const auto next = [&]() -> std::span<const ExtractedPair> { return window = reader.next(); };
  Progress progress(info.sequence + " pairs", info.last_frame - info.first_frame, quiet);
  std::vector<FrameResult> results;  // without their points
  const auto keep = [&](const FrameResult& result, std::span<const Record>) {
    FrameResult lean = result;
    std::vector<BodyResult*> bodies = {&lean.ego};
    for (BodyResult& body : lean.objects) bodies.push_back(&body);
    for (BodyResult* body : bodies) {
      const std::string name = body->instance == 0 ? "ego" : object_body(body->instance);
      run.pairs[result.curr][name] = {drawn_points(*body, info.camera.left), error_band(*body, result), {}};
      body->points = {};
    }
    results.push_back(std::move(lean));
    progress.advance();
  };
  CaseOutcome outcome = std::move(run_cases(sequence, {settings}, next, 1, keep).front());

  run.tracks = body_tracks(outcome.motions, sequence.truth(), info);
  std::map<int, std::map<int, Eigen::Vector3d>> positions;  // positions of objects by frame
  for (const BodyTrack& track : run.tracks) {
    if (track.body == "ego") continue;
    const int id = body_order(track.body);
    for (const TrackPoint& point : track.points) {
      if (point.estimate_m) positions[point.frame][id] = *point.estimate_m;
    }
  }
  PositionCovariances covariances;
  for (const FrameResult& result : results) {
    const std::optional<SE3> T_world_curr = outcome.motions.estimated.pose(result.curr);
    if (!T_world_curr) break;
    for (const auto& [body, covariance] : covariances.add(result, *T_world_curr, positions[result.curr]))
      run.pairs[result.curr][body].position = covariance;
  }
  if (without_times(outcome.records) != without_times(run.records)) {
    run.notes.push_back(
        "Its records differ from those of the current program: points, covariances and paths are computed by "
        "the current program, numbers are those of the folder.");
  }
}

/// Records of the case by frame; for an estimator with several results, the first.
std::vector<Record> records_of(const fs::path& folder, const SequenceInfo& info, const ViewedRun& run) {
  std::vector<Record> records;
  for (Record& record : read_records(folder / "records.jsonl")) {
    if (record.dataset == info.dataset && record.sequence == info.sequence && record.noise == run.noise &&
        record.level == run.level && record.seed == run.seed && record.estimator == run.estimator &&
        record.frame >= info.first_frame && record.frame <= info.last_frame)
      records.push_back(std::move(record));
  }
  return records;
}

std::shared_ptr<const Sequence> open(const SourceSpec& spec, const fs::path& folder) {
  try {
    return open_source(spec);
  } catch (const Error& error) {
    fail("{}: its source '{}' cannot be opened: {}. Give the folder that holds it with --data",
         folder.string(), spec.text, error.what());
  }
}

}  // namespace

ViewedRun view_run(const fs::path& folder, const CaseChoice& choice, const std::string& data_root, int jobs,
                   bool quiet) {
  const Json json = read_run_json(folder);
  const std::string where = (folder / "run.json").string();
  if (!json.contains("configuration"))
    fail("{}: has no 'configuration': expected a folder of `sextant run`, `sweep` or `merge`", where);
  Json description = plan_of(json["configuration"], where + ": configuration");
  const bool is_sweep = json["configuration"].contains("estimators");
  const size_t source_place = choose_source(description, choice.source, folder);
  const std::string source = description["sources"][0]["source"].get<std::string>();
  const size_t n_estimators = json_list(description, "estimators", where).size();
  const size_t estimator_place = choose_estimator(description, choice.estimator, folder);
  Json& estimator = description["estimators"][0];
  const auto name = json_member<std::string>(estimator, "name", where);
  open_without_its_files(estimator, where);

  ViewedRun run;
  run.folder = folder.string();
  run.source = source;
  run.version = json_member<std::string>(json, "version", where, "");
  if (const auto commit = json_member<std::string>(json, "git_commit", where, ""); !commit.empty())
    run.version += " (" + commit.substr(0, 10) + ")";
  SourceSpec spec = find_source(source, data_root);
  spec.add_options(json_object(description["sources"][0], "options", where));
  run.sequence = open(spec, folder);
  const Plan plan = parse_plan(json_line(description), where, data_root);
  const PlanCase c = choose_case(plan, choice, folder);
  run.n_cases = plan.n_cases() * n_estimators;
  run.estimator = plan.estimators[c.estimator].label;
  run.noise = plan.levels[c.level].noise.name();
  run.level = plan.levels[c.level].level;
  run.seed = c.seed;
  run.records = records_of(folder, run.sequence->info(), run);
  if (run.records.empty())
    fail("{}: has no records of {}, {}, level {}, seed {}: is it finished?",
         (folder / "records.jsonl").string(), source, run.estimator, run.level, run.seed);
  if (name.starts_with(python_prefix)) {
    run.notes.push_back(fmt::format(
        "Points and paths of {} cannot be computed again: a function of Python exists only in the "
        "process that ran it.",
        name));
    return run;
  }
  try {
    check_runnable(spec, *run.sequence);
    // Cases of a sweep are numbered as in Plan::at().
    const auto seed_place = static_cast<size_t>(std::ranges::find(plan.seeds, c.seed) - plan.seeds.begin());
    const size_t level_number =
        (source_place * n_estimators + estimator_place) * plan.levels.size() + c.level;
    const std::string case_name = is_sweep ? case_folder(level_number * plan.seeds.size() + seed_place)
                                           : case_folder(run.sequence->info(), c.seed);
    add_pairs(plan, c, folder / "external" / case_name, jobs, quiet, run);
  } catch (const Error& error) {
    if (!name.starts_with(external_prefix)) throw;
    run.notes.push_back(
        fmt::format("Points and paths of an external program cannot be computed again: {}", error.what()));
  }
  return run;
}

std::map<std::string, SE3> estimated_poses(const std::vector<BodyTrack>& tracks, int frame) {
  std::optional<SE3> T_world_camera;
  std::map<std::string, SE3> T_camera_object;
  for (const BodyTrack& track : tracks) {
    const TrackPoint* point = track.find(frame);
    if (point == nullptr || track.body != "ego") continue;
    T_world_camera = point->estimate();
    if (!T_world_camera) T_world_camera = point->truth();
  }
  if (!T_world_camera) return {};
  for (const BodyTrack& track : tracks) {
    const TrackPoint* point = track.find(frame);
    if (point == nullptr || track.body == "ego") continue;
    if (const auto T = point->estimate()) T_camera_object.emplace(track.body, T_world_camera->inverse() * *T);
  }
  return T_camera_object;
}

ViewedRun view_folder(const fs::path& folder, const CaseChoice& choice, const std::string& images,
                      const std::string& data_root, int jobs, bool quiet) {
  if (!is_of_logs(folder)) return view_run(folder, choice, data_root, jobs, quiet);
  return view_records(folder, choice, images,
                      images.empty() ? nullptr : open(find_source(images, data_root), folder));
}

namespace {

constexpr double deg_per_rad = 180.0 / std::numbers::pi;
constexpr double none = std::numeric_limits<double>::quiet_NaN();

bool has_covariance(const BodyResult& body) {
  return body.status == Status::ok && body.estimate.covariance.allFinite() &&
         body.estimate.covariance.trace() > 0;
}

/// Derivative d(exp(e) p) / d e.
Eigen::Matrix<double, 3, 6> point_jacobian(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -skew(p);
  return J;
}

TopViewCovariance from_above(const Eigen::Matrix3d& C) { return {C(0, 0), C(0, 2), C(2, 2)}; }

double speed_band_kmh(const BodyResult& body, const FrameResult& frame) {
  if (!has_covariance(frame.ego)) return none;
  const SE3& X = body.estimate.T_curr_prev;
  const SE3& X0 = frame.ego.estimate.T_curr_prev;
  const Eigen::Vector3d moved = object_motion_prev(X0, X) * body.centroid_m - body.centroid_m;
  if (moved.norm() == 0) return none;
  // H c = X0^-1 X c: both motions turn and shift the same point of the current camera, in opposite
  // directions.
  const Eigen::RowVector<double, 6> along =
      (X0.rotation() * moved.normalized()).transpose() * point_jacobian(X * body.centroid_m);
  const double variance =
      along * (body.estimate.covariance + frame.ego.estimate.covariance) * along.transpose();
  return normal_quantile(0.5 + band_probability / 2) * std::sqrt(variance) / frame.dt_s * kmh_per_mps;
}

}  // namespace

double length_quantile(const Eigen::Matrix3d& covariance, double p) {
  const double mean_square = covariance.trace();
  const double half_variance = covariance.squaredNorm();  // trace(C C)
  if (!(mean_square > 0)) return 0;
  const double dof = mean_square * mean_square / half_variance;
  return std::sqrt(half_variance / mean_square * chi_square_quantile(p, dof));
}

ErrorBand error_band(const BodyResult& body, const FrameResult& frame) {
  if (!has_covariance(body)) return {none, none, none};
  const bool is_camera = body.instance == 0;
  const Matrix6d C = is_camera ? body.estimate.covariance
                               : transported(body.estimate.covariance, body.estimate.T_curr_prev.inverse());
  return {length_quantile(C.topLeftCorner<3, 3>(), band_probability),
          length_quantile(C.bottomRightCorner<3, 3>(), band_probability) * deg_per_rad,
          is_camera ? none : speed_band_kmh(body, frame)};
}

std::map<std::string, TopViewCovariance> PositionCovariances::add(
    const FrameResult& frame, const SE3& T_world_curr, const std::map<int, Eigen::Vector3d>& objects_m) {
  std::map<std::string, TopViewCovariance> out;
  if (!has_covariance(frame.ego)) return out;
  const auto in_world = [&](const Matrix6d& C, const Eigen::Vector3d& p) -> Eigen::Matrix3d {
    const auto J = point_jacobian(p);
    return J * C * J.transpose();
  };
  const Matrix6d ego_step = transported(frame.ego.estimate.covariance, T_world_curr);
  camera_ += ego_step;
  out["ego"] = from_above(in_world(camera_, T_world_curr.translation()));
  for (const BodyResult& body : frame.objects) {
    const auto position = objects_m.find(body.instance);
    if (!has_covariance(body) || position == objects_m.end()) continue;
    Object& object = objects_[body.instance];
    if (object.last != frame.prev) object.covariance.setZero();
    object.last = frame.curr;
    object.covariance +=
        in_world(transported(body.estimate.covariance, T_world_curr) + ego_step, position->second);
    out[object_body(body.instance)] = from_above(object.covariance);
  }
  return out;
}

}  // namespace sextant
