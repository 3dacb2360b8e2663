#include "sextant/datasets/codec/vkitti_text.h"

#include <fmt/ranges.h>
#include <charconv>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "sextant/base/text.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_rows.h"

namespace sextant {

Eigen::Quaterniond vkitti_rotation(const VkittiAngles& angles) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return Eigen::Quaterniond(AngleAxisd(angles.ry + vkitti_yaw_offset_rad, Vector3d::UnitY()) *
                            AngleAxisd(angles.rx, Vector3d::UnitX()) *
                            AngleAxisd(angles.rz, Vector3d::UnitZ()));
}

VkittiAngles vkitti_angles(const Eigen::Quaterniond& R_camera_object) {
  // Row 1 of Ry Rx Rz is [cx sz, cx cz, -sx], column 2 is [sy cx, -sx, cy cx].
  const Eigen::Matrix3d r = R_camera_object.toRotationMatrix();
  const double yaw = std::atan2(r(0, 2), r(2, 2)) - vkitti_yaw_offset_rad;
  return {std::remainder(yaw, 2 * std::numbers::pi), std::atan2(-r(1, 2), std::hypot(r(1, 0), r(1, 1))),
          std::atan2(r(1, 0), r(1, 1))};
}

namespace {

const char* const extrinsics_header = "frame r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1";
const char* const objects_header =
    "frame tid label truncated occluded alpha l t r b w3d h3d l3d "
    "x3d y3d z3d ry rx rz truncr occupr orig_label moving model color";

// Reads an object in the order of the columns above.
Vkitti1Object read_object(TextTable& row) {
  Vkitti1Object object;
  object.frame = row.frame();
  object.tid = row.track();
  object.label = row.word();
  object.truncated = row.integer();
  object.occluded = row.integer();
  auto& [left, top, right, bottom] = object.box;
  for (double* value : {&object.alpha, &left, &top, &right, &bottom}) *value = row.finite();
  row.rows().ordered(object.box);
  object.size_m = row.vector_m();
  object.position_m = row.vector_m();
  if (!(object.size_m.minCoeff() > 0))
    row.fail_here("expected w3d, h3d and l3d > 0, got {}", fmt::join(object.size_m, " "));
  auto& [ry, rx, rz] = object.angles;
  for (double* value : {&ry, &rx, &rz}) *value = row.radians();
  for (double* value : {&object.truncr, &object.occupr}) *value = row.finite();
  object.orig_label = row.word();
  object.moving = row.flag();
  object.model = row.word();
  object.color = row.word();
  return object;
}

// Parses "Car:12" or "Building".
void read_category(const std::string& text, const TextTable& table, Vkitti1Color& color) {
  const size_t colon = text.rfind(':');
  color.category = text.substr(0, colon);
  if (colon == std::string::npos) return;
  int tid = -1;
  const auto [end, error] = std::from_chars(text.data() + colon + 1, text.data() + text.size(), tid);
  if (error != std::errc() || end != text.data() + text.size() || tid < 0) {
    table.fail_here("expected a track id of 0 or more after ':', got '{}'", text);
  }
  color.tid = tid;
}

}  // namespace

std::map<int, SE3> decode_vkitti1_extrinsics(std::string_view text, const std::string& name) {
  TextTable table(text, name, {"frame", "r1,1", "t3"});
  if (table.n_columns() != 17 || table.column(0) != 0 || table.column(1) != 1 || table.column(2) != 12) {
    table.fail_here("expected the 17 columns {}", extrinsics_header);
  }
  std::map<int, SE3> poses;
  while (table.next()) {
    const int frame = table.frame();
    if (!poses.emplace(frame, read_pose_fields(table.rows(), 1)).second) {
      table.fail_here("frame {} has a pose already: every frame may appear once", frame);
    }
  }
  return poses;
}

std::string encode_vkitti1_extrinsics(const std::map<int, SE3>& T_camera_world) {
  std::string out;
  put_line(out, extrinsics_header);
  return out += encode_pose_text(T_camera_world);
}

std::vector<Vkitti1Object> decode_vkitti1_objects(std::string_view text, const std::string& name) {
  TextTable table(text, name, split(objects_header, ' '));
  std::vector<Vkitti1Object> objects;
  std::set<std::pair<int, int>> seen;
  while (table.next()) {
    objects.push_back(read_object(table));
    const Vkitti1Object& object = objects.back();
    if (!seen.emplace(object.frame, object.tid).second) {
      table.fail_here("track {} appears twice in frame {}", object.tid, object.frame);
    }
  }
  return objects;
}

std::string encode_vkitti1_objects(const std::vector<Vkitti1Object>& objects) {
  std::string out;
  put_line(out, objects_header);
  for (const Vkitti1Object& o : objects) {
    put_line(out, o.frame, o.tid, o.label, o.truncated, o.occluded, o.alpha, o.box.left, o.box.top,
             o.box.right, o.box.bottom, fmt::join(o.size_m, " "), fmt::join(o.position_m, " "), o.angles.ry,
             o.angles.rx, o.angles.rz, o.truncr, o.occupr, o.orig_label, int{o.moving}, o.model, o.color);
  }
  return out;
}

std::vector<Vkitti1Color> decode_vkitti1_colors(std::string_view text, const std::string& name) {
  TextTable table(text, name, {"Category(:id)", "r", "g", "b"});
  std::vector<Vkitti1Color> colors;
  // line, and true if it belongs to a track
  std::map<std::tuple<int, int, int>, std::pair<int64_t, bool>> line_of;
  while (table.next()) {
    Vkitti1Color color;
    read_category(table.word(), table, color);
    for (uint8_t* value : {&color.color.r, &color.color.g, &color.color.b}) *value = table.component();
    const auto [at, is_new] = line_of.emplace(std::tuple(color.color.r, color.color.g, color.color.b),
                                              std::pair(table.rows().line(), color.tid.has_value()));
    if (!is_new && (at->second.second || color.tid)) {
      table.fail_here("colour {} {} {} is that of line {} already: a track's colour may appear once",
                      color.color.r, color.color.g, color.color.b, at->second.first);
    }
    colors.push_back(std::move(color));
  }
  return colors;
}

std::string encode_vkitti1_colors(const std::vector<Vkitti1Color>& colors) {
  std::string out = "Category(:id) r g b\n";
  for (const Vkitti1Color& c : colors) {
    const std::string id = c.tid ? fmt::format(":{}", *c.tid) : "";
    put_line(out, c.category + id, c.color.r, c.color.g, c.color.b);
  }
  return out;
}

namespace {

const char* const extrinsic_header =
    "frame cameraID r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1";
const char* const intrinsic_header = "frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]";
const char* const pose_header =
    "frame cameraID trackID alpha width height length world_space_X world_space_Y world_space_Z "
    "rotation_world_space_y rotation_world_space_x rotation_world_space_z camera_space_X camera_space_Y "
    "camera_space_Z rotation_camera_space_y rotation_camera_space_x rotation_camera_space_z";
const char* const box_header =
    "frame cameraID trackID left right top bottom number_pixels truncation_ratio occupancy_ratio isMoving";
const char* const info_header = "trackID label model color";

/// Rows read so far, by frame, camera and track.
class Seen {
 public:
  void add(const TextTable& table, int frame, int camera) {
    if (seen_.emplace(frame, camera, 0).second) return;
    table.fail_here("camera {} appears twice in frame {}", camera, frame);
  }
  /// Reads frame, camera and track of an object's row.
  template <typename Row>
  Row begin(TextTable& table) {
    Row row;
    row.frame = table.frame();
    row.camera = table.not_negative();
    row.track = table.track();
    if (seen_.emplace(row.frame, row.camera, row.track).second) return row;
    table.fail_here("track {} appears twice in frame {} of camera {}", row.track, row.frame, row.camera);
  }

 private:
  std::set<std::tuple<int, int, int>> seen_;
};

/// Decodes all rows below a header that names the columns.
template <typename Read>
auto decode(std::string_view text, const std::string& name, const char* header, Read read) {
  TextTable table(text, name, split(header, ' '));
  std::vector<decltype(read(table))> rows;
  while (table.next()) rows.push_back(read(table));
  return rows;
}

/// Encodes the header and, by put(text, row), each row.
template <typename Row, typename Put>
std::string encode(const char* header, const std::vector<Row>& rows, const Put& put) {
  std::string text;
  put_line(text, header);
  for (const Row& row : rows) put(text, row);
  return text;
}

}  // namespace

std::vector<Vkitti2Extrinsic> decode_vkitti2_extrinsics(std::string_view text, const std::string& name) {
  TextTable table(text, name, {"frame", "cameraID", "r1,1", "t3"});
  if (table.n_columns() != 18 || table.column(2) != 2 || table.column(3) != 13) {
    table.fail_here("expected the 18 columns {}", extrinsic_header);
  }
  std::vector<Vkitti2Extrinsic> out;
  for (Seen seen; table.next();) {
    const int frame = table.frame();
    const int camera = table.not_negative();
    seen.add(table, frame, camera);
    out.push_back({frame, camera, read_pose_fields(table.rows(), 2)});
  }
  return out;
}

std::vector<Vkitti2Intrinsic> decode_vkitti2_intrinsics(std::string_view text, const std::string& name) {
  return decode(text, name, intrinsic_header, [seen = Seen()](TextTable& table) mutable {
    Vkitti2Intrinsic row{.frame = table.frame(), .camera = table.not_negative()};
    seen.add(table, row.frame, row.camera);
    for (double* value : {&row.k.fx, &row.k.fy, &row.k.cx, &row.k.cy}) *value = table.finite();
    if (row.k.fx <= 0 || row.k.fy <= 0) {
      table.fail_here("expected positive focal lengths, got {} and {}", row.k.fx, row.k.fy);
    }
    return row;
  });
}

std::vector<Vkitti2Pose> decode_vkitti2_poses(std::string_view text, const std::string& name) {
  return decode(text, name, pose_header, [seen = Seen()](TextTable& table) mutable {
    auto row = seen.begin<Vkitti2Pose>(table);
    row.alpha = table.finite();
    row.size_m = table.vector_m();
    row.world_m = table.vector_m();
    if (!(row.size_m.minCoeff() > 0))
      table.fail_here("expected width, height and length > 0, got {}", fmt::join(row.size_m, " "));
    row.world_angles = {table.radians(), table.radians(), table.radians()};
    row.camera_m = table.vector_m();
    row.camera_angles = {table.radians(), table.radians(), table.radians()};
    return row;
  });
}

std::vector<Vkitti2Box> decode_vkitti2_boxes(std::string_view text, const std::string& name) {
  return decode(text, name, box_header, [seen = Seen()](TextTable& table) mutable {
    auto row = seen.begin<Vkitti2Box>(table);
    for (double* value : {&row.box.left, &row.box.right, &row.box.top, &row.box.bottom})
      *value = table.finite();
    table.rows().ordered(row.box);
    row.number_pixels = table.not_negative();
    row.truncation_ratio = table.finite();
    row.occupancy_ratio = table.finite();
    row.is_moving = table.flag();
    return row;
  });
}

std::vector<Vkitti2Info> decode_vkitti2_infos(std::string_view text, const std::string& name) {
  return decode(text, name, info_header, [seen = std::set<int>()](TextTable& table) mutable {
    Vkitti2Info row;
    row.track = table.track();
    if (!seen.insert(row.track).second) table.fail_here("track {} appears twice", row.track);
    for (std::string* word : {&row.label, &row.model, &row.color}) *word = table.word();
    return row;
  });
}

std::string encode_vkitti2_extrinsics(const std::vector<Vkitti2Extrinsic>& rows) {
  return encode(extrinsic_header, rows, [](std::string& text, const Vkitti2Extrinsic& row) {
    const Eigen::Matrix4d m = row.T_camera_world.matrix().transpose();  // row by row
    put_line(text, row.frame, row.camera, fmt::join(m.data(), m.data() + m.size(), " "));
  });
}

std::string encode_vkitti2_intrinsics(const std::vector<Vkitti2Intrinsic>& rows) {
  return encode(intrinsic_header, rows, [](std::string& text, const Vkitti2Intrinsic& row) {
    put_line(text, row.frame, row.camera, row.k.fx, row.k.fy, row.k.cx, row.k.cy);
  });
}

std::string encode_vkitti2_poses(const std::vector<Vkitti2Pose>& rows) {
  return encode(pose_header, rows, [](std::string& text, const Vkitti2Pose& row) {
    const VkittiAngles &world = row.world_angles, &camera = row.camera_angles;
    put_line(text, row.frame, row.camera, row.track, row.alpha, fmt::join(row.size_m, " "),
             fmt::join(row.world_m, " "), world.ry, world.rx, world.rz, fmt::join(row.camera_m, " "),
             camera.ry, camera.rx, camera.rz);
  });
}

std::string encode_vkitti2_boxes(const std::vector<Vkitti2Box>& rows) {
  return encode(box_header, rows, [](std::string& text, const Vkitti2Box& row) {
    put_line(text, row.frame, row.camera, row.track, row.box.left, row.box.right, row.box.top, row.box.bottom,
             row.number_pixels, row.truncation_ratio, row.occupancy_ratio, row.is_moving ? "True" : "False");
  });
}

std::string encode_vkitti2_infos(const std::vector<Vkitti2Info>& rows) {
  return encode(info_header, rows, [](std::string& text, const Vkitti2Info& row) {
    put_line(text, row.track, row.label, row.model, row.color);
  });
}

std::string_view vkitti2_colors() {
  return "Category r g b\n"
         "Terrain 210 0 200\n"
         "Sky 90 200 255\n"
         "Tree 0 199 0\n"
         "Vegetation 90 240 0\n"
         "Building 140 140 140\n"
         "Road 100 60 100\n"
         "GuardRail 250 100 255\n"
         "TrafficSign 255 255 0\n"
         "TrafficLight 200 200 0\n"
         "Pole 255 130 0\n"
         "Misc 80 80 80\n"
         "Truck 160 60 60\n"
         "Car 255 127 80\n"
         "Van 0 139 139\n";
}

}  // namespace sextant
