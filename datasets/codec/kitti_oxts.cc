#include "sextant/datasets/codec/kitti_oxts.h"

#include <cmath>
#include <iterator>
#include <numbers>

#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double earth_radius_m = 6378137;  // as in the devkit
constexpr size_t n_values = 30;
constexpr size_t first_of_rest = 11;

KittiOxts read_sample(const TextRows& rows) {
  if (rows.fields().size() != n_values) {
    rows.fail_here("expected 30 values (lat lon alt roll pitch yaw vn ve vf vl vu ...), got {}",
                   rows.fields().size());
  }
  KittiOxts s{.latitude_deg = rows.finite(0, "the latitude"),
              .longitude_deg = rows.finite(1, "the longitude")};
  if (!(std::abs(s.latitude_deg) < 90)) {
    rows.fail_here("expected a latitude between -90 and 90 degrees, got {}", s.latitude_deg);
  }
  if (!(std::abs(s.longitude_deg) <= 180)) {
    rows.fail_here("expected a longitude between -180 and 180 degrees, got {}", s.longitude_deg);
  }
  s.altitude_m = rows.metres(2, "the altitude");
  s.roll_rad = rows.finite(3, "roll");
  s.pitch_rad = rows.finite(4, "pitch");
  s.yaw_rad = rows.finite(5, "yaw");
  s.north_mps = rows.finite(6, "vn");
  s.east_mps = rows.finite(7, "ve");
  s.velocity_mps = {rows.finite(8, "vf"), rows.finite(9, "vl"), rows.finite(10, "vu")};
  for (size_t i = 0; i < s.rest.size(); ++i) {
    s.rest.at(i) = rows.finite(first_of_rest + i, fmt::format("value {}", first_of_rest + i + 1));
  }
  return s;
}

}  // namespace

std::vector<KittiOxts> decode_kitti_oxts(std::string_view text, const std::string& name) {
  std::vector<KittiOxts> samples;
  for (TextRows rows(text, name); rows.next();) samples.push_back(read_sample(rows));
  if (samples.empty()) fail("{}: no oxts samples in it: expected a line of 30 values per frame", name);
  return samples;
}

std::string encode_kitti_oxts(const std::vector<KittiOxts>& samples) {
  std::string out;
  for (const KittiOxts& s : samples) {
    const Eigen::Vector3d& v = s.velocity_mps;
    const double head[] = {s.latitude_deg, s.longitude_deg, s.altitude_m, s.roll_rad, s.pitch_rad, s.yaw_rad,
                           s.north_mps,    s.east_mps,      v.x(),        v.y(),      v.z()};
    for (const double value : head) fmt::format_to(std::back_inserter(out), "{:.17g} ", value);
    for (const double value : s.rest) fmt::format_to(std::back_inserter(out), "{:.17g} ", value);
    out.back() = '\n';
  }
  return out;
}

double mercator_scale(double first_latitude_deg) { return std::cos(first_latitude_deg * pi / 180); }

SE3 pose_from_oxts(const KittiOxts& sample, double scale) {
  const double r = scale * earth_radius_m;
  const Eigen::Vector3d t(r * sample.longitude_deg * pi / 180,
                          r * std::log(std::tan((90 + sample.latitude_deg) * pi / 360)), sample.altitude_m);
  const Eigen::Quaterniond rotation = Eigen::AngleAxisd(sample.yaw_rad, Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(sample.pitch_rad, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(sample.roll_rad, Eigen::Vector3d::UnitX());
  return {rotation, t};
}

KittiOxts oxts_from_pose(const SE3& T_world_imu, double scale) {
  const double r = scale * earth_radius_m;
  const Eigen::Vector3d& t = T_world_imu.translation();
  const Eigen::Matrix3d m = T_world_imu.rotation().toRotationMatrix();
  KittiOxts s{.latitude_deg = std::atan(std::exp(t.y() / r)) * 360 / pi - 90,
              .longitude_deg = t.x() / r * 180 / pi,
              .altitude_m = t.z(),
              .roll_rad = std::atan2(m(2, 1), m(2, 2)),
              .pitch_rad = std::atan2(-m(2, 0), std::hypot(m(2, 1), m(2, 2))),
              .yaw_rad = std::atan2(m(1, 0), m(0, 0))};
  return s;
}

}  // namespace sextant
