#include "sextant/eval/evaluation/pose_frames.h"

#include <cmath>
#include <filesystem>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/eval/logs/pose_collector.h"

namespace sextant {
namespace {

constexpr std::string_view blanks = " \t\r\n,;";

/// Parses the numbers of a text without its comments (#); empty if a word is not a number.
std::optional<std::vector<double>> numbers_in(std::string_view text) {
  constexpr size_t max_values = 64;
  std::vector<double> values;
  for (size_t at = 0;;) {
    at = text.find_first_not_of(blanks, at);
    if (at == std::string_view::npos) return values;
    if (text[at] == '#') {
      at = std::min(text.find('\n', at), text.size());
      continue;
    }
    const size_t end = std::min(text.find_first_of(blanks, at), text.size());
    const std::optional<double> value = number_in(text.substr(at, end - at));
    if (!value || !std::isfinite(*value) || values.size() == max_values) return std::nullopt;
    values.push_back(*value);
    at = end;
  }
}

BodyFromCamera body_from_camera(const std::vector<double>& v, const std::string& name) {
  constexpr double farthest_m = 1000;
  BodyFromCamera out;
  if (v.size() == 3) {
    out.position_m = {v[0], v[1], v[2]};
  } else if (v.size() == 12 || v.size() == 16) {
    if (v.size() == 16 && (v[12] != 0 || v[13] != 0 || v[14] != 0 || v[15] != 1))
      fail("{}: expected 0 0 0 1 as the last row of T_body_camera, got {} {} {} {}", name, v[12], v[13],
           v[14], v[15]);
    Eigen::Matrix3d R;
    R << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
    RepairLog log;
    check_rotation(R, name, 1, log);
    out.rotation = R;
    out.position_m = {v[3], v[7], v[11]};
  } else {
    fail("{}: expected 3 numbers (position), 12 or 16 (matrix row by row) of T_body_camera, got {}", name,
         v.size());
  }
  if (out.position_m.norm() > farthest_m)
    fail("{}: the camera is {:.4g} m from the body: expected metres, {} at most", name, out.position_m.norm(),
         farthest_m);
  return out;
}

}  // namespace

Eigen::Matrix4d PoseFrame::matrix() const {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  const BodyFromCamera mounting = body_from_camera.value_or(BodyFromCamera());
  T.topLeftCorner<3, 3>() = mounting.rotation.value_or(opencv_from_axes(axes).transpose());
  T.topRightCorner<3, 1>() = mounting.position_m;
  return T;
}

BodyFromCamera decode_body_from_camera(const std::string& content, const std::string& name) {
  const auto values = numbers_in(content);
  if (!values) fail("{}: expected 3, 12 or 16 numbers of T_body_camera, and nothing else", name);
  return body_from_camera(*values, name);
}

BodyFromCamera parse_body_from_camera(const std::string& text) {
  std::error_code ignored;
  if (!std::filesystem::exists(text, ignored)) {
    if (const auto values = numbers_in(text); values && values->size() > 1)
      return body_from_camera(*values, "--body-from-camera");
    fail("--body-from-camera: there is no file '{}', and it is no list of 3, 12 or 16 numbers", text);
  }
  constexpr uintmax_t max_bytes = 1 << 16;
  if (!std::filesystem::is_regular_file(text, ignored))
    fail("{}: expected a file with the numbers of T_body_camera", text);
  if (std::filesystem::file_size(text, ignored) > max_bytes)
    fail("{}: expected 3, 12 or 16 numbers of T_body_camera, got a file beyond {} bytes", text, max_bytes);
  return decode_body_from_camera(read_file(text), text);
}

void to_camera(PoseSeries& poses, const PoseFrame& frame) {
  if (frame.is_default()) return;
  const Eigen::Matrix3d C = opencv_from_axes(frame.axes);
  const Eigen::Matrix4d T = frame.matrix();
  const Eigen::Matrix3d R_body_camera = T.topLeftCorner<3, 3>();
  const Eigen::Vector3d lever_m = T.topRightCorner<3, 1>();
  if (frame.inverse) {
    if (!poses.has_rotations()) {
      fail(
          "--inverse (for the reference: --ref-inverse): positions without rotations have no inverse: leave "
          "the flag out, or give poses with rotations");
    }
    invert(poses);
    if (frame.axes == Axes::opencv && !frame.body_from_camera) return;
  }
  if (!poses.has_rotations()) {
    if (frame.body_from_camera) {
      fail(
          "--body-from-camera (for the reference: --ref-body-from-camera) moves positions along the body's "
          "axes, which needs rotations, but these poses are positions alone: leave the flag out, or give "
          "poses with rotations");
    }
    for (Eigen::Vector3d& p : poses.positions_m) p = C * p;
    return;
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Matrix3d R = C * poses.rotations[i];
    poses.transform_covariance(i, C, 1, R * lever_m);
    poses.positions_m[i] = C * poses.positions_m[i] + R * lever_m;
    poses.rotations[i] = R * R_body_camera;
  }
}

Eigen::Vector3d parse_direction(const std::string& text) {
  std::string_view name = text;
  const double sign = name.starts_with('-') ? -1 : 1;
  if (name.starts_with('-') || name.starts_with('+')) name.remove_prefix(1);
  if (name == "x") return {sign, 0, 0};
  if (name == "y") return {0, sign, 0};
  if (name == "z") return {0, 0, sign};
  const auto v = numbers_in(text);
  if (!v || v->size() != 3 || !(Eigen::Vector3d((*v)[0], (*v)[1], (*v)[2]).norm() > 1e-12))
    fail("'{}' is no direction: expected x, y, z, -x, -y, -z or three numbers that are not all 0", text);
  return Eigen::Vector3d((*v)[0], (*v)[1], (*v)[2]).stableNormalized();
}

}  // namespace sextant
