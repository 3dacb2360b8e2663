#include "sextant/eval/diagnosis/motion_readings.h"

#include <array>
#include <cmath>
#include <iterator>
#include <set>

#include "sextant/eval/diagnosis/number_readings.h"

namespace sextant {
namespace {

constexpr size_t fewest_of_shift =
    7;  // a smooth motion resembles that of the neighbouring frames, so a shift needs many frames
constexpr double kept_share = 0.8;
// Two mistakes at once, and readings for which poses are fitted, are reported only if no cheaper mistake
// explains the data as well.
constexpr double price_of_two = 0.5, price_of_fit = 0.1;

/// Applies `change`, SE3 and sample -> std::optional<SE3>, to every sample and drops the samples without a
/// result.
template <typename Change>
auto change_motions(Change change) {
  return [change](MotionData& data, double&) {
    std::vector<MotionSample> kept;
    for (MotionSample& sample : data.samples) {
      const std::optional<SE3> read = change(sample.given, sample);
      if (!read) continue;
      kept.push_back(std::move(sample));
      kept.back().given = *read;
    }
    // The hypothesis applies only if most samples remain: a reading of a few steps says little about the
    // others.
    const bool most = 2 * kept.size() >= data.samples.size();
    data.samples = std::move(kept);
    return most;
  };
}

const char* words(MotionFrame frame) {
  switch (frame) {
    case MotionFrame::world:
      return "the world frame";
    case MotionFrame::body:
      return "the object's own (body) frame";
    case MotionFrame::camera:
      return "the camera frame (T_curr_prev)";
  }
  return "";
}

/// Converts inverse(C_{k-1}) H C_{k-1}, the motion in the axes of the camera at k-1, to the declared frame.
std::optional<SE3> from_camera_axes(const SE3& motion, MotionFrame declared, const MotionSample& at) {
  if (!at.T_world_prev) return std::nullopt;
  return change_frame(*at.T_world_prev * motion * at.T_world_prev->inverse(), MotionFrame::world, declared,
                      at);
}

/// Returns the motion M for which M M = `motion`, with half the angle of rotation.
SE3 half_of(const SE3& motion) { return SE3::exp(motion.log() / 2); }

MotionData of_objects(const MotionData& data, const std::set<int>& ids) {
  MotionData some{data.declared, {}, {}};
  for (const auto& [key, motion] : data.logged) {
    if (ids.contains(key.first)) some.logged.emplace_hint(some.logged.end(), key, motion);
  }
  for (const MotionSample& sample : data.samples) {
    if (ids.contains(sample.key.first)) some.samples.push_back(sample);
  }
  return some;
}

}  // namespace

double explains_times_of(size_t n_steps) {
  constexpr double few = 10;
  return explains_times * (1 + few / static_cast<double>(std::max(n_steps, fewest_steps)));
}

double squared_residual(const SE3& given, const SE3& reference) {
  const SE3 error = given.inverse() * reference;
  const double turn = 2 * rms_radius_m * std::sin(rotation_angle_rad(error.rotation()) / 2);
  return error.translation().squaredNorm() + turn * turn;
}

std::optional<double> trimmed_mean(std::vector<double> values, size_t fewest) {
  if (values.size() < fewest) return std::nullopt;
  std::ranges::sort(values);
  const auto kept = std::max<size_t>(
      static_cast<size_t>(std::ceil(kept_share * static_cast<double>(values.size()))), fewest);
  double sum = 0;
  for (size_t i = 0; i < kept; ++i) sum += values[i] / static_cast<double>(kept);
  return sum;
}

std::optional<SE3> change_frame(const SE3& motion, MotionFrame from, MotionFrame to, const MotionSample& at) {
  if (from == to) return motion;
  const std::optional<SE3>&L = at.T_world_object, &prev = at.T_world_prev, &curr = at.T_world_curr;
  const auto needs = [&](MotionFrame frame) { return from == frame || to == frame; };
  if (needs(MotionFrame::body) && !L) return std::nullopt;
  if (needs(MotionFrame::camera) && (!prev || !curr)) return std::nullopt;
  SE3 H = motion;
  if (from == MotionFrame::body) H = *L * motion * L->inverse();
  if (from == MotionFrame::camera) H = *curr * motion * prev->inverse();
  if (to == MotionFrame::body) return L->inverse() * H * *L;
  if (to == MotionFrame::camera) return curr->inverse() * H * *prev;
  return H;
}

namespace {

SE3 in_body_frame(const SE3& motion, MotionFrame declared, const MotionSample& sample) {
  if (const auto body = change_frame(motion, declared, MotionFrame::body, sample)) return *body;
  // Without the object's pose the rotation acts about the camera, which is nearer to the object than the
  // origin of the world.
  if (declared != MotionFrame::world || !sample.T_world_prev) return motion;
  return sample.T_world_prev->inverse() * motion * *sample.T_world_prev;
}

double step_residual(const MotionSample& sample, MotionFrame declared) {
  return squared_residual(in_body_frame(sample.given, declared, sample),
                          in_body_frame(sample.reference, declared, sample));
}

MotionData without_motion(MotionData data) {
  for (MotionSample& sample : data.samples) sample.given = SE3();
  return data;
}

/// The residual of the rotations alone.
std::optional<double> rotation_residual(const MotionData& data) {
  std::vector<double> squares;
  for (const MotionSample& sample : data.samples)
    squares.push_back(squared_residual(SE3(sample.given.rotation(), {0, 0, 0}),
                                       SE3(sample.reference.rotation(), {0, 0, 0})));
  return trimmed_mean(std::move(squares), fewest_steps);
}

}  // namespace

std::optional<double> motion_residual(const MotionData& data) {
  std::vector<double> squares;
  for (const MotionSample& sample : data.samples) squares.push_back(step_residual(sample, data.declared));
  return trimmed_mean(std::move(squares), fewest_steps);
}

std::optional<double> null_of_motions(MotionData data) {
  return motion_residual(without_motion(std::move(data)));
}

std::optional<double> stillness_residual(MotionData data) {
  for (MotionSample& sample : data.samples) {
    const auto still = change_frame(SE3(), MotionFrame::world, data.declared, sample);
    if (!still) return std::nullopt;
    sample.reference = *still;
  }
  return motion_residual(data);
}

bool is_plausible(const Reading& reading, std::optional<double> still, double times) {
  return !still || reading.code.find("frame_") == std::string::npos || times * reading.residual <= *still;
}

namespace {

/// Quantity that is logged at the wrong frame: the motion in the declared frame, or T_curr_prev in camera
/// coordinates, which was then converted to the world with the camera poses of the wrong frame.
enum class ShiftedMotion { declared, in_camera };
constexpr std::array shifted_motions = {ShiftedMotion::declared, ShiftedMotion::in_camera};

std::string code_of(ShiftedMotion motion, int lag) {
  return fmt::format("{}lag_{}", motion == ShiftedMotion::in_camera ? "camera_" : "", lag);
}

double price_of(ShiftedMotion motion) {
  return motion == ShiftedMotion::in_camera ? price_of_lag + price_of_fit : price_of_lag;
}

/// Converts the motion H of the frame at `from` to the frame at `to`, so that it is the same in camera
/// coordinates; empty if a camera pose is not known.
std::optional<SE3> at_other_frame(const SE3& H, const MotionSample& from, const MotionSample& to) {
  if (!from.T_world_prev || !from.T_world_curr || !to.T_world_prev || !to.T_world_curr) return std::nullopt;
  return *to.T_world_curr * from.T_world_curr->inverse() * H * *from.T_world_prev *
         to.T_world_prev->inverse();
}

/// Camera poses of each step, by its frame k.
std::map<int, MotionSample> cameras_of(const std::vector<MotionSample>& samples) {
  std::map<int, MotionSample> cameras;
  for (const MotionSample& sample : samples) {
    cameras.emplace(sample.key.second,
                    MotionSample{sample.key, {}, {}, std::nullopt, sample.T_world_prev, sample.T_world_curr});
  }
  return cameras;
}

std::function<bool(MotionData&, double&)> undo_shift(ShiftedMotion motion, int lag) {
  return [motion, lag](MotionData& data, double& ignored) {
    const auto logged = data.logged;
    const auto cameras = cameras_of(data.samples);
    size_t n_known = 0;
    std::set<int> frames;
    // Steps whose shifted counterpart is not logged stay unchanged, so that both readings have the same
    // steps.
    return change_motions([&](const SE3& m, const MotionSample& s) -> std::optional<SE3> {
             const auto other = logged.find({s.key.first, s.key.second + lag});
             if (other == logged.end()) return m;
             std::optional<SE3> read = other->second;
             if (motion == ShiftedMotion::in_camera) {
               const auto at = cameras.find(s.key.second + lag);
               read = at == cameras.end() ? std::nullopt : at_other_frame(other->second, at->second, s);
             }
             if (!read) return m;
             ++n_known;
             frames.insert(s.key.second);
             return read;
           })(data, ignored) &&
           frames.size() >= fewest_of_shift && 2 * n_known >= data.samples.size();
  };
}

}  // namespace

std::vector<Hypothesis<MotionData>> motion_hypotheses(MotionFrame declared) {
  std::vector<Hypothesis<MotionData>> table;
  const auto add = [&](std::string code, std::string cause, std::string remedy, auto change,
                       double price = 0) {
    table.push_back({std::move(code), std::move(cause), std::move(remedy), change_motions(change), price});
  };
  using S = const MotionSample&;
  using Result = std::optional<SE3>;
  // Logs often contain no poses of the objects, which are then fitted.
  const auto knows_poses = [](const MotionData& data) {
    return std::ranges::any_of(data.samples, [](S s) { return s.T_world_object.has_value(); });
  };
  const auto fit_poses_first = [&table, knows_poses](const WorldMotion& in_world) {
    auto& undo = table.back().undo;
    undo = [=, plain = undo](MotionData& data, double& ignored) {
      if (!knows_poses(data)) fit_poses_to_body_reference(data, in_world);
      return plain(data, ignored);
    };
    table.back().price = price_of_fit;
  };
  for (const MotionFrame frame : {MotionFrame::world, MotionFrame::body, MotionFrame::camera}) {
    if (frame == declared) continue;
    add("frame_" + std::string(to_string(frame)),
        fmt::format("the motions look like those in {}, not in {}", words(frame), words(declared)),
        fmt::format("give --frame {}", to_string(frame)),
        [=](const SE3& m, S s) { return change_frame(m, frame, declared, s); });
    if (declared == MotionFrame::body) {
      fit_poses_first([=](S s) { return change_frame(s.given, frame, MotionFrame::world, s); });
    } else if (declared == MotionFrame::world && frame == MotionFrame::body) {
      auto& undo = table.back().undo;
      undo = [knows_poses, plain = undo](MotionData& data, double& ignored) {
        if (knows_poses(data)) return plain(data, ignored);
        fit_poses_to_world_reference(data);
        const bool applies = plain(data, ignored);
        // The residual is taken about the camera, as for the declared reading.
        for (MotionSample& sample : data.samples) sample.T_world_object.reset();
        return applies;
      };
      table.back().price = price_of_fit;
    }
  }
  add(
      "frame_camera_axes",
      fmt::format("the motions look like those in the axes of the camera at frame k-1, not in {}",
                  words(declared)),
      "write C H inverse(C) with C = T_world_camera at frame k-1",
      [=](const SE3& m, S s) { return from_camera_axes(m, declared, s); }, price_of_fit);
  if (declared == MotionFrame::body)
    fit_poses_first([](S s) { return from_camera_axes(s.given, MotionFrame::world, s); });
  add("inverse", "the motions look inverted, from frame k to k-1", "invert each motion",
      [](const SE3& m, S) { return Result(m.inverse()); });
  for (const MotionFrame frame : {MotionFrame::world, MotionFrame::body, MotionFrame::camera}) {
    if (frame == declared) continue;
    add(
        "inverse_frame_" + std::string(to_string(frame)),
        fmt::format("the motions look inverted, and like those in {}", words(frame)),
        fmt::format("invert each motion and give --frame {}", to_string(frame)),
        [=](const SE3& m, S s) { return change_frame(m.inverse(), frame, declared, s); }, price_of_two);
  }
  for (const auto& [code, cause, remedy, read, price] : number_readings("translations", price_of_two))
    add(
        code, cause, remedy, [read = read](const SE3& m, S) { return Result(read(m)); }, price);
  table.push_back({"absolute",
                   "the values look like poses or motions since the first frame, not from frame k-1 to k",
                   "write the motion of each step", [declared](MotionData& data, double& ignored) {
                     const auto logged = data.logged;
                     return change_motions([&](const SE3& m, S s) -> Result {
                       const auto before = find_pose(logged, previous(s.key));
                       if (!before) return std::nullopt;
                       return declared == MotionFrame::body ? before->inverse() * m : m * before->inverse();
                     })(data, ignored);
                   }});
  table.push_back({"two_frames",
                   "the values look like motions over two frames, from k-2 to k, not from k-1 to k",
                   "write the motion from frame k-1 to k for each frame k",
                   [declared](MotionData& data, double& ignored) {
                     const std::map<int, MotionSample> cameras = cameras_of(data.samples);
                     return change_motions([&](const SE3& m, S s) -> Result {
                       if (declared != MotionFrame::camera) return half_of(m);
                       const auto before = cameras.find(s.key.second - 1);
                       if (before == cameras.end() || !before->second.T_world_prev || !s.T_world_curr)
                         return std::nullopt;
                       const SE3 H = *s.T_world_curr * m * before->second.T_world_prev->inverse();
                       return change_frame(half_of(H), MotionFrame::world, declared, s);
                     })(data, ignored);
                   }});
  for (const ShiftedMotion motion : shifted_motions) {
    if (motion == ShiftedMotion::in_camera && declared != MotionFrame::world) continue;
    for (int lag = -longest_shift; lag <= longest_shift; ++lag) {
      if (lag == 0) continue;
      table.push_back(
          {code_of(motion, lag),
           fmt::format("the frame numbers look shifted: the motion of frame k{} stands at frame k{:+d}",
                       motion == ShiftedMotion::in_camera ? " in camera coordinates" : "", lag),
           fmt::format("{} {} {} each frame number", lag > 0 ? "subtract" : "add", std::abs(lag),
                       lag > 0 ? "from" : "to"),
           undo_shift(motion, lag), price_of(motion), false, strictness_of_lag});
    }
  }
  return table;
}

namespace {

/// Errors of the steps, and their changes over the shifts of `motion`.
std::vector<StepError> step_errors(const MotionData& data, ShiftedMotion motion) {
  std::map<ObjectFrame, const MotionSample*> samples;
  for (const MotionSample& sample : data.samples) samples.emplace(sample.key, &sample);
  std::vector<StepError> steps;
  for (const MotionSample& sample : data.samples) {
    const SE3 back = in_body_frame(sample.reference, data.declared, sample).inverse();
    StepError step{sample.key.first,
                   sample.key.second,
                   step_numbers(back * in_body_frame(sample.given, data.declared, sample)),
                   {}};
    for (int n = -longest_shift; n <= longest_shift; ++n) {
      const auto other = samples.find({sample.key.first, sample.key.second - n});
      if (other == samples.end()) continue;
      std::optional<SE3> reference = other->second->reference;
      if (motion == ShiftedMotion::in_camera) reference = at_other_frame(*reference, *other->second, sample);
      if (!reference) continue;
      step.of_shift.emplace(n, step_numbers(back * in_body_frame(*reference, data.declared, sample)));
    }
    steps.push_back(std::move(step));
  }
  return steps;
}

}  // namespace

std::optional<Explanation> explain_hidden_shift(const MotionData& data) {
  std::optional<FrameShift> found;
  std::string code;
  for (const ShiftedMotion motion : shifted_motions) {
    if (motion == ShiftedMotion::in_camera && data.declared != MotionFrame::world) continue;
    const auto shift = find_frame_shift(step_errors(data, motion));
    // Both kinds have the same correction where they find the same number of frames.
    if (!shift || (found && (found->frames == shift->frames || found->cost_change <= shift->cost_change)))
      continue;
    found = shift;
    code = code_of(motion, shift->frames);
  }
  const std::optional<double> declared = motion_residual(data);
  if (!found || !declared) return std::nullopt;
  std::vector<Hypothesis<MotionData>> table = motion_hypotheses(data.declared);
  std::erase_if(table, [&](const auto& h) { return h.code != code; });
  const std::vector<Reading> read = read_as(table, data, motion_residual);
  // A shift that makes the errors larger is no explanation.
  if (read.empty() || read.front().residual > *declared) return std::nullopt;
  return found->explanation(read.front(), *declared);
}

namespace {

/// Returns the ids of the objects that have a reference.
std::set<int> ids_with_reference(const MotionData& data) {
  std::set<int> ids;
  for (const MotionSample& sample : data.samples) ids.insert(sample.key.first);
  return ids;
}

using Residual = std::optional<double>(const MotionData&);

/// Returns the logged motions with an object that stands still in the world as their reference.
MotionData at_rest(const MotionData& data) {
  MotionData read{data.declared, {}, data.logged, data.not_logged};
  const std::map<int, MotionSample> cameras = cameras_of(data.not_logged);
  for (const auto& [key, motion] : data.logged) {
    const auto camera = cameras.find(key.second);
    if (camera == cameras.end()) continue;
    MotionSample sample = camera->second;
    sample.key = key;
    sample.given = motion;
    sample.reference = change_frame(SE3(), MotionFrame::world, data.declared, sample).value_or(SE3());
    read.samples.push_back(sample);
  }
  return read;
}

/// Explains the motions of all objects, or of single ones, by the hypotheses of the table. In the null
/// reading no object moves. The hypothesis `ids` is exempt from the null reading, because
/// exchanged_ids_hypothesis() has already compared it with an object at rest.
std::vector<ObjectExplanation> explain_by(const MotionData& data,
                                          const std::vector<Hypothesis<MotionData>>& table, Residual residual,
                                          const std::optional<Hypothesis<MotionData>>& ids = std::nullopt) {
  std::vector<Hypothesis<MotionData>> with_other_ids;
  if (ids) with_other_ids.push_back(*ids);
  return explain_objects(
      ids_with_reference(data), [&](const std::set<int>& of) -> std::optional<Explanation> {
        const MotionData some = of_objects(data, of);
        const std::optional<double> declared = residual(some);
        if (!declared) return std::nullopt;
        const double times = explains_times_of(some.samples.size());
        std::vector<Reading> readings = read_as(table, some, residual);
        const std::optional<double> still = stillness_residual(some);
        std::erase_if(readings, [&](const Reading& reading) { return !is_plausible(reading, still, times); });
        const std::vector<Reading> other_ids = read_as(with_other_ids, some, residual);
        std::vector<Reading> all = readings;
        std::ranges::copy(other_ids, std::back_inserter(all));
        const auto found = explain(*declared, all, {.null = residual(without_motion(some)), .times = times});
        return found || other_ids.empty() ? found : explain(*declared, other_ids, {.times = times});
      });
}

}  // namespace

std::vector<ObjectExplanation> explain_motions(const MotionData& data) {
  std::vector<Hypothesis<MotionData>> table = motion_hypotheses(data.declared);
  const std::optional<Hypothesis<MotionData>> ids = exchanged_ids_hypothesis(data);
  // Without any reference the motions are compared with objects at rest.
  if (data.samples.empty())
    return ids ? explain_by(at_rest(data), {}, motion_residual, ids) : std::vector<ObjectExplanation>();
  std::vector<ObjectExplanation> out = explain_by(data, table, motion_residual, ids);
  if (out.empty()) {  // errors of the translations can hide transposed rotations
    std::erase_if(table, [](const auto& hypothesis) { return hypothesis.code != "transposed"; });
    out = explain_by(data, table, rotation_residual);
  }
  if (out.empty()) {
    if (const auto shift = explain_hidden_shift(data)) {
      const std::set<int> all = ids_with_reference(data);
      out.push_back({{all.begin(), all.end()}, true, *shift});
    }
  }
  return out;
}

std::optional<Explanation> explain_rotations(const std::map<ObjectFrame, SE3>& motions) {
  const auto mean_square = [](const std::map<ObjectFrame, SE3>& read) {
    std::vector<double> squares;
    for (const auto& [key, motion] : read)
      squares.push_back(squared_residual(SE3(motion.rotation(), {0, 0, 0}), {}));
    return trimmed_mean(std::move(squares), fewest_steps);
  };
  const auto declared = mean_square(motions);
  if (!declared) return std::nullopt;
  std::vector<Hypothesis<std::map<ObjectFrame, SE3>>> table;
  for (const auto& [code, cause, remedy, read, price] : rotation_readings("translations")) {
    table.push_back({code, cause, remedy, [read = read](std::map<ObjectFrame, SE3>& changed, double&) {
                       for (auto& [key, motion] : changed) motion = read(motion);
                       return true;
                     }});
  }
  // Residual of a rotation by 60 degrees.
  constexpr double large = rms_radius_m * rms_radius_m;
  return explain(*declared, read_as(table, motions, mean_square), {.negligible = large});
}

std::vector<int> bodies_that_reverse(const std::map<ObjectFrame, SE3>& body_motions,
                                     const std::vector<Eigen::Vector3d>& forward) {
  constexpr double least_m = 0.1, least_cosine = 0.866, share = 0.95;
  constexpr size_t fewest = 10;
  struct Count {
    size_t moving = 0, backwards = 0;
  };
  std::map<int, Count> counts;
  for (const auto& [key, motion] : body_motions) {
    const Eigen::Vector3d& t = motion.translation();
    if (t.norm() < least_m) continue;
    Count& count = counts[key.first];
    ++count.moving;
    count.backwards += std::ranges::any_of(
        forward, [&](const Eigen::Vector3d& axis) { return -axis.dot(t) > least_cosine * t.norm(); });
  }
  std::vector<int> out;
  for (const auto& [id, count] : counts) {
    if (count.moving < fewest) continue;
    if (static_cast<double>(count.backwards) < share * static_cast<double>(count.moving)) return {};
    out.push_back(id);
  }
  return out;
}

}  // namespace sextant
