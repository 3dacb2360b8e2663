#include "sextant/datasets/codec/kitti_calibration.h"

#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <iterator>
#include <vector>

#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

constexpr double orthonormal = 1e-3;
constexpr const char* spellings =
    "P0 P1 P2 P3 and either R_rect Tr_velo_cam Tr_imu_velo or R0_rect "
    "Tr_velo_to_cam Tr_imu_to_velo, each with or without a colon";

// One quantity of the file under its names in both dialects.
struct Entry {
  std::string tracking, object;
  int columns = 4;
  int64_t line = 0;      ///< where it was found; 0 = not yet
  std::string spelling;  ///< as found
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
  rows.fail_here("{}: expected a rectified projection f 0 cx a  0 f cy b  0 0 1 c with f > 0, got {}",
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
    fail("{}:{}: {} and, in line {}, {} are keys of two dialects: expected {}", name, entry.line,
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

}  // namespace sextant
