#include "sextant/datasets/kitti_oxts_track.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sextant/base/philox.h"

namespace sextant {
namespace {

constexpr double origin_latitude_deg = 49.011;
constexpr double origin_longitude_deg = 8.4229;
constexpr double origin_altitude_m = 112;

double standard_normal(uint64_t seed, size_t frame) {
  PhiloxStream stream(seed, frame);
  const double u1 = stream.uniform();
  return std::sqrt(-2 * std::log(u1)) * std::cos(2 * std::numbers::pi * stream.uniform());
}

struct Sample {
  SE3 pose;
  Eigen::Vector3d velocity_mps{0, 0, 0};  ///< map axes
};

// Slopes (per frame) of the twice continuously differentiable cubic spline through `p`, its first and last
// pieces parabolas:  m[k-1] + 4 m[k] + m[k+1] = 3 (p[k+1] - p[k-1]),  m[0] + m[1] = 2 (p[1] - p[0]).
std::vector<Eigen::Vector3d> spline_slopes(const std::vector<SE3>& p) {
  const size_t n = p.size();
  const auto step = [&](size_t i, size_t j) -> Eigen::Vector3d {
    return p[j].translation() - p[i].translation();
  };
  if (n == 2) return {step(0, 1), step(0, 1)};
  std::vector<double> diagonal(n, 4);
  std::vector<Eigen::Vector3d> m(n);
  diagonal.front() = diagonal.back() = 1;
  m.front() = 2 * step(0, 1);
  m.back() = 2 * step(n - 2, n - 1);
  for (size_t k = 1; k + 1 < n; ++k) m[k] = 3 * step(k - 1, k + 1);
  for (size_t k = 1; k < n; ++k) {  // both neighbours have the factor 1 everywhere
    diagonal[k] -= 1 / diagonal[k - 1];
    m[k] -= m[k - 1] / diagonal[k - 1];
  }
  m.back() /= diagonal.back();
  for (size_t k = n - 1; k > 0; --k) m[k - 1] = (m[k - 1] - m[k]) / diagonal[k - 1];
  return m;
}

// The track as a curve of time.
class Curve {
 public:
  Curve(std::vector<SE3> poses, double rate_hz) : poses_(std::move(poses)), rate_hz_(rate_hz) {
    if (poses_.size() > 1) slopes_ = spline_slopes(poses_);
  }

  Sample at(size_t frame, double delay_s) const {
    if (poses_.size() == 1) return {poses_[0]};
    const double time = static_cast<double>(frame) + delay_s * rate_hz_;  // in frames
    const auto last = static_cast<double>(poses_.size() - 2);
    const auto i = static_cast<size_t>(std::clamp(std::floor(time), 0.0, last));
    return between(i, time - static_cast<double>(i));
  }

 private:
  const Eigen::Vector3d& position(size_t i) const { return poses_[i].translation(); }

  Sample between(size_t i, double s) const {
    const Eigen::Vector3d step = position(i + 1) - position(i);
    const Eigen::Vector3d& m0 = slopes_[i];
    const Eigen::Vector3d& m1 = slopes_[i + 1];
    const Eigen::Vector3d c2 = 3 * step - 2 * m0 - m1;
    const Eigen::Vector3d c3 = m0 + m1 - 2 * step;
    const Eigen::Vector3d omega = so3_log(poses_[i].rotation().conjugate() * poses_[i + 1].rotation());
    const Eigen::Quaterniond rotation = poses_[i].rotation() * so3_exp(s * omega);
    return {SE3(rotation, position(i) + s * (m0 + s * (c2 + s * c3))),
            (m0 + s * (2 * c2 + 3 * s * c3)) * rate_hz_};
  }

  std::vector<SE3> poses_;
  std::vector<Eigen::Vector3d> slopes_;
  double rate_hz_;
};

// x right, y down, z ahead -> x east, y north, z up; ahead is east, as at yaw 0.
SE3 map_from_world() {
  Eigen::Matrix3d r;
  r << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return SE3(Eigen::Quaterniond(r), Eigen::Vector3d::Zero());
}

}  // namespace

std::vector<KittiOxts> oxts_of_track(const std::vector<SE3>& T_world_camera, double rate_hz,
                                     const SE3& T_camera_imu, const OxtsJitter& jitter) {
  if (T_world_camera.empty()) return {};
  std::vector<SE3> imu;
  imu.reserve(T_world_camera.size());
  for (const SE3& T : T_world_camera) imu.push_back(map_from_world() * T * T_camera_imu);
  const Curve curve(std::move(imu), rate_hz);
  std::vector<Sample> samples;
  samples.reserve(T_world_camera.size());
  for (size_t k = 0; k < T_world_camera.size(); ++k) {
    samples.push_back(curve.at(k, jitter.sigma_s > 0 ? jitter.sigma_s * standard_normal(jitter.seed, k) : 0));
  }

  const double scale = mercator_scale(origin_latitude_deg);
  KittiOxts origin{.latitude_deg = origin_latitude_deg,
                   .longitude_deg = origin_longitude_deg,
                   .altitude_m = origin_altitude_m};
  const Eigen::Vector3d move =
      pose_from_oxts(origin, scale).translation() - samples.front().pose.translation();
  std::vector<KittiOxts> track;
  track.reserve(samples.size());
  for (const Sample& sample : samples) {
    const SE3 moved(sample.pose.rotation(), sample.pose.translation() + move);
    KittiOxts& oxts = track.emplace_back(oxts_from_pose(moved, scale));
    oxts.east_mps = sample.velocity_mps.x();
    oxts.north_mps = sample.velocity_mps.y();
    oxts.velocity_mps = Eigen::AngleAxisd(-oxts.yaw_rad, Eigen::Vector3d::UnitZ()) * sample.velocity_mps;
  }
  return track;
}

}  // namespace sextant
