#include "sextant/datasets/vdo_truth.h"

#include <algorithm>
#include <numbers>

#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

ObjectTruth read_object(const TextRows& rows) {
  ObjectTruth object;
  object.id = rows.integer(1, "the object id");
  if (object.id < 1)
    rows.fail_here("expected an object id of 1 or more (0 is the background), got {}", object.id);
  if (object.id > 65535) rows.fail_here("expected an object id of at most 65535, got {}", object.id);
  object.box = rows.box(2);
  const Eigen::Vector3d position(rows.metres(6, "x"), rows.metres(7, "y"), rows.metres(8, "z"));
  const double yaw = rows.finite(9, "ry") + std::numbers::pi / 2;
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()));
  object.T_camera_object = SE3(rotation, position);
  return object;
}

}  // namespace

ObjectTruths decode_vdo_objects(std::string_view text, const std::string& name) {
  ObjectTruths objects;
  for (TextRows rows(text, name); rows.next();) {
    rows.expect(10, "frame id left top right bottom x y z ry (10 values)");
    const int frame = rows.frame(0);
    const ObjectTruth object = read_object(rows);
    if (std::ranges::find(objects[frame], object.id, &ObjectTruth::id) != objects[frame].end()) {
      rows.fail_here("object {} appears twice in frame {}", object.id, frame);
    }
    objects[frame].push_back(object);
  }
  for (auto& [frame, list] : objects) std::ranges::sort(list, {}, &ObjectTruth::id);
  mark_interpolated(objects);
  return objects;
}

}  // namespace sextant
