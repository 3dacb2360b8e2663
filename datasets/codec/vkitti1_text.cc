#include "sextant/datasets/codec/vkitti1_text.h"

#include <fmt/ranges.h>

#include <charconv>
#include <set>
#include <tuple>
#include <utility>

#include "sextant/base/text.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

const char* const extrinsics_header = "frame r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1";
const char* const objects_header =
    "frame tid label truncated occluded alpha l t r b w3d h3d l3d "
    "x3d y3d z3d ry rx rz truncr occupr orig_label moving model color";

// In the order of the columns above.
Vkitti1Object read_object(TextTable& row) {
  Vkitti1Object object;
  object.frame = row.frame();
  object.tid = row.track();
  object.label = row.word();
  object.truncated = row.integer();
  object.occluded = row.integer();
  auto& [left, top, right, bottom] = object.box;
  for (double* value : {&object.alpha, &left, &top, &right, &bottom}) *value = row.finite();
  object.size_m = row.vector_m();
  object.position_m = row.vector_m();
  if (!(object.size_m.minCoeff() > 0))
    row.fail_here("expected w3d, h3d and l3d > 0, got {}", fmt::join(object.size_m, " "));
  auto& [ry, rx, rz] = object.angles;
  for (double* value : {&ry, &rx, &rz, &object.truncr, &object.occupr}) *value = row.finite();
  object.orig_label = row.word();
  object.moving = row.flag();
  object.model = row.word();
  object.color = row.word();
  return object;
}

// "Car:12" or "Building".
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
  std::map<std::tuple<int, int, int>, std::pair<int64_t, bool>> line_of;  // and whether it is a track's
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

}  // namespace sextant
