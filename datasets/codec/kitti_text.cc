#include "sextant/datasets/codec/kitti_text.h"

#include <fmt/ranges.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

constexpr double orthonormal = 1e-3;
constexpr const char* spellings =
    "P0 P1 P2 P3 and either R_rect Tr_velo_cam Tr_imu_velo or R0_rect "
    "Tr_velo_to_cam Tr_imu_to_velo, each with or without a colon";

// One key of the file with its names in both dialects.
struct Entry {
  std::string tracking, object;
  int columns = 4;
  int64_t line = 0;      ///< line of the key; 0 = not yet found
  std::string spelling;  ///< spelling in the file
  Eigen::Matrix<double, 3, 4> value = Eigen::Matrix<double, 3, 4>::Zero();

  bool differs_by_dialect() const { return tracking != object; }
};

std::vector<Entry> entries() {
  return {{"P0", "P0"},
          {"P1", "P1"},
          {"P2", "P2"},
          {"P3", "P3"},
          {"R_rect", "R0_rect", 3},
          {"Tr_velo_cam", "Tr_velo_to_cam"},
          {"Tr_imu_velo", "Tr_imu_to_velo"}};
}

void check_projection(const TextRows& rows, const Entry& entry) {
  const auto& p = entry.value;
  const bool pinhole = p(0, 0) > 0 && p(1, 1) > 0 && p(0, 1) == 0 && p(1, 0) == 0 && p(2, 0) == 0 &&
                       p(2, 1) == 0 && p(2, 2) == 1;
  if (pinhole) return;
  rows.fail_here("{}: expected a rectified projection fx 0 cx a  0 fy cy b  0 0 1 c with fx, fy > 0, got {}",
                 entry.spelling, fmt::join(rows.fields().subspan(1), " "));
}

void check_rotation(const TextRows& rows, const Entry& entry) {
  const Eigen::Matrix3d r = entry.value.leftCols<3>();
  const double error = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error <= orthonormal && r.determinant() > 0) return;
  rows.fail_here("{}: expected a rotation, but R R' is off the identity by {:.3g} (limit {}), det R = {:.3g}",
                 entry.spelling, error, orthonormal, r.determinant());
}

void read_entry(const TextRows& rows, const std::string& key, Entry& entry) {
  if (entry.line != 0) rows.fail_here("{}: this key is given in line {} already", key, entry.line);
  const int n = 3 * entry.columns;
  const size_t n_found = rows.fields().size() - 1;
  if (n_found != static_cast<size_t>(n)) rows.fail_here("{}: expected {} numbers, got {}", key, n, n_found);
  entry.line = rows.line();
  entry.spelling = key;
  for (int i = 0; i < n; ++i) {
    entry.value(i / entry.columns, i % entry.columns) = rows.metres(static_cast<size_t>(i) + 1, key);
  }
  if (entry.differs_by_dialect()) {
    check_rotation(rows, entry);
  } else {
    check_projection(rows, entry);
  }
}

void check_one_dialect(const std::vector<Entry>& found, const std::string& name) {
  const Entry* first = nullptr;
  for (const Entry& entry : found) {
    if (!entry.differs_by_dialect()) continue;
    if (first == nullptr) first = &entry;
    if ((entry.spelling == entry.object) == (first->spelling == first->object)) continue;
    fail("{}:{}: {} and, in line {}, {} are keys of two different formats: expected {}", name, entry.line,
         entry.spelling, first->line, first->spelling, spellings);
  }
}

void append(std::string& out, const std::string& key, const Eigen::MatrixXd& m) {
  out += key;
  for (int i = 0; i < m.size(); ++i) {
    fmt::format_to(std::back_inserter(out), " {:.17g}", m(i / m.cols(), i % m.cols()));
  }
  out += '\n';
}

}  // namespace

PinholeCamera KittiCalibration::camera(size_t i) const {
  return {P.at(i)(0, 0), P.at(i)(1, 1), P.at(i)(0, 2), P.at(i)(1, 2)};
}

Eigen::Vector3d KittiCalibration::offset_m(size_t i) const {
  const PinholeCamera k = camera(i);
  const Eigen::Vector3d last = P.at(i).col(3);
  return {(last.x() - k.cx * last.z()) / k.fx, (last.y() - k.cy * last.z()) / k.fy, last.z()};
}

KittiCalibration decode_kitti_calibration(std::string_view text, const std::string& name) {
  std::vector<Entry> found = entries();
  for (TextRows rows(text, name); rows.next();) {
    std::string key(rows.field(0));
    if (key.ends_with(':')) key.pop_back();
    const auto entry =
        std::ranges::find_if(found, [&](const Entry& e) { return key == e.tracking || key == e.object; });
    if (entry == found.end()) rows.fail_here("unknown key '{}': expected {}", key, spellings);
    read_entry(rows, key, *entry);
  }
  for (const Entry& entry : found) {
    if (entry.line != 0) continue;
    fail("{}: no key {}{}: expected {}", name, entry.tracking,
         entry.differs_by_dialect() ? " (or " + entry.object + ")" : "", spellings);
  }
  check_one_dialect(found, name);
  KittiCalibration calibration;
  for (size_t i = 0; i < 4; ++i) calibration.P.at(i) = found[i].value;
  calibration.R_rect = found[4].value.leftCols<3>();
  calibration.Tr_velo_to_cam = found[5].value;
  calibration.Tr_imu_to_velo = found[6].value;
  return calibration;
}

std::string encode_kitti_calibration(const KittiCalibration& calibration, bool object_dialect) {
  std::string out;
  for (size_t i = 0; i < 4; ++i) append(out, fmt::format("P{}:", i), calibration.P.at(i));
  append(out, object_dialect ? "R0_rect:" : "R_rect", calibration.R_rect);
  append(out, object_dialect ? "Tr_velo_to_cam:" : "Tr_velo_cam", calibration.Tr_velo_to_cam);
  append(out, object_dialect ? "Tr_imu_to_velo:" : "Tr_imu_velo", calibration.Tr_imu_to_velo);
  return out;
}

namespace {

constexpr size_t dynosam_columns = 17;

void read_pose(const TextRows& rows, KittiLabel& label) {
  label.height_m = rows.metres(10, "the height");
  label.width_m = rows.metres(11, "the width");
  label.length_m = rows.metres(12, "the length");
  label.position_m = {rows.metres(13, "x"), rows.metres(14, "y"), rows.metres(15, "z")};
  label.rotation_y_rad = rows.radians(16, "rotation_y");
  if (label.dont_care()) return;
  if (label.track_id < 0)
    rows.fail_here("expected a track id >= 0 for a {}, got {}", label.type, label.track_id);
  rows.track(1);
  if (!(label.height_m > 0 && label.width_m > 0 && label.length_m > 0)) {
    rows.fail_here("expected height, width and length > 0 for a {}, got {} {} {}", label.type, label.height_m,
                   label.width_m, label.length_m);
  }
}

KittiLabel read_label(const TextRows& rows) {
  if (rows.fields().size() != dynosam_columns) {
    rows.fail_here(
        "expected 17 columns (frame track_id type truncated occluded alpha "
        "left top right bottom height width length x y z rotation_y), got {}",
        rows.fields().size());
  }
  KittiLabel label;
  label.frame = rows.frame(0);
  label.track_id = rows.integer(1, "the track id");
  label.type = rows.field(2);
  label.truncated = rows.finite(3, "truncated");
  label.occluded = rows.integer(4, "occluded");
  label.alpha_rad = rows.finite(5, "alpha");
  label.box = rows.box(6);
  read_pose(rows, label);
  return label;
}

}  // namespace

std::vector<KittiLabel> decode_kitti_labels(std::string_view text, const std::string& name) {
  std::vector<KittiLabel> labels;
  std::map<std::pair<int, int>, int64_t> line_of;
  for (TextRows rows(text, name); rows.next();) {
    labels.push_back(read_label(rows));
    const KittiLabel& label = labels.back();
    if (label.dont_care()) continue;
    const auto [at, is_new] = line_of.emplace(std::pair(label.frame, label.track_id), rows.line());
    if (!is_new) {
      rows.fail_here("track {} is in frame {} twice, line {} has it already: every track may appear once",
                     label.track_id, label.frame, at->second);
    }
  }
  return labels;
}

std::string encode_kitti_labels(const std::vector<KittiLabel>& labels) {
  std::string out;
  for (const KittiLabel& l : labels) {
    fmt::format_to(std::back_inserter(out),
                   "{} {} {} {:.6f} {} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} "
                   "{:.6f} {:.6f} {:.6f} {:.17g} {:.17g} {:.17g} {:.17g}\n",
                   l.frame, l.track_id, l.type, l.truncated, l.occluded, l.alpha_rad, l.box.left, l.box.top,
                   l.box.right, l.box.bottom, l.height_m, l.width_m, l.length_m, l.position_m.x(),
                   l.position_m.y(), l.position_m.z(), l.rotation_y_rad);
  }
  return out;
}

namespace {

constexpr double pi = std::numbers::pi;
constexpr double earth_radius_m = 6378137;  // as in the development kit
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
  s.roll_rad = rows.radians(3, "roll");
  s.pitch_rad = rows.radians(4, "pitch");
  s.yaw_rad = rows.radians(5, "yaw");
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
