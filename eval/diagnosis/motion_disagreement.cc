#include "sextant/eval/diagnosis/motion_disagreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant {

std::string MotionFactor::text() const {
  return fmt::format("{:.3g} +- {:.2g} times", factor, standard_error);
}

double rms_length(std::span<const Eigen::Vector3d> vectors) {
  double squares = 0;
  for (const Eigen::Vector3d& v : vectors) squares += v.squaredNorm();
  return std::sqrt(squares / static_cast<double>(vectors.size()));
}

std::optional<MotionFactor> motion_factor(std::span<const Eigen::Vector3d> truth,
                                          std::span<const Eigen::Vector3d> estimate) {
  SEXTANT_CHECK(truth.size() == estimate.size());
  constexpr size_t n_stretches = 10;
  if (truth.size() < fewest_vectors) return std::nullopt;
  struct Sums {
    double et = 0, tt = 0;
  };
  std::array<Sums, n_stretches> stretches;
  Sums all;
  for (size_t i = 0; i < truth.size(); ++i) {
    Sums& stretch = stretches[i * n_stretches / truth.size()];
    for (Sums* sums : {&stretch, &all}) {
      sums->et += estimate[i].dot(truth[i]);
      sums->tt += truth[i].squaredNorm();
    }
  }
  if (!(all.tt > 0)) return std::nullopt;
  MotionFactor out{.factor = all.et / all.tt};
  double squares = 0;
  for (const Sums& without : stretches) {
    if (!(all.tt - without.tt > 1e-9 * all.tt)) return MotionFactor{out.factor, INFINITY};
    squares += std::pow((all.et - without.et) / (all.tt - without.tt) - out.factor, 2);
  }
  out.standard_error = std::sqrt(squares * (n_stretches - 1) / n_stretches);
  return out;
}

std::optional<MotionFactor> wrong_factor(std::span<const Eigen::Vector3d> truth,
                                         std::span<const Eigen::Vector3d> estimate, double least_rms) {
  constexpr double lowest = 0.6, highest = 1.6, negative = -0.3, n_errors = 4;
  const auto found = motion_factor(truth, estimate);
  if (!found) return std::nullopt;
  const bool is_clear = rms_length(truth) >= least_rms;
  const double reach = n_errors * found->standard_error;
  const bool differs =
      found->factor + reach < (is_clear ? lowest : negative) || (is_clear && found->factor - reach > highest);
  return differs ? found : std::nullopt;
}

namespace {

/// Motion of an object from frame k-1 to k in its own frame, with the rotations in the axes of the world.
struct ObjectStep {
  ObjectFrame key;
  Eigen::Vector3d true_m, estimated_m, true_rad, estimated_rad;
  std::optional<Eigen::Vector3d> camera_rad;  ///< rotation of the camera
};

std::vector<ObjectStep> steps_of(const MotionData& data) {
  std::vector<ObjectStep> steps;
  for (const MotionSample& sample : data.samples) {
    const std::optional<SE3>& L = sample.T_world_object;
    if (!L && data.declared != MotionFrame::body) continue;
    const SE3 truth = in_body_frame(sample.reference, data.declared, sample);
    const SE3 estimate = in_body_frame(sample.given, data.declared, sample);
    const Eigen::Quaterniond to_world = L ? L->rotation() : Eigen::Quaterniond::Identity();
    ObjectStep step{sample.key,
                    truth.translation(),
                    estimate.translation(),
                    to_world * so3_log(truth.rotation()),
                    to_world * so3_log(estimate.rotation()),
                    std::nullopt};
    if (L && sample.T_world_prev && sample.T_world_curr) {
      step.camera_rad =
          so3_log(sample.T_world_curr->rotation() * sample.T_world_prev->rotation().conjugate());
    }
    steps.push_back(std::move(step));
  }
  return steps;
}

/// Adds a vector of the steps over up to eight successive frames of an object; leaves out steps without it.
template <typename VectorOf>
std::vector<Eigen::Vector3d> sums_over_frames(const std::vector<ObjectStep>& steps,
                                              const VectorOf& vector_of) {
  constexpr size_t most = 8, wanted_sums = 20;
  const size_t n = std::clamp<size_t>(steps.size() / wanted_sums, 1, most);
  std::vector<Eigen::Vector3d> sums;
  size_t n_added = n;
  for (size_t i = 0; i < steps.size(); ++i) {
    const bool continues = i > 0 && steps[i - 1].key == previous(steps[i].key);
    if (n_added == n || !continues) {
      sums.push_back(Eigen::Vector3d::Zero());
      n_added = 0;
    }
    ++n_added;
    sums.back() += vector_of(steps[i]);
  }
  return sums;
}

/// Finds translations that agree with the true ones little better than if every object stood still.
std::optional<DataWarning> unexplained_translations(const std::vector<ObjectStep>& steps) {
  constexpr double least_m = 0.1, largest_share = 0.5;
  std::vector<double> errors_m2, motions_m2;
  for (const ObjectStep& step : steps) {
    if (step.true_m.norm() < least_m) continue;
    errors_m2.push_back((step.estimated_m - step.true_m).squaredNorm());
    motions_m2.push_back(step.true_m.squaredNorm());
  }
  const auto error_m2 = trimmed_mean(errors_m2, fewest_vectors);
  const auto motion_m2 = trimmed_mean(motions_m2, fewest_vectors);
  if (!error_m2 || *error_m2 <= largest_share * *motion_m2) return std::nullopt;
  return DataWarning{
      "unexplained",
      fmt::format(
          "in their own frames the objects are off by {:.3g} m a frame (RMS, without the largest fifth), "
          "although they move by {:.3g} m only: are the translations in another unit or frame, over "
          "another number of frames, or of another recording?",
          std::sqrt(*error_m2), std::sqrt(*motion_m2))};
}

std::optional<DataWarning> large_rotations(const MotionData& data) {
  constexpr double largest_rad = 45 * degree, least_share = 0.1;
  constexpr size_t fewest = 3;
  size_t n = 0;
  for (const MotionSample& sample : data.samples)
    n += rotation_angle_rad(sample.given.rotation()) > largest_rad &&
         rotation_angle_rad(sample.reference.rotation()) <= largest_rad;
  if (n < fewest || static_cast<double>(n) < least_share * static_cast<double>(data.samples.size()))
    return std::nullopt;
  return DataWarning{
      "large_rotations",
      fmt::format(
          "{} of {} turn an object by more than 45 deg from one frame to the next: are its angles degrees "
          "that were read as radians, or do headings flip by 180 deg?",
          n, data.samples.size())};
}

}  // namespace

std::vector<DataWarning> disagreements_of(const MotionData& data) {
  constexpr double least_m = 0.1, least_rad = 1 * degree, most_of_camera = 0.4, n_errors = 4;
  if (const auto found = large_rotations(data)) return {*found};
  std::vector<DataWarning> out;
  std::vector<ObjectStep> steps = steps_of(data);
  const auto sums = [&](auto vector_of) { return sums_over_frames(steps, vector_of); };
  const auto of_translations =
      wrong_factor(sums([](const ObjectStep& step) { return step.true_m; }),
                   sums([](const ObjectStep& step) { return step.estimated_m; }), least_m);
  const auto of_rotations =
      wrong_factor(sums([](const ObjectStep& step) { return step.true_rad; }),
                   sums([](const ObjectStep& step) { return step.estimated_rad; }), least_rad);
  if (of_translations) {
    out.push_back(
        {"translation_factor",
         fmt::format("the translations are {} the true ones, in the objects' own frames: are they in "
                     "another unit or frame, or over another number of frames?",
                     of_translations->text())});
  } else if (auto found = unexplained_translations(steps)) {
    out.push_back(std::move(*found));
  }
  if (of_rotations) {
    out.push_back(
        {"rotation_factor", fmt::format("the rotations are {} the true ones: do the headings have the "
                                        "opposite sign, or are there none?",
                                        of_rotations->text())});
  }
  std::erase_if(steps, [](const ObjectStep& step) { return !step.camera_rad; });
  const std::vector<Eigen::Vector3d> camera_rad =
      sums([](const ObjectStep& step) { return *step.camera_rad; });
  if (camera_rad.empty() || rms_length(camera_rad) < least_rad) return out;
  const auto of_camera = motion_factor(camera_rad, sums([](const ObjectStep& step) -> Eigen::Vector3d {
                                         return step.estimated_rad - step.true_rad;
                                       }));
  if (of_camera && std::abs(of_camera->factor) - n_errors * of_camera->standard_error > most_of_camera) {
    out.push_back(
        {"camera_rotation",
         fmt::format("their errors of rotation are {} the rotation of the camera: are headings given "
                     "against the camera or the line of sight (KITTI's alpha), with the opposite "
                     "sign, or not at all?",
                     of_camera->text())});
  }
  return out;
}

}  // namespace sextant
