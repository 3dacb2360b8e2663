#include "sextant/eval/diagnosis/motion_readings.h"

#include <cmath>
#include <iterator>

#include "sextant/eval/diagnosis/number_readings.h"

namespace sextant {
namespace {

constexpr double kept_share = 0.8;

MotionData of_objects(MotionData data, const std::set<int>& ids) {
  std::erase_if(data.logged, [&](const auto& at) { return !ids.contains(at.first.first); });
  std::erase_if(data.samples, [&](const MotionSample& sample) { return !ids.contains(sample.key.first); });
  data.not_logged.clear();
  return data;
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

SE3 in_body_frame(const SE3& motion, MotionFrame declared, const MotionSample& sample) {
  if (const auto body = change_frame(motion, declared, MotionFrame::body, sample)) return *body;
  // Without the object's pose the rotation acts about the camera, which is nearer to the object than the
  // origin of the world.
  if (declared != MotionFrame::world || !sample.T_world_prev) return motion;
  return sample.T_world_prev->inverse() * motion * *sample.T_world_prev;
}

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

std::map<int, MotionSample> cameras_of(const std::vector<MotionSample>& samples) {
  std::map<int, MotionSample> cameras;
  for (const MotionSample& sample : samples) {
    cameras.emplace(sample.key.second,
                    MotionSample{sample.key, {}, {}, std::nullopt, sample.T_world_prev, sample.T_world_curr});
  }
  return cameras;
}

std::vector<ObjectExplanation> explain_motions(const MotionData& data) {
  std::vector<Hypothesis<MotionData>> table = motion_hypotheses(data.declared);
  if (!data.quaternions)
    std::erase_if(table, [](const auto& h) { return h.code.starts_with("quaternion_"); });
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
