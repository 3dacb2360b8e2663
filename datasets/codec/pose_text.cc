#include "sextant/datasets/codec/pose_text.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <iterator>
#include <map>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

constexpr double max_rotation_error = 1e-3;

void check_rigid(const Eigen::Matrix4d& m, const TextRows& rows) {
  const double last_row = (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff();
  if (last_row > 1e-6) {
    rows.fail_here("expected 0 0 0 1 as the last row of the pose, got {} {} {} {}", m(3, 0), m(3, 1), m(3, 2),
                   m(3, 3));
  }
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  const double error = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= max_rotation_error)) {
    rows.fail_here("expected a rotation in the pose, but R R' is off the identity by {:.3g} (limit {})",
                   error, max_rotation_error);
  }
  if (r.determinant() < 0) rows.fail_here("expected a rotation in the pose, got a reflection (det R = -1)");
}

}  // namespace

SE3 read_pose_fields(const TextRows& rows, size_t first) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  const int n = rows.fields().size() == first + 12 ? 12 : 16;
  for (int i = 0; i < n; ++i) m(i / 4, i % 4) = rows.metres(static_cast<size_t>(i) + first, "a pose value");
  check_rigid(m, rows);
  return SE3::from_matrix(m.topRows<3>());
}

std::map<int, SE3> decode_pose_text(std::string_view text, const std::string& name) {
  std::map<int, SE3> poses;
  for (TextRows rows(text, name); rows.next();) {
    rows.expect(17, "frame number + 16 values");
    const int frame = rows.integer(0, "the frame number");
    if (!poses.emplace(frame, read_pose_fields(rows, 1)).second) {
      rows.fail_here("frame {} has a pose already: every frame may appear once", frame);
    }
  }
  return poses;
}

std::string encode_pose_text(const std::map<int, SE3>& poses) {
  std::string out;
  for (const auto& [frame, pose] : poses) {
    const Eigen::Matrix4d m = pose.matrix();
    out += std::to_string(frame);
    for (int i = 0; i < 16; ++i) fmt::format_to(std::back_inserter(out), " {:.17g}", m(i / 4, i % 4));
    out += '\n';
  }
  return out;
}

namespace {

constexpr size_t n_keys = 2;
constexpr const char* object_header =
    "# T_camera_object per frame and track: an extension of KITTI tracking, whose label_02 has no roll and "
    "pitch.\n"
    "# frame track_id r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z (m; rectified camera 0; origin: middle of "
    "the\n"
    "# box's bottom face; axes: x right, y down, z ahead)\n";

}  // namespace

std::map<std::pair<int, int>, SE3> decode_object_poses(std::string_view text, const std::string& name) {
  std::map<std::pair<int, int>, SE3> poses;
  for (TextRows rows(text, name, ' ', '#'); rows.next();) {
    const size_t n = rows.fields().size();
    if (n != n_keys + 12 && n != n_keys + 16) {
      rows.fail_here("expected frame, track id and the 12 or 16 values of T_camera_object, got {} values", n);
    }
    const int frame = rows.frame(0);
    const int track = rows.track(1);
    if (!poses.emplace(std::pair(frame, track), read_pose_fields(rows, n_keys)).second) {
      rows.fail_here("track {} has a pose in frame {} already: every track may appear once", track, frame);
    }
  }
  return poses;
}

std::string encode_object_poses(const std::map<std::pair<int, int>, SE3>& poses) {
  std::string out = object_header;
  for (const auto& [key, pose] : poses) {
    const Eigen::Matrix4d m = pose.matrix();
    fmt::format_to(std::back_inserter(out), "{} {}", key.first, key.second);
    for (int i = 0; i < 12; ++i) fmt::format_to(std::back_inserter(out), " {:.17g}", m(i / 4, i % 4));
    out += '\n';
  }
  return out;
}

namespace {

// A separate reader for lines "KEY: number", because OpenCV's reader hangs on damaged files and wraps large
// integers around.

/// The text after a key, and its line.
struct Value {
  std::string_view text;
  int line;
};

/// Returns the value after each key at the beginning of a line, without comments.
std::map<std::string, Value> top_level(std::string_view text, const std::string& name) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  if (!text.starts_with("%YAML"))
    fail("{}: expected an OpenCV YAML file, whose first line is %YAML:1.0", name);
  std::map<std::string, Value> values;
  for (int line = 1; !text.empty(); ++line) {
    const std::string_view row = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(row.size() + 1, text.size()));
    const size_t colon = row.find(':');
    if (line == 1 || row.empty() || row[0] == '#' || row[0] == ' ' || colon == std::string_view::npos)
      continue;
    const std::string key(trimmed(row.substr(0, colon)));
    const std::string_view value = row.substr(colon + 1);
    if (!values.emplace(key, Value{trimmed(value.substr(0, value.find('#'))), line}).second)
      fail("{}:{}: key {} is repeated", name, line, key);
  }
  return values;
}

double positive(const Value& given, const std::string& name, const char* key) {
  const std::optional<double> value = number_in(given.text);
  if (!value)
    fail("{}: {}: expected a number in line {}, got '{}'", name, key, given.line, given.text.substr(0, 40));
  if (!(*value >= 1e-6 && *value < 1e9)) {
    fail("{}: {} = {}: expected a positive number from 1e-6 to 1e9 in line {}", name, key,
         given.text.substr(0, 40), given.line);
  }
  return *value;
}

}  // namespace

YamlCamera decode_yaml_camera(std::string_view text, const std::string& name) {
  const std::map<std::string, Value> values = top_level(text, name);
  std::vector<std::string> missing;
  for (const char* key : {"Camera.fx", "Camera.fy", "Camera.cx", "Camera.cy", "Camera.bf"})
    if (!values.contains(key)) missing.emplace_back(key);
  if (!missing.empty()) fail("{}: missing {}: add it as 'KEY: number'", name, fmt::join(missing, ", "));

  YamlCamera out;
  const auto read = [&](const char* key) { return positive(values.at(key), name, key); };
  out.camera.left = {read("Camera.fx"), read("Camera.fy"), read("Camera.cx"), read("Camera.cy")};
  out.camera.bf = read("Camera.bf");
  if (values.contains("Camera.fps")) out.rate_hz = read("Camera.fps");
  const auto number_of = [&](const std::string& key) {
    const auto found = values.find(key);
    return found == values.end() ? std::nullopt : number_in(found->second.text);
  };
  for (const char* key : {"Camera.k1", "Camera.k2", "Camera.p1", "Camera.p2", "Camera.k3"}) {
    if (const auto value = number_of(key); value && *value != 0) out.distortion[key] = *value;
  }
  out.depth_map_factor = number_of("DepthMapFactor");
  return out;
}

std::string encode_yaml_camera(const YamlCamera& camera) {
  const PinholeCamera& left = camera.camera.left;
  std::string out = fmt::format(
      "%YAML:1.0\n---\nCamera.fx: {:.17g}\nCamera.fy: {:.17g}\nCamera.cx: {:.17g}\nCamera.cy: {:.17g}\n"
      "Camera.bf: {:.17g}\n",
      left.fx, left.fy, left.cx, left.cy, camera.camera.bf);
  if (camera.rate_hz > 0) out += fmt::format("Camera.fps: {:.17g}\n", camera.rate_hz);
  return out;
}

}  // namespace sextant
