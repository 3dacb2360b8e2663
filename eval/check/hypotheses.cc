#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/check/conventions.h"
#include "sextant/eval/check/undo.h"
#include "sextant/eval/diagnosis/dense_readings.h"
#include "sextant/eval/diagnosis/number_readings.h"

namespace sextant {

namespace undo {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double min_range_share = 0.5;
constexpr double fit_price = 0.6;  // penalty of a fitted number, which can explain residuals by chance

struct Table {
  std::vector<Hypothesis<ConventionData>> lines;

  void add(std::string cause, Undo undo, double price = 0, bool fits_number = false) {
    lines.push_back({"", std::move(cause), "", std::move(undo), price, fits_number});
  }
};

using D = const ConventionData&;

double bf(const ConventionData& data) { return data.camera.bf; }

void add_depth(const ConventionData& data, Table& table) {
  const auto add = [&](std::string cause, auto change) { table.add(std::move(cause), depth(change)); };
  if (data.depth_kind.empty()) {
    add("depth looks like disparity (z = bf / d)", [](D d, double z, double, double) { return bf(d) / z; });
    add("depth looks like disparity*256 (z = 256 bf / n)",
        [](D d, double z, double, double) { return 256 * bf(d) / z; });
    add("depth looks like inverse depth (1 / z)", [](D, double z, double, double) { return 1 / z; });
    add("depth looks like centimetres: 100 times too large",
        [](D, double z, double, double) { return z / 100; });
    add("depth looks like millimetres: 1000 times too large",
        [](D, double z, double, double) { return z / 1000; });
    add("depth is 100 times too small: metres divided by 100?",
        [](D, double z, double, double) { return z * 100; });
    add("depth is 1000 times too small: metres divided by 1000?",
        [](D, double z, double, double) { return z * 1000; });
    add("depth looks like depth*256 (KITTI depth): 256 times too large",
        [](D, double z, double, double) { return z / 256; });
    add("depth is 256 times too small: KITTI depth divided by 256 twice?",
        [](D, double z, double, double) { return z * 256; });
  }
  // Depth computed by stereo matching is not read from files that could be misinterpreted.
  const auto add_codings = [&](std::string_view kind) {
    for (const DepthReading& reading : depth_readings(kind)) {
      add(reading.cause, [read = reading.read](D d, double z, double, double) { return read(z, bf(d)); });
    }
  };
  if (data.depth_kind.empty()) {
    for (const char* kind : {"disparity256", "cm"}) add_codings(kind);
  } else {
    add_codings(data.depth_kind);
  }
  // On noisy data a plain factor resembles range, unless its variation over the image is tested.
  table.add(
      "depth looks like the range along the ray, not z",
      [](ConventionData& d, double& ignored) {
        const auto share = range_share(d);
        if (share && *share < min_range_share) return false;
        return depth([](D c, double r, double u, double v) { return r / c.camera.left.ray(u, v).norm(); })(
            d, ignored);
      },
      fit_price);
  table.add("depth is of the next frame (files shifted by one)", shifted_channel(-1, take_depth));
  table.add("depth is of the previous frame (files shifted by one)", shifted_channel(1, take_depth));
  table.add("depth is {factor}: wrong baseline or focal length?",
            fitted_factor(
                1e4, [](double s) { return depth([s](D, double z, double, double) { return z * s; }); }, 1),
            fit_price, true);
}

void add_flow(Table& table) {
  table.add("flow is backward: it goes from the next frame to this one", flow_between(1, 0));
  table.add("flow is backward: it goes from this frame to the previous one", flow_between(0, -1));
  table.add("flow is off by one frame: it belongs to the next pair", flow_between(1, 2));
  table.add("flow is off by one frame: it belongs to the previous pair", flow_between(-1, 0));
  for (const FlowReading& reading : flow_readings()) {
    table.add(reading.cause, flow([read = reading.read](const ConventionData& d, double u, double v) {
                return read({u, v}, d.width, d.height);
              }));
  }
  table.add("flow is {factor}",
            fitted_factor(1e3,
                          [](double s) {
                            return flow([s](const ConventionData&, double u, double v) {
                              return Eigen::Vector2d(u * s, v * s);
                            });
                          }),
            2 * fit_price, true);
}

SE3 axes(const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
  Eigen::Matrix3d columns;
  columns << x, y, z;
  return {Eigen::Quaterniond(columns), Eigen::Vector3d::Zero()};
}

void add_poses(Table& table) {
  using V = Eigen::Vector3d;
  const auto turned = [](const SE3& T_given_camera) {
    return poses([T_given_camera](const SE3& pose) { return pose * T_given_camera; });
  };
  table.add("camera poses are inverted: world -> camera instead of camera -> world",
            poses([](const SE3& pose) { return pose.inverse(); }));
  const auto transposed = [](const SE3& pose) {
    return SE3(pose.rotation().conjugate(), pose.translation());
  };
  table.add("camera poses have transposed rotations, with the right positions", poses(transposed));
  table.add("camera poses have transposed rotations in the matrices world -> camera",
            poses([=](const SE3& pose) { return transposed(pose.inverse()).inverse(); }));
  // On a straight drive at a constant speed, axes that point backwards have the same effect.
  table.add("camera poses are in reversed order of time", reversed_poses(), 0.1);
  table.add("camera poses are off by one frame: they are those of the next frame", shifted_poses(-1));
  table.add("camera poses are off by one frame: they are those of the previous frame", shifted_poses(1));
  table.add("camera poses have robot axes (x ahead, y left, z up) instead of the camera's",
            turned(axes(-V::UnitY(), -V::UnitZ(), V::UnitX())));
  table.add("camera poses have axes x right, y ahead, z up instead of the camera's",
            turned(axes(V::UnitX(), -V::UnitZ(), V::UnitY())));
  table.add("camera poses have OpenGL axes (y up, z backward) instead of the camera's",
            turned(axes(V::UnitX(), -V::UnitY(), -V::UnitZ())));
  table.add("camera poses are motions from frame to frame, not poses in the world", accumulated_poses());
  for (const NumberReading& reading : number_readings("camera positions", 0)) {
    if (!reading.code.starts_with("mirrored_")) continue;
    table.add(
        fmt::format("camera poses are left-handed: the {} axes of world and camera point the opposite way",
                    reading.code.back()),
        poses(reading.read), reading.price);
  }
  const auto scaled = [](double s) {
    return poses([s](const SE3& pose) { return SE3(pose.rotation(), s * pose.translation()); });
  };
  table.add("camera positions are in centimetres", scaled(0.01));
  table.add("camera positions are in millimetres", scaled(0.001));
  table.add("camera positions are {factor}", fitted_factor(1e4, scaled, -1), fit_price, true);
}

void add_objects(const ConventionData& data, Table& table) {
  using V = Eigen::Vector3d;
  table.add("object yaw is off by pi/2 (too large)", yaw([](double a) { return a - pi / 2; }));
  table.add("object yaw is off by pi/2 (too small)", yaw([](double a) { return a + pi / 2; }));
  table.add("object yaw is off by pi", yaw([](double a) { return a + pi; }));
  table.add("object yaw has the wrong sign (ry negated)", yaw([](double a) { return pi - a; }));
  table.add("object yaw has the wrong sign (about an axis that points up)", yaw([](double a) { return -a; }));
  table.add("object poses are in the world frame instead of the camera's",
            objects([](ObjectTruth& object, const std::optional<SE3>& T_world_camera) {
              if (T_world_camera) object.T_camera_object = T_world_camera->inverse() * object.T_camera_object;
            }));
  table.add("object poses are off by one frame: they are those of the next frame", shifted_objects(-1));
  table.add("object poses are off by one frame: they are those of the previous frame", shifted_objects(1));
  table.add("object positions are the box centre instead of the middle of its bottom face",
            objects([](ObjectTruth& object, const std::optional<SE3>&) {
              const double height = object.size_m ? object.size_m->y() : 1.5;
              object.T_camera_object =
                  object.T_camera_object * SE3(Eigen::Quaterniond::Identity(), V(0, height / 2, 0));
            }));
  table.add("object positions have robot axes (x ahead, y left, z up) instead of the camera's",
            positions([](const ObjectTruth&, const V& p) { return V(-p.y(), -p.z(), p.x()); }));
  const double baseline = data.camera.bf / data.camera.left.fx;
  for (const double b : {baseline, -baseline}) {
    table.add(fmt::format(
                  "object positions are those of the other camera: off by the stereo baseline, {:+.2f} m", b),
              positions([b](const ObjectTruth&, const V& p) { return V(p - V(b, 0, 0)); }), 0.1);
  }
}

void add_masks(Table& table) {
  table.add("mask ids are off by one: too small (track id + 1 expected)",
            mask_ids([](int id) { return id + 1; }));
  table.add("mask ids are off by one: too large", mask_ids([](int id) { return id - 1; }));
  table.add("mask ids are class * 1000 + track id: the class was not removed", with_class(0));
  table.add("mask ids are class * 1000 + track id: the class was not removed, and 1 was not added",
            with_class(1));
  table.add("masks are of the next frame (files shifted by one)", shifted_channel(-1, take_mask));
  table.add("masks are of the previous frame (files shifted by one)", shifted_channel(1, take_mask));
  table.add("mask ids are renumbered: one to one, but other numbers than the tracks'", renumbered_masks(),
            fit_price);
}

void add_images(Table& table) {
  table.add("images are of the next frame (files shifted by one)", shifted_channel(-1, take_gray));
  table.add("images are of the previous frame (files shifted by one)", shifted_channel(1, take_gray));
  table.add(
      "images are mirrored: left and right are exchanged", always([](ConventionData& data) {
        for (GridFrame& frame : data.frames) {
          if (!frame.gray) continue;
          const Image<uint8_t>& given = *frame.gray;
          frame.gray = std::make_shared<const Image<uint8_t>>(image_of(
              given.width(), given.height(), [&](int x, int y) { return given(given.width() - 1 - x, y); }));
        }
      }));
}

void add_camera(const ConventionData& data, Table& table) {
  table.add("principal point: cx and cy are swapped",
            always([](ConventionData& d) { std::swap(d.camera.left.cx, d.camera.left.cy); }));
  const auto focal = [](double s) {
    return always([s](ConventionData& d) { d.camera.left.fx *= s, d.camera.left.fy *= s; });
  };
  const auto calibration = [](double s) {
    return always([s](ConventionData& d) {
      PinholeCamera& c = d.camera.left;
      c = {c.fx * s, c.fy * s, (c.cx + 0.5) * s - 0.5, (c.cy + 0.5) * s - 0.5};
    });
  };
  table.add("camera: the calibration is of images twice as large", calibration(0.5));
  table.add("camera: the calibration is of images half as large", calibration(2));
  // With bf of the other size as well, depth from disparity is wrong by the same factor.
  const auto with_bf = [calibration](double s) {
    return [s, left = calibration(s)](ConventionData& d, double& ignored) {
      d.camera.bf *= s;
      return left(d, ignored) && depth([s](D, double z, double, double) { return s * z; })(d, ignored);
    };
  };
  const std::set<std::string> from_disparity = {"", "disparity256", "sgbm"};
  if (from_disparity.contains(data.depth_kind)) {
    table.add("camera: the calibration, with bf, is of images twice as large", with_bf(0.5));
    table.add("camera: the calibration, with bf, is of images half as large", with_bf(2));
  }
  table.add("camera: the focal length is {factor}", fitted_factor(4, focal), fit_price, true);
}

}  // namespace
}  // namespace undo

std::vector<Hypothesis<ConventionData>> hypotheses(const ConventionData& data) {
  undo::Table table;
  undo::add_depth(data, table);
  undo::add_flow(table);
  undo::add_poses(table);
  undo::add_objects(data, table);
  undo::add_masks(table);
  undo::add_images(table);
  undo::add_camera(data, table);
  return table.lines;
}

}  // namespace sextant
