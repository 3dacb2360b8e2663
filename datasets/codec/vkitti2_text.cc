#include "sextant/datasets/codec/vkitti2_text.h"

#include <iterator>
#include <set>
#include <tuple>

#include "sextant/base/text.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_table.h"

namespace sextant {
namespace {

const char* const kExtrinsicHeader =
    "frame cameraID r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1";
const char* const kIntrinsicHeader = "frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]";
const char* const kPoseHeader =
    "frame cameraID trackID alpha width height length world_space_X world_space_Y world_space_Z "
    "rotation_world_space_y rotation_world_space_x rotation_world_space_z camera_space_X camera_space_Y "
    "camera_space_Z rotation_camera_space_y rotation_camera_space_x rotation_camera_space_z";
const char* const kBoxHeader =
    "frame cameraID trackID left right top bottom number_pixels truncation_ratio occupancy_ratio isMoving";
const char* const kInfoHeader = "trackID label model color";
const char* const kColorHeader = "Category r g b";

/// Rows seen so far, by frame, camera and track.
class Seen {
 public:
  void add(const TextRows& rows, int frame, int camera, int track) {
    if (seen_.emplace(frame, camera, track).second) return;
    rows.fail_here("track {} appears twice in frame {} of camera {}", track, frame, camera);
  }
  void add(const TextRows& rows, int frame, int camera) {
    if (seen_.emplace(frame, camera, 0).second) return;
    rows.fail_here("camera {} appears twice in frame {}", camera, frame);
  }

 private:
  std::set<std::tuple<int, int, int>> seen_;
};

template <typename... Args>
void append(std::string& out, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
}

}  // namespace

std::vector<Vkitti2Extrinsic> decode_vkitti2_extrinsics(std::string_view text, const std::string& name) {
  TextRows rows(text, name);
  TextTable table(rows, {"frame", "cameraID", "r1,1", "t3"});
  if (table.n_columns() != 18 || table.column(2) != 2 || table.column(3) != 13) {
    rows.fail_here("expected the 18 columns {}", kExtrinsicHeader);
  }
  std::vector<Vkitti2Extrinsic> out;
  for (Seen seen; table.next();) {
    const int frame = table.frame();
    const int camera = table.not_negative();
    seen.add(rows, frame, camera);
    out.push_back({frame, camera, read_pose_fields(rows, 2)});
  }
  return out;
}

std::vector<Vkitti2Intrinsic> decode_vkitti2_intrinsics(std::string_view text, const std::string& name) {
  TextRows rows(text, name);
  TextTable table(rows, split(kIntrinsicHeader, ' '));
  std::vector<Vkitti2Intrinsic> out;
  for (Seen seen; table.next();) {
    Vkitti2Intrinsic row;
    row.frame = table.frame();
    row.camera = table.not_negative();
    seen.add(rows, row.frame, row.camera);
    for (double* value : {&row.k.fx, &row.k.fy, &row.k.cx, &row.k.cy}) *value = table.finite();
    if (row.k.fx <= 0 || row.k.fy <= 0) {
      rows.fail_here("expected positive focal lengths, got {} and {}", row.k.fx, row.k.fy);
    }
    out.push_back(row);
  }
  return out;
}

std::vector<Vkitti2Pose> decode_vkitti2_poses(std::string_view text, const std::string& name) {
  TextRows rows(text, name);
  TextTable table(rows, split(kPoseHeader, ' '));
  std::vector<Vkitti2Pose> out;
  for (Seen seen; table.next();) {
    Vkitti2Pose row;
    row.frame = table.frame();
    row.camera = table.not_negative();
    row.track = table.track();
    seen.add(rows, row.frame, row.camera, row.track);
    row.alpha = table.finite();
    for (double* value : {&row.width, &row.height, &row.length, &row.world_x, &row.world_y, &row.world_z}) {
      *value = table.metres();
    }
    if (!(row.width > 0 && row.height > 0 && row.length > 0)) {
      rows.fail_here("expected width, height and length > 0, got {} {} {}", row.width, row.height,
                     row.length);
    }
    for (double* value : {&row.world_ry, &row.world_rx, &row.world_rz}) *value = table.finite();
    for (double* value : {&row.camera_x, &row.camera_y, &row.camera_z}) *value = table.metres();
    for (double* value : {&row.camera_ry, &row.camera_rx, &row.camera_rz}) *value = table.finite();
    out.push_back(row);
  }
  return out;
}

std::vector<Vkitti2Box> decode_vkitti2_boxes(std::string_view text, const std::string& name) {
  TextRows rows(text, name);
  TextTable table(rows, split(kBoxHeader, ' '));
  std::vector<Vkitti2Box> out;
  for (Seen seen; table.next();) {
    Vkitti2Box row;
    row.frame = table.frame();
    row.camera = table.not_negative();
    row.track = table.track();
    seen.add(rows, row.frame, row.camera, row.track);
    for (double* value : {&row.left, &row.right, &row.top, &row.bottom}) *value = table.finite();
    row.number_pixels = table.not_negative();
    row.truncation_ratio = table.finite();
    row.occupancy_ratio = table.finite();
    row.is_moving = table.flag();
    out.push_back(row);
  }
  return out;
}

std::vector<Vkitti2Info> decode_vkitti2_infos(std::string_view text, const std::string& name) {
  TextRows rows(text, name);
  TextTable table(rows, split(kInfoHeader, ' '));
  std::vector<Vkitti2Info> out;
  for (std::set<int> seen; table.next();) {
    Vkitti2Info row;
    row.track = table.track();
    if (!seen.insert(row.track).second) rows.fail_here("track {} appears twice", row.track);
    row.label = table.word();
    row.model = table.word();
    row.color = table.word();
    out.push_back(std::move(row));
  }
  return out;
}

std::vector<Vkitti2Color> decode_vkitti2_colors(std::string_view text, const std::string& name) {
  TextRows rows(text, name);
  TextTable table(rows, split(kColorHeader, ' '));
  std::vector<Vkitti2Color> out;
  while (table.next()) {
    Vkitti2Color row;
    row.category = table.word();
    for (uint8_t* value : {&row.color.r, &row.color.g, &row.color.b}) {
      const int number = table.integer();
      if (number < 0 || number > 255) rows.fail_here("expected a colour of 0 to 255, got {}", number);
      *value = static_cast<uint8_t>(number);
    }
    out.push_back(std::move(row));
  }
  return out;
}

std::string encode_vkitti2_extrinsics(const std::vector<Vkitti2Extrinsic>& rows) {
  std::string out = std::string(kExtrinsicHeader) + "\n";
  for (const Vkitti2Extrinsic& row : rows) {
    const Eigen::Matrix4d m = row.T_camera_world.matrix();
    append(out, "{} {}", row.frame, row.camera);
    for (int i = 0; i < 16; ++i) append(out, " {}", m(i / 4, i % 4));
    out += '\n';
  }
  return out;
}

std::string encode_vkitti2_intrinsics(const std::vector<Vkitti2Intrinsic>& rows) {
  std::string out = std::string(kIntrinsicHeader) + "\n";
  for (const Vkitti2Intrinsic& row : rows) {
    append(out, "{} {} {} {} {} {}\n", row.frame, row.camera, row.k.fx, row.k.fy, row.k.cx, row.k.cy);
  }
  return out;
}

std::string encode_vkitti2_poses(const std::vector<Vkitti2Pose>& rows) {
  std::string out = std::string(kPoseHeader) + "\n";
  for (const Vkitti2Pose& row : rows) {
    append(out, "{} {} {}", row.frame, row.camera, row.track);
    for (const double value : {row.alpha, row.width, row.height, row.length, row.world_x, row.world_y,
                               row.world_z, row.world_ry, row.world_rx, row.world_rz, row.camera_x,
                               row.camera_y, row.camera_z, row.camera_ry, row.camera_rx, row.camera_rz}) {
      append(out, " {}", value);
    }
    out += '\n';
  }
  return out;
}

std::string encode_vkitti2_boxes(const std::vector<Vkitti2Box>& rows) {
  std::string out = std::string(kBoxHeader) + "\n";
  for (const Vkitti2Box& row : rows) {
    append(out, "{} {} {} {} {} {} {} {} {} {} {}\n", row.frame, row.camera, row.track, row.left, row.right,
           row.top, row.bottom, row.number_pixels, row.truncation_ratio, row.occupancy_ratio,
           row.is_moving ? "True" : "False");
  }
  return out;
}

std::string encode_vkitti2_infos(const std::vector<Vkitti2Info>& rows) {
  std::string out = std::string(kInfoHeader) + "\n";
  for (const Vkitti2Info& row : rows)
    append(out, "{} {} {} {}\n", row.track, row.label, row.model, row.color);
  return out;
}

std::string encode_vkitti2_colors(const std::vector<Vkitti2Color>& rows) {
  std::string out = std::string(kColorHeader) + "\n";
  for (const Vkitti2Color& row : rows) {
    append(out, "{} {} {} {}\n", row.category, row.color.r, row.color.g, row.color.b);
  }
  return out;
}

const std::vector<Vkitti2Color>& vkitti2_categories() {
  static const std::vector<Vkitti2Color> categories = {
      {"Terrain", {210, 0, 200}},     {"Sky", {90, 200, 255}},        {"Tree", {0, 199, 0}},
      {"Vegetation", {90, 240, 0}},   {"Building", {140, 140, 140}},  {"Road", {100, 60, 100}},
      {"GuardRail", {250, 100, 255}}, {"TrafficSign", {255, 255, 0}}, {"TrafficLight", {200, 200, 0}},
      {"Pole", {255, 130, 0}},        {"Misc", {80, 80, 80}},         {"Truck", {160, 60, 60}},
      {"Car", {255, 127, 80}},        {"Van", {0, 139, 139}},
  };
  return categories;
}

}  // namespace sextant
