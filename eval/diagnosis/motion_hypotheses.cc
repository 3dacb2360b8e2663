#include <set>

#include "sextant/base/quantile.h"
#include "sextant/eval/diagnosis/motion_readings.h"
#include "sextant/eval/diagnosis/number_readings.h"

namespace sextant {
namespace {

constexpr size_t fewest_of_shift =
    7;  // a smooth motion resembles that of the neighbouring frames, so a shift needs many frames
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

/// Returns the factor by which velocities exceed the motions of one frame: the median ratio of the
/// translations, or of the logarithms of the motions. Empty unless it is a plausible frame rate, 5 to 80 Hz.
std::optional<double> rate_of_velocities(const MotionData& data, bool translations_only) {
  constexpr double lowest_hz = 5, highest_hz = 80;
  const auto size = [&](const SE3& motion) {
    return translations_only ? motion.translation().norm() : motion.log().norm();
  };
  std::vector<double> ratios;
  for (const MotionSample& sample : data.samples) {
    if (size(sample.reference) > 0) ratios.push_back(size(sample.given) / size(sample.reference));
  }
  if (ratios.empty()) return std::nullopt;
  const double ratio = upper_median(ratios);
  return ratio >= lowest_hz && ratio <= highest_hz ? std::optional(ratio) : std::nullopt;
}

/// Quantity that is logged at the wrong frame: the motion in the declared frame, or T_curr_prev in camera
/// coordinates, which was then converted to the world with the camera poses of the wrong frame.
enum class ShiftedMotion { declared, in_camera };
std::vector<ShiftedMotion> shifted_motions(MotionFrame declared) {
  if (declared != MotionFrame::world) return {ShiftedMotion::declared};
  return {ShiftedMotion::declared, ShiftedMotion::in_camera};
}

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
    for (const int n : frame_shifts) {
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
  if (declared == MotionFrame::world) {
    constexpr double price_of_displacement = 0.2;
    // The cameras already show that the worlds differ.
    constexpr double strictness_of_known_worlds = 0.4;
    add(
        "displacement",
        "the translations look like displacements of the object's origin, not like the translation of the "
        "rigid motion that maps its points",
        "write t = L_k.t - R L_{k-1}.t, with L = T_world_object and R the rotation of the motion",
        [](const SE3& m, S s) -> Result {
          if (!s.T_world_object) return std::nullopt;
          const Eigen::Vector3d& p = s.T_world_object->translation();
          return SE3(m.rotation(), m.translation() + p - m.rotation() * p);
        },
        price_of_displacement);
    table.push_back(
        {"other_world",
         "the motions look like those in another world: the estimated camera starts elsewhere than the true "
         "one",
         "write motions, poses and camera in the world of the truth, H' = W H inverse(W) with W = "
         "T_true inverse(T_estimated) of the camera in the first frame; --truth SOURCE moves them",
         [](MotionData& data, double& ignored) {
           const std::optional<SE3> W = data.T_true_estimated;
           if (!W) return false;
           for (MotionSample& sample : data.samples) {
             for (std::optional<SE3>* camera : {&sample.T_world_prev, &sample.T_world_curr}) {
               if (*camera) *camera = *W * **camera;
             }
           }
           return change_motions([&W](const SE3& m, S) { return Result(*W * m * W->inverse()); })(data,
                                                                                                  ignored);
         },
         0, false, strictness_of_known_worlds});
  }
  for (const bool rotations : {true, false}) {
    constexpr double price_of_rate = 0.4;
    table.push_back({rotations ? "per_second" : "velocity",
                     fmt::format("the {} look like velocities, {{:.3g}} times the motion of one frame",
                                 rotations ? "motions" : "translations"),
                     rotations ? "write the motion of one frame, exp(log(M) / rate)"
                               : "divide the translations by the frame rate",
                     [rotations](MotionData& data, double& rate) {
                       const auto found = rate_of_velocities(data, !rotations);
                       if (!found) return false;
                       rate = *found;
                       double ignored = 0;
                       return change_motions([rate, rotations](const SE3& m, S) {
                         return Result(rotations ? SE3::exp(m.log() / rate)
                                                 : SE3(m.rotation(), m.translation() / rate));
                       })(data, ignored);
                     },
                     price_of_rate, true});
  }
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
  for (const ShiftedMotion motion : shifted_motions(declared)) {
    for (const int lag : frame_shifts) {
      table.push_back(shift_hypothesis<MotionData>(
          code_of(motion, lag),
          fmt::format("the motion of frame k{}",
                      motion == ShiftedMotion::in_camera ? " in camera coordinates" : ""),
          lag, undo_shift(motion, lag), price_of(motion)));
    }
  }
  return table;
}

std::optional<Explanation> explain_hidden_shift(const MotionData& data) {
  std::optional<FrameShift> found;
  std::string code;
  for (const ShiftedMotion motion : shifted_motions(data.declared)) {
    const auto shift = find_frame_shift(step_errors(data, motion));
    // Both kinds have the same correction where they find the same number of frames.
    if (!shift || (found && (found->frames == shift->frames || found->cost_change <= shift->cost_change)))
      continue;
    found = shift;
    code = code_of(motion, shift->frames);
  }
  if (!found) return std::nullopt;
  return explain_by_shift(*found, code, motion_hypotheses(data.declared), data, motion_residual);
}

}  // namespace sextant
