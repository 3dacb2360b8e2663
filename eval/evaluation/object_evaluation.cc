#include "sextant/eval/evaluation/object_evaluation.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"
#include "sextant/eval/diagnosis/pose_readings.h"
#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/eval/logs/object_association.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/pair_errors.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_errors.h"

namespace sextant {
namespace {

/// A motion, the frame that it is given in, and the poses of its step.
struct FramedMotion {
  std::optional<SE3> motion;
  MotionFrame frame;
  MotionSample at;

  /// Returns the motion in another frame; empty if a pose that this needs is not known.
  std::optional<SE3> in(MotionFrame other) const {
    return motion ? change_frame(*motion, frame, other, at) : std::nullopt;
  }
};

void put_errors(Record& record, const FramedMotion& estimate, const FramedMotion& truth) {
  for (const auto& [frame, suffix] :
       {std::pair(MotionFrame::body, "_body"), std::pair(MotionFrame::world, "_world"),
        std::pair(MotionFrame::camera, "")}) {
    const auto given = estimate.in(frame), expected = truth.in(frame);
    if (given && expected) put(pose_change_error(*given, *expected), suffix, record.errors);
  }
}

void put_velocities(Record& record, const FramedMotion& estimate, const FramedMotion& truth, double dt_s) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const auto given = estimate.in(MotionFrame::body), expected = truth.in(MotionFrame::body);
  if (given) record.values["v_kmh"] = velocity_kmh(*given, origin, dt_s);
  if (!expected) return;
  const double true_kmh = velocity_kmh(*expected, origin, dt_s);
  record.values["v_gt_kmh"] = record.values["v_gt_origin_kmh"] = true_kmh;
  if (!given) return;
  record.errors["Ev_kmh"] = record.errors["Ev_origin_kmh"] =
      velocity_error_kmh(record.values["v_kmh"], true_kmh);
}

/// Metrics in the table: those of objects that need no flow, which logs do not contain.
const std::vector<const MetricDefinition*>& table_metrics() {
  static const std::vector<const MetricDefinition*> metrics = [] {
    std::vector<const MetricDefinition*> of_objects = metrics_for(in_summary);
    std::erase_if(of_objects, [](const MetricDefinition* m) { return m->unit == "px" || m->body == "ego"; });
    return of_objects;
  }();
  return metrics;
}

/// Returns the steps with an estimate or truth.
std::set<ObjectFrame> known_steps(const ObjectLog& log) {
  std::set<ObjectFrame> keys;
  for (const auto& [key, motion] : log.motions) keys.insert(key);
  for (const auto& [key, motion] : log.lost_truth) keys.insert(key);
  for (const auto& [key, pose] : log.true_poses) {
    if (log.true_poses.contains(previous(key)) && !log.resting.contains(key)) keys.insert(key);
  }
  return keys;
}

void add_row(Table& table, const std::string& estimator, const std::string& body, const RecordRefs& records,
             const MetricPreset& preset) {
  RecordRefs estimated = records;
  std::erase_if(estimated, [](const Record* record) { return record->status != Status::ok; });
  const auto n_truth = static_cast<double>(std::ranges::count_if(
      records, [](const Record* record) { return record->status != Status::no_truth; }));
  const auto n_estimated = static_cast<double>(estimated.size());
  const size_t n_compared = numbers_of(estimated, NumberMap::errors, preset.object_Et_key).size();
  std::vector<Cell> cells = {preset.name, estimator,
                             body,        n_truth,
                             n_estimated, n_truth > 0 ? Cell(100.0 * n_estimated / n_truth) : Cell(),
                             n_compared};
  for (const MetricDefinition* metric : table_metrics())
    cells.push_back(summary_number(estimated, *metric, preset));
  const std::string others = other_statuses(records);
  cells.push_back(others.empty() ? Cell() : Cell(others));
  table.add_row(std::move(cells));
}

}  // namespace

std::vector<Record> object_records(const ObjectLog& log, const std::string& dataset,
                                   const std::string& sequence, double rate_hz, uint64_t run) {
  std::set<ObjectFrame> keys = known_steps(log);
  const std::set<int> logged = ids_of(log.motions);
  std::set<int> with_truth;
  for (const ObjectFrame& key : keys) {
    const auto motion = log.motions.find(key);
    if (motion == log.motions.end() || motion->second.truth || log.true_poses.contains(key))
      with_truth.insert(key.first);
  }
  // Steps that neither the log nor its truth contains, between the first and last frame of an object with
  // known truth.
  for (const auto& [id, steps] : missing_steps(log)) {
    for (const int k : steps) {
      if (with_truth.contains(id)) keys.insert({id, k});
    }
  }
  std::vector<Record> records;
  for (const ObjectFrame& key : keys) {
    Record record;
    record.dataset = dataset;
    record.sequence = sequence;
    record.estimator = log.estimator;
    record.seed = run;
    record.frame = key.second;
    record.body = object_body(key.first);
    const auto logged_motion = log.motions.find(key);
    const bool has_motion = logged_motion != log.motions.end();
    auto L = find_pose(log.true_poses, previous(key));
    const auto L_after = find_pose(log.true_poses, key);
    if (!L && L_after && has_motion && logged_motion->second.truth && log.frame == MotionFrame::world)
      L = logged_motion->second.truth->inverse() *
          *L_after;  // the first pose of an object is often not logged
    const auto at = [&](const Trajectory& camera) {
      return MotionSample{key, {}, {}, L, camera.pose(key.second - 1), camera.pose(key.second)};
    };
    FramedMotion estimate{{}, log.frame, at(log.camera)}, truth{{}, log.frame, at(log.true_camera)};
    if (has_motion) estimate.motion = logged_motion->second.estimate;
    if (has_motion && logged_motion->second.truth) {
      truth.motion = logged_motion->second.truth;
    } else if (!has_motion && log.lost_truth.contains(key)) {
      truth.motion = log.lost_truth.at(key);
    } else if (L && L_after && !log.resting.contains(key)) {
      truth.motion = *L_after * L->inverse();
      truth.frame = MotionFrame::world;
    }
    record.status = has_motion ? (truth.motion ? Status::ok : Status::no_truth)
                               : (logged.contains(key.first) ? Status::lost : Status::not_detected);
    put_errors(record, estimate, truth);
    put_velocities(record, estimate, truth, 1 / rate_hz);
    records.push_back(std::move(record));
  }
  check_listed(records);
  return records;
}

Table object_table(const std::vector<Record>& records, std::span<const MetricPreset> presets) {
  Table table{"Object motions under each preset", "", folded_columns({"preset", "estimator"})};
  table.add_columns(
      {Column::text("object"), Column::count("n_truth", "truth"), Column::count("n_estimated", "estimated"),
       Column::number("coverage_percent", "coverage [%]", 1), Column::count("n_compared", "compared")});
  for (const MetricDefinition* metric : table_metrics()) {
    table.columns.push_back(metric_column(*metric));
    if (metric->name == "Ev_kmh") table.columns.back().decimals = 3;
  }
  table.columns.push_back(Column::text("other", "other steps"));
  std::map<std::string, std::map<int, RecordRefs>> estimators;
  for (const Record& record : records)
    estimators[record.estimator][body_order(record.body)].push_back(&record);
  for (const MetricPreset& preset : presets) {
    for (const auto& [estimator, objects] : estimators) {
      RecordRefs all;
      for (const auto& [id, of_object] : objects) {
        add_row(table, estimator, object_text(id), of_object, preset);
        all.insert(all.end(), of_object.begin(), of_object.end());
      }
      add_row(table, estimator, "all", all, preset);
    }
    table.notes.push_back(
        fmt::format("{}: {} ({})", preset.name, preset.description, to_string(preset.aggregate)));
  }
  table.notes.push_back(
      "truth: steps with truth, and steps that the log lacks between an object's first and last frame; "
      "coverage: share of these steps that have an estimate; compared: estimates that can be compared in the "
      "frame of the preset. -: the log does not contain the values that this number needs.");
  return table;
}

namespace {

using Poses = std::map<ObjectFrame, SE3>;

/// Poses of the object `id` at the frames that both sides have.
TrajectoryPair common_paths(const Poses& estimate, const Poses& reference, int id) {
  TrajectoryPair paths;
  for (const auto& [key, pose] : entries_of(estimate, id)) {
    const auto truth = find_pose(reference, key);
    if (!truth) continue;
    for (auto [series, of_side] : {std::pair(&paths.estimate, &pose), std::pair(&paths.reference, &*truth)}) {
      series->add(*of_side);
      series->frames.push_back(key.second);
    }
  }
  return paths;
}

std::optional<PathError> relative(const TrajectoryPair& paths, const std::vector<PosePair>& pairs) {
  if (pairs.empty()) return std::nullopt;
  const auto rmse = [&](PoseRelation relation) {
    return error_statistics(relative_errors(paths.estimate, paths.reference, pairs, relation)).rmse;
  };
  return PathError{pairs.size(), rmse(PoseRelation::trans_part), rmse(PoseRelation::angle_deg)};
}

/// Aligns the estimated path rigidly; nullopt if the positions do not determine an alignment.
std::optional<AlignmentResult> align_path(TrajectoryPair& paths) {
  constexpr size_t fewest = 3;
  if (paths.estimate.size() < fewest) return std::nullopt;
  try {
    return align(paths.estimate, paths.reference, Alignment::se3);
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<PathError> absolute(TrajectoryPair paths) {
  if (!align_path(paths)) return std::nullopt;
  const auto rmse = [&](PoseRelation relation) {
    return error_statistics(absolute_errors(paths.estimate, paths.reference, relation)).rmse;
  };
  return PathError{paths.estimate.size(), rmse(PoseRelation::trans_part), rmse(PoseRelation::angle_deg)};
}

std::optional<ObjectPathErrors::PerAxis> per_axis(const TrajectoryPair& paths) {
  const size_t n = paths.estimate.size();
  if (n < 2) return std::nullopt;
  const SE3 first = paths.reference.pose(0).inverse() * paths.estimate.pose(0);
  ObjectPathErrors::PerAxis axes{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const double weight = 1 / static_cast<double>(n - 1);
  for (size_t k = 1; k < n; ++k) {
    const Vector6d e = (paths.estimate.pose(k).inverse() * paths.reference.pose(k) * first).log();
    axes.mean_m += weight * e.head<3>().cwiseAbs();
    axes.mean_deg += weight * 180 / std::numbers::pi * e.tail<3>().cwiseAbs();
    axes.largest_m = std::max(axes.largest_m, e.head<3>().norm());
  }
  return axes;
}

/// Pairs of each pose and the next one, for RPE; with `successive` only pairs of successive frames.
std::vector<PosePair> steps_of(const PoseSeries& series, bool successive) {
  std::vector<PosePair> pairs;
  for (size_t i = 1; i < series.size(); ++i) {
    if (!successive || series.frames[i] == series.frames[i - 1] + 1)
      pairs.emplace_back(static_cast<int>(i - 1), static_cast<int>(i));
  }
  return pairs;
}

Cell cell(const std::optional<PathError>& error, double PathError::*number) {
  return error ? Cell((*error).*number) : Cell();
}

}  // namespace

std::vector<ObjectPathErrors> object_path_errors(const ObjectLog& log, uint64_t run) {
  std::vector<ObjectPathErrors> out;
  if (log.true_poses.empty()) return out;
  const Poses chained = chained_poses(log);
  std::set<int> ids = ids_of(log.poses);
  ids.merge(ids_of(chained));
  for (const int id : ids) {
    const TrajectoryPair logged = common_paths(log.poses, log.true_poses, id),
                         by_motions = common_paths(chained, log.true_poses, id);
    ObjectPathErrors errors{log.estimator,
                            run,
                            id,
                            absolute(logged),
                            relative(logged, steps_of(logged.estimate, false)),
                            relative(by_motions, steps_of(by_motions.estimate, true)),
                            per_axis(logged)};
    if (errors.rpe || errors.chained_rpe) out.push_back(std::move(errors));
  }
  return out;
}

std::vector<EgoResult> aligned_object_paths(const ObjectLog& log, double rate_hz) {
  std::vector<EgoResult> out;
  for (const int id : ids_of(log.poses)) {
    EgoResult path;
    static_cast<TrajectoryPair&>(path) = common_paths(log.poses, log.true_poses, id);
    const auto alignment = align_path(path);
    if (!alignment) continue;
    path.name = fmt::format("obj_{}", id);
    path.alignment = *alignment;
    path.errors = absolute_errors(path.estimate, path.reference, PoseRelation::trans_part);
    path.statistics = error_statistics(path.errors);
    for (const int frame : path.estimate.frames) path.estimate.stamps_s.push_back(frame / rate_hz);
    out.push_back(std::move(path));
  }
  return out;
}

Table object_path_table(const std::vector<ObjectPathErrors>& errors) {
  Table table{
      "Object poses",
      "RMSE. APE after a rigid alignment of each object's path; RPE over steps of one pose; chained: RPE of "
      "the path chained from the logged motions.",
      folded_columns({"estimator"})};
  table.add_columns({Column::count("run"), Column::text("object"), Column::count("poses"),
                     Column::number("ape_m", "APE [m]", 4), Column::number("ape_deg", "APE [deg]", 4),
                     Column::number("rpe_m", "RPE [m]", 4), Column::number("rpe_deg", "RPE [deg]", 4),
                     Column::number("chained_rpe_m", "chained [m]", 4),
                     Column::number("chained_rpe_deg", "chained [deg]", 4)});
  for (const ObjectPathErrors& e : errors) {
    table.add_row({e.system, e.run + 1, object_text(e.object), e.ape ? Cell(e.ape->n) : Cell(),
                   cell(e.ape, &PathError::Et_m), cell(e.ape, &PathError::ER_deg),
                   cell(e.rpe, &PathError::Et_m), cell(e.rpe, &PathError::ER_deg),
                   cell(e.chained_rpe, &PathError::Et_m), cell(e.chained_rpe, &PathError::ER_deg)});
  }
  if (!std::ranges::all_of(errors, [](const ObjectPathErrors& e) { return e.ape.has_value(); }))
    table.notes.emplace_back(
        "APE is -: the alignment of a path needs at least three poses that do not lie on a line.");
  return table;
}

Table object_axis_table(const std::vector<ObjectPathErrors>& errors) {
  Table table{
      "Object poses, errors per axis",
      "As the Oxford Multimotion benchmark: log of the pose error since the first pose, means of absolute "
      "values, in the object's axes.",
      folded_columns({"estimator"})};
  table.add_columns({Column::count("run"), Column::text("object"), Column::number("x_m", "x [m]", 4),
                     Column::number("y_m", "y [m]", 4), Column::number("z_m", "z [m]", 4),
                     Column::number("rx_deg", "rx [deg]", 3), Column::number("ry_deg", "ry [deg]", 3),
                     Column::number("rz_deg", "rz [deg]", 3), Column::number("largest_m", "largest [m]", 4)});
  for (const ObjectPathErrors& e : errors) {
    if (!e.axes) continue;
    const auto& [m, deg, largest] = *e.axes;
    table.add_row({e.system, e.run + 1, object_text(e.object), m.x(), m.y(), m.z(), deg.x(), deg.y(), deg.z(),
                   largest});
  }
  return table;
}

namespace {

constexpr double fastest_mps = 100;
constexpr double largest_step_m = 50, step_rate_hz = 10;

/// Returns the speed of an object in a step, or a lower bound of it where its place is not known: the object
/// is then assumed to lie within 100 m of the camera, or of the origin.
double speed_of(const SE3& motion, MotionFrame frame, const std::optional<SE3>& T_world_object,
                const std::optional<SE3>& T_world_camera, double rate_hz) {
  if (frame == MotionFrame::body) return motion.translation().norm() * rate_hz;
  if (T_world_object) return body_motion(motion, *T_world_object).translation().norm() * rate_hz;
  constexpr double reach_m = 100;
  const Eigen::Vector3d c = T_world_camera ? T_world_camera->translation() : Eigen::Vector3d::Zero();
  const double by_rotation_m = 2 * std::sin(rotation_angle_rad(motion.rotation()) / 2) * reach_m;
  return std::max(0.0, (motion * c - c).norm() - by_rotation_m) * rate_hz;
}

/// Asks for the unit of a value that is `times` the largest expected one.
std::string ask_for_unit(double times) {
  return fmt::format(": are the translations {}millimetres (divide them by 1000), or is --rate wrong?",
                     times < 100 ? "centimetres (divide them by 100) or " : "");
}

}  // namespace

std::map<ObjectFrame, SE3> true_motions(const ObjectLog& log) {
  std::map<ObjectFrame, SE3> motions = log.lost_truth;
  for (const auto& [key, motion] : log.motions) {
    if (motion.truth) motions.emplace(key, *motion.truth);
  }
  return motions;
}

std::map<ObjectFrame, SE3> camera_poses(const Trajectory& camera) {
  std::map<ObjectFrame, SE3> poses;
  for (const auto& [frame, pose] : camera.poses()) poses.emplace(ObjectFrame(0, frame), pose);
  return poses;
}

PoseSeries object_series(const std::map<ObjectFrame, SE3>& poses, int id) {
  PoseSeries series;
  for (const auto& [key, pose] : entries_of(poses, id)) {
    series.add(pose);
    series.frames.push_back(key.second);
  }
  return series;
}

void check_plausible(const ObjectLog& log, double rate_hz, const std::vector<DataWarning>& found) {
  // `times` is the ratio of the value to the largest expected value.
  const auto because = [&](double times) {
    std::string text;
    for (const DataWarning& diagnosis : found) text += "; " + diagnosis.text;
    return text.empty() ? ask_for_unit(times) : text;
  };
  for (const auto& [key, motion] : true_motions(log)) {
    const double speed_mps = speed_of(motion, log.frame, find_pose(log.true_poses, previous(key)),
                                      log.true_camera.pose(key.second - 1), rate_hz);
    if (speed_mps > fastest_mps) {
      fail(
          "{}: the true speed of object {} at frame {} is {:.4g} m/s at {:.4g} Hz, expected at most {} m/s{}",
          (log.holds_poses_only ? log.pose_lines : log.motion_lines).at(key), key.first, key.second,
          speed_mps, rate_hz, fastest_mps, because(speed_mps / fastest_mps));
    }
  }
  const double most_m = largest_step_m * step_rate_hz / rate_hz;
  const auto check_steps = [&](const std::map<ObjectFrame, SE3>& poses, const LogLines& lines,
                               const char* what) {
    for (const auto& [key, pose] : poses) {
      const auto last = find_pose(poses, previous(key));
      if (!last) continue;
      const double step_m = (pose.translation() - last->translation()).norm();
      if (step_m > most_m) {
        fail("{}: the true {} moves {:.4g} m from frame {} to {}, expected at most {:.4g} m at {:.4g} Hz{}",
             lines.at(key), what, step_m, key.second - 1, key.second, most_m, rate_hz,
             because(step_m / most_m));
      }
    }
  };
  check_steps(log.true_poses, log.pose_lines, "object");
  check_steps(camera_poses(log.true_camera), log.camera_lines, "camera");
}

std::vector<DataWarning> diagnose_speeds(const ObjectLog& log, double rate_hz) {
  std::map<int, std::vector<double>> speeds;
  for (const auto& [key, motion] : log.motions) {
    auto L = find_pose(log.true_poses, previous(key));
    if (!L) L = find_pose(log.poses, previous(key));
    speeds[key.first].push_back(
        speed_of(motion.estimate, log.frame, L, log.camera.pose(key.second - 1), rate_hz));
  }
  std::vector<DataWarning> out;
  for (auto& [id, of_object] : speeds) {
    const double median = upper_median(of_object);
    if (median <= fastest_mps) continue;
    out.push_back(
        {"speed",
         fmt::format("{}, estimated motions of object {}: median speed {:.4g} m/s at {:.4g} Hz, expected "
                     "at most {} m/s{}",
                     log.estimator, id, median, rate_hz, fastest_mps, ask_for_unit(median / fastest_mps))});
  }
  return out;
}

std::map<int, std::vector<int>> identity_steps(const ObjectLog& log) {
  constexpr double moves_m = 0.01;
  const auto step_m = [&](ObjectFrame key, const SE3& motion) {
    const auto L = find_pose(log.true_poses.empty() ? log.poses : log.true_poses, previous(key));
    return log.frame == MotionFrame::world && L ? body_motion(motion, *L).translation().norm()
                                                : motion.translation().norm();
  };
  std::map<int, int> moving, all;
  for (const auto& [key, motion] : log.motions) {
    ++all[key.first];
    moving[key.first] += !is_identity(motion.estimate) && step_m(key, motion.estimate) > moves_m;
  }
  std::map<int, std::vector<int>> out;
  for (const auto& [key, motion] : log.motions) {
    if (!is_identity(motion.estimate)) continue;
    // Without a known truth, an object counts as moving if it moves in most of its other steps.
    const bool moves =
        motion.truth ? step_m(key, *motion.truth) > moves_m : 2 * moving[key.first] > all[key.first] / 2;
    if (moves) out[key.first].push_back(key.second);
  }
  return out;
}

std::map<int, std::vector<int>> missing_steps(const ObjectLog& log) {
  std::map<int, std::set<int>> known;
  for (const auto& [id, frame] : known_steps(log)) known[id].insert(frame);
  std::map<int, std::vector<int>> out;
  for (const auto& [id, steps] : known) {
    for (int k = *steps.begin(); k <= *steps.rbegin(); ++k) {
      // Frames that the data set's truth lacks do not belong to the object.
      const bool counts = !log.truth_of_source || steps.contains(k);
      if (counts && !log.motions.contains({id, k})) out[id].push_back(k);
    }
  }
  return out;
}

std::string ranges_text(const std::vector<int>& frames, size_t most) {
  std::vector<std::string> groups = ranges_of(frames);
  if (groups.size() <= most) return fmt::format("{}", fmt::join(groups, ", "));
  const size_t more = groups.size() - most;
  groups.resize(most);
  return fmt::format("{} and {} more", fmt::join(groups, ", "), more);
}

}  // namespace sextant
