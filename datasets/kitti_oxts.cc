#include "sextant/datasets/kitti_oxts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sextant/base/quantile.h"

namespace sextant {
namespace {

constexpr double walk_rad = 0.0004;    // step of the random walk `slow` between samples
constexpr double velocity_mps = 0.02;  // noise across the course
constexpr double lever_prior_m = 1;
constexpr double shortest_step_s = 1e-3;  // if length / speed is shorter, the positions do not change
constexpr double fault_m = 0.5;           // the largest difference in the nine sequences in use is 0.3 m
constexpr double fault_deviations = 10;
constexpr double deg = 180 / std::numbers::pi;
constexpr size_t turn_rates = 6;  // wx, wy, wz among KittiOxts::rest

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

Eigen::Vector3d turn_rate(const KittiOxts& sample) {
  return {sample.rest[turn_rates], sample.rest[turn_rates + 1], sample.rest[turn_rates + 2]};
}

/// Minimises over x the sum of w_k (x_k - y_k)^2 and ((x_k+1 - x_k) / walk)^2; at least one weight must be
/// positive.
class WalkSmoother {
 public:
  explicit WalkSmoother(Eigen::VectorXd weight) : weight_(std::move(weight)), pivot_(weight_) {
    const Eigen::Index n = pivot_.size();
    for (Eigen::Index k = 0; k < n; ++k) {
      pivot_[k] += coupling * ((k > 0) + (k + 1 < n));
      if (k > 0) pivot_[k] -= coupling * coupling / pivot_[k - 1];
    }
  }

  Eigen::VectorXd operator()(const Eigen::VectorXd& y) const {
    Eigen::VectorXd x = weight_.cwiseProduct(y);
    for (Eigen::Index k = 1; k < x.size(); ++k) x[k] += coupling / pivot_[k - 1] * x[k - 1];
    x[x.size() - 1] /= pivot_[x.size() - 1];
    for (Eigen::Index k = x.size() - 1; k > 0; --k) x[k - 1] = (x[k - 1] + coupling * x[k]) / pivot_[k - 1];
    return x;
  }

 private:
  static constexpr double coupling = 1 / (walk_rad * walk_rad);
  Eigen::VectorXd weight_, pivot_;
};

double yaw_of(const SE3& pose) {
  const Eigen::Vector3d ahead = pose.rotation() * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

/// A step whose length contradicts the measured speed.
struct OxtsFault {
  size_t step = 0;  ///< from this sample to the next one
  double length_m = 0, expected_m = 0;
};
struct OxtsFaults {
  double step_s = 0;   ///< median of length / speed
  double limit_m = 0;  ///< largest difference of length and speed x step_s that is no fault
  std::vector<OxtsFault> faults;
};

/// Compares the length of every step with the speed. Medians determine the time and the scatter, so that the
/// faults do not raise the limit that finds them. `poses` are kitti_imu_poses(samples).
OxtsFaults oxts_faults(const std::vector<KittiOxts>& samples, const std::vector<SE3>& poses) {
  OxtsFaults out;
  std::vector<OxtsFault> steps;
  std::vector<double> speeds, times, scatter;
  for (size_t i = 0; i + 1 < poses.size(); ++i) {
    const double length_m = (poses[i + 1].translation() - poses[i].translation()).norm();
    speeds.push_back(kitti_mean_speed_mps(samples, i));
    steps.push_back({i, length_m, 0});
    if (speeds[i] > kitti_slow_mps && length_m > 0) times.push_back(length_m / speeds[i]);
  }
  if (times.empty()) return out;
  out.step_s = upper_median(times);
  for (OxtsFault& step : steps) {
    step.expected_m = out.step_s * speeds[step.step];
    if (speeds[step.step] > kitti_slow_mps) scatter.push_back(std::abs(step.length_m - step.expected_m));
  }
  out.limit_m = std::max(fault_m, fault_deviations * 1.4826 * upper_median(scatter));
  for (const OxtsFault& step : steps) {
    if (std::abs(step.length_m - step.expected_m) > out.limit_m) out.faults.push_back(step);
  }
  return out;
}

}  // namespace

double kitti_mean_speed_mps(const std::vector<KittiOxts>& samples, size_t i) {
  return (samples[i].velocity_mps.norm() + samples[i + 1].velocity_mps.norm()) / 2;
}

std::vector<SE3> kitti_imu_poses(const std::vector<KittiOxts>& samples) {
  const double scale = mercator_scale(samples.front().latitude_deg);
  std::vector<SE3> poses;
  poses.reserve(samples.size());
  for (KittiOxts sample : samples) {
    // East of +180 degrees, longitudes continue at -180 degrees: the difference to the first sample decides.
    const double turned = sample.longitude_deg - samples.front().longitude_deg;
    if (std::abs(turned) > 180) sample.longitude_deg -= std::copysign(360, turned);
    poses.push_back(pose_from_oxts(sample, scale));
  }
  return poses;
}

std::optional<StepFloor> kitti_step_floor(const std::vector<KittiOxts>& samples) {
  if (samples.empty()) return std::nullopt;
  const std::vector<SE3> poses = kitti_imu_poses(samples);
  std::vector<std::pair<double, double>> steps;  // length (m), speed (m/s)
  double sum_s = 0;
  double sum_across = 0;
  for (size_t i = 0; i + 1 < poses.size(); ++i) {
    const double speed = kitti_mean_speed_mps(samples, i);
    if (!(speed > kitti_slow_mps)) continue;
    const Eigen::Vector3d step = poses[i + 1].translation() - poses[i].translation();
    const Eigen::Vector3d velocity = (samples[i].map_velocity_mps() + samples[i + 1].map_velocity_mps()) / 2;
    steps.emplace_back(step.norm(), speed);
    sum_s += step.norm() / speed;
    sum_across += step.cross(velocity.normalized()).squaredNorm();
  }
  if (steps.empty()) return std::nullopt;
  StepFloor out;
  out.n_steps = static_cast<int>(steps.size());
  out.mean_s = sum_s / out.n_steps;
  if (!(out.mean_s > shortest_step_s)) return std::nullopt;
  double sum_squares = 0;
  for (const auto& [length_m, speed] : steps) sum_squares += std::pow(length_m - out.mean_s * speed, 2);
  out.floor_m = std::sqrt(sum_squares / out.n_steps);
  out.across_m = std::sqrt(sum_across / out.n_steps);
  return out;
}

std::optional<CourseFit> kitti_course(const std::vector<KittiOxts>& samples, double step_s, double lag_s) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::VectorXd beta = Eigen::VectorXd::Zero(n), turn = beta, weight = beta;
  for (Eigen::Index k = 0; k < n; ++k) {
    const KittiOxts& at = samples[static_cast<size_t>(k)];
    const double speed = std::hypot(at.east_mps, at.north_mps);
    if (!(speed > kitti_slow_mps)) continue;
    const KittiOxts& before = samples[static_cast<size_t>(std::max<Eigen::Index>(k - 1, 0))];
    const KittiOxts& after = samples[static_cast<size_t>(std::min(k + 1, n - 1))];
    const double apart_s = step_s * static_cast<double>((k > 0) + (k + 1 < n));
    const double ahead = lag_s / std::max(apart_s, step_s);
    const double east = at.east_mps + ahead * (after.east_mps - before.east_mps);
    const double north = at.north_mps + ahead * (after.north_mps - before.north_mps);
    beta[k] = wrapped(std::atan2(north, east) - at.yaw_rad);
    turn[k] = wrapped(after.yaw_rad - before.yaw_rad) / std::max(apart_s, step_s) / speed;
    weight[k] = std::pow(speed / velocity_mps, 2);
  }
  if (!(weight.sum() > 0)) return std::nullopt;
  const WalkSmoother smooth(weight);
  const Eigen::VectorXd turn_left = weight.cwiseProduct(turn - smooth(turn));
  CourseFit fit;
  fit.lever_m = turn_left.dot(beta) / (turn_left.dot(turn) + 1 / (lever_prior_m * lever_prior_m));
  const Eigen::VectorXd slow = smooth(beta - fit.lever_m * turn);
  fit.slow_rad.assign(slow.begin(), slow.end());
  fit.lowest_deg = slow.minCoeff() * deg;
  fit.highest_deg = slow.maxCoeff() * deg;
  return fit;
}

TruthFloor kitti_pose_floor(const std::vector<SE3>& imu, const std::vector<KittiOxts>& samples,
                            const StepFloor& steps, double lever_m) {
  TruthFloor floor;
  double across = 0, apart = 0, timing = 0, rates = 0;
  Eigen::Vector3d by_axis = Eigen::Vector3d::Zero();
  const auto n = static_cast<double>(imu.size() - 1);
  const std::vector<SE3> raw = kitti_imu_poses(samples);
  for (size_t i = 0; i + 1 < imu.size(); ++i) {
    const Eigen::Vector3d turned = so3_log(imu[i].rotation().conjugate() * imu[i + 1].rotation());
    const Eigen::Vector3d rate = (turn_rate(samples[i]) + turn_rate(samples[i + 1])) / 2;
    const Eigen::Vector3d differs = turned - steps.mean_s * rate;
    apart += differs.squaredNorm() / n;
    by_axis += differs.cwiseAbs() / n;
    rates += rate.squaredNorm();
    const double speed = kitti_mean_speed_mps(samples, i);
    if (!(speed > kitti_slow_mps)) continue;
    const double length_m = (raw[i + 1].translation() - raw[i].translation()).norm();
    timing += turned.squaredNorm() * std::pow(length_m / (steps.mean_s * speed) - 1, 2) / n;
    // Direction of the levelled forward axis, averaged over both ends of the step.
    const Eigen::Vector3d forward =
        imu[i].rotation() * Eigen::Vector3d::UnitX() + imu[i + 1].rotation() * Eigen::Vector3d::UnitX();
    const Eigen::Vector2d ahead = forward.head<2>().normalized();
    const Eigen::Vector3d step = imu[i + 1].translation() - imu[i].translation();
    const double turn = wrapped(yaw_of(imu[i + 1]) - yaw_of(imu[i]));
    across += std::pow(ahead.x() * step.y() - ahead.y() * step.x() - lever_m * turn, 2) / steps.n_steps;
  }
  floor.lateral_m = std::sqrt(across);
  floor.rotation_timing_deg = std::sqrt(timing) * deg;
  if (rates > 0) {
    floor.rotation_deg = std::sqrt(apart) * deg;
    floor.gyro_deg = by_axis * deg;
  }
  return floor;
}

bool kitti_moves(const std::vector<KittiOxts>& samples) {
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    if (kitti_mean_speed_mps(samples, i) > kitti_slow_mps) return true;
  }
  return false;
}

double kitti_top_speed_mps(const std::vector<KittiOxts>& samples) {
  double top = 0;
  for (const KittiOxts& sample : samples) top = std::max(top, sample.velocity_mps.norm());
  return top;
}

std::string kitti_differing_velocities(const std::vector<KittiOxts>& samples, const fs::path& path) {
  constexpr double apart_mps = 0.1;
  for (size_t i = 0; i < samples.size(); ++i) {
    const double by_compass = std::hypot(samples[i].north_mps, samples[i].east_mps);
    const double by_heading = samples[i].velocity_mps.head<2>().norm();
    if (std::abs(by_compass - by_heading) <= apart_mps) continue;
    return fmt::format("{}:{}: vn, ve are {:.4g} m/s and vf, vl {:.4g} m/s", path.string(), i + 1, by_compass,
                       by_heading);
  }
  return {};
}

std::string kitti_position_faults(const std::vector<KittiOxts>& samples, const std::vector<SE3>& poses,
                                  const fs::path& path) {
  const OxtsFaults found = oxts_faults(samples, poses);
  if (found.faults.empty()) return {};
  const OxtsFault& first = found.faults.front();
  std::string more;
  if (const size_t others = found.faults.size() - 1; others > 0)
    more = fmt::format("; {} more {}", others, others == 1 ? "step is wrong" : "steps are wrong");
  return fmt::format(
      "{}:{}: the position moves by {:.3f} m from frame {} to frame {}, but the measured speed times {:.4f} "
      "s is {:.3f} m, and a difference of {:.2f} m is allowed{}: is a line missing, repeated or wrong? The "
      "floors of the truth contain this fault",
      path.string(), first.step + 2, first.length_m, first.step, first.step + 1, found.step_s,
      first.expected_m, found.limit_m, more);
}

}  // namespace sextant
