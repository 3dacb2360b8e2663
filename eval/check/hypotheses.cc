#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "sextant/eval/check/conventions.h"
#include "sextant/eval/diagnosis/dense_readings.h"
#include "sextant/eval/diagnosis/number_readings.h"

namespace sextant {

namespace undo {
namespace {

// Functions that undo one mistake in sampled data (conventions.h), from which the table below is composed.
// `Change` computes a right value from a given one.

/// Rereads sampled data in place, as Hypothesis::undo (diagnosis/hypothesis.h).
using Undo = std::function<bool(ConventionData&, double&)>;

// ---- the changes of a hypothesis

/// A change that applies to all data.
template <typename Change>
Undo always(Change change) {
  return [change](ConventionData& data, double&) {
    change(data);
    return true;
  };
}

template <typename Change>  // z, u, v -> z
Undo depth(Change change) {
  return always([change](ConventionData& data) {
    for (GridFrame& frame : data.frames) {
      for (const auto [i, j] : pixels(frame.depth_m)) {
        float& z = frame.depth_m(i, j);
        if (std::isfinite(z)) z = static_cast<float>(change(data, double{z}, data.pixel(i), data.pixel(j)));
        if (z <= 0) z = NAN;
      }
    }
  });
}

template <typename Change>  // u, v -> u, v
Undo flow(Change change) {
  return always([change](ConventionData& data) {
    for (GridFrame& frame : data.frames) {
      for (size_t i = 0; i < frame.flow.size(); ++i) {
        Flow& f = frame.flow.data()[i];
        const Eigen::Vector2d changed = change(data, double{f.u}, double{f.v});
        f = {static_cast<float>(changed.x()), static_cast<float>(changed.y())};
      }
    }
  });
}

Undo flow_between(int from, int to) {
  return always([from, to](ConventionData& data) {
    data.flow_from = from;
    data.flow_to = to;
  });
}

template <typename Change>  // T_world_camera -> T_world_camera
Undo poses(Change change) {
  return [change](ConventionData& data, double&) {
    const std::map<int, SE3> given = data.truth.camera.poses();
    for (const auto& [frame, pose] : given) data.truth.camera.set(frame, change(pose));
    return !given.empty();
  };
}

/// The pose of frame k is found in the files at k + shift.
Undo shifted_poses(int shift) {
  return [shift](ConventionData& data, double&) {
    Trajectory moved;
    for (const auto& [frame, pose] : data.truth.camera.poses()) moved.set(frame - shift, pose);
    data.truth.camera = moved;
    return !moved.empty();
  };
}

/// The poses of the file are in the reversed order of time. The world becomes that of the first camera,
/// because a later pose that is exactly the identity would look like missing truth.
Undo reversed_poses() {
  return [](ConventionData& data, double&) {
    const std::map<int, SE3> given = data.truth.camera.poses();
    if (given.empty()) return false;
    const SE3 T_first_world = given.rbegin()->second.inverse();
    auto last = given.rbegin();
    for (const auto& [frame, pose] : given) data.truth.camera.set(frame, T_first_world * (last++)->second);
    return true;
  };
}

Undo accumulated_poses() {
  return [](ConventionData& data, double&) {
    SE3 pose;
    const std::map<int, SE3> given = data.truth.camera.poses();
    for (const auto& [frame, step] : given) data.truth.camera.set(frame, pose = pose * step);
    return !given.empty();
  };
}

template <typename Change>  // object, T_world_camera of its frame
Undo objects(Change change) {
  return [change](ConventionData& data, double&) {
    for (auto& [frame, list] : data.truth.objects) {
      const auto T_world_camera = data.truth.camera.pose(frame);
      for (ObjectTruth& object : list) change(object, T_world_camera);
    }
    return !data.truth.objects.empty();
  };
}

Undo shifted_objects(int shift) {
  return [shift](ConventionData& data, double&) {
    decltype(data.truth.objects) moved;
    for (const auto& [frame, list] : data.truth.objects) moved[frame - shift] = list;
    data.truth.objects = moved;
    return !moved.empty();
  };
}

/// Computes a new yaw about the camera's y axis from the given one.
template <typename Change>
Undo yaw(Change change) {
  return objects([change](ObjectTruth& object, const std::optional<SE3>&) {
    const Eigen::Vector3d ahead = object.T_camera_object.rotation() * Eigen::Vector3d::UnitZ();
    const double given = std::atan2(ahead.x(), ahead.z());
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(change(given) - given, Eigen::Vector3d::UnitY()));
    object.T_camera_object =
        SE3(turn * object.T_camera_object.rotation(), object.T_camera_object.translation());
  });
}

template <typename Change>  // position -> position
Undo positions(Change change) {
  return objects([change](ObjectTruth& object, const std::optional<SE3>&) {
    object.T_camera_object =
        SE3(object.T_camera_object.rotation(), change(object, object.T_camera_object.translation()));
  });
}

template <typename Change>  // id -> id, 0 stays 0
Undo mask_ids(Change change) {
  return always([change](ConventionData& data) {
    const auto changed = [&](int id) {
      return static_cast<uint16_t>(std::max(0, id == 0 ? 0 : int{change(id)}));
    };
    for (GridFrame& frame : data.frames) {
      for (size_t i = 0; i < frame.mask.size(); ++i) {
        frame.mask.data()[i] = changed(frame.mask.data()[i]);
      }
      std::map<int, MaskOutline> outlines;
      for (const auto& [id, outline] : frame.outlines) outlines[changed(id)] = outline;
      outlines.erase(0);
      frame.outlines = outlines;
    }
  });
}

/// The mask (or depth) of frame k is found in the files at k + shift.
template <typename Take>
Undo shifted_channel(int shift, Take take) {
  return always([shift, take](ConventionData& data) {
    const std::vector<GridFrame> given = data.frames;
    for (int frame = data.first_frame; frame <= data.last_frame(); ++frame) {
      const int from = frame + shift;
      GridFrame& to = data.frames[static_cast<size_t>(frame - data.first_frame)];
      take(to, data.has(from) ? given[static_cast<size_t>(from - data.first_frame)] : GridFrame());
    }
  });
}
void take_mask(GridFrame& to, const GridFrame& from) { to.mask = from.mask, to.outlines = from.outlines; }
void take_gray(GridFrame& to, const GridFrame& from) { to.gray = from.gray; }
void take_depth(GridFrame& to, const GridFrame& from) { to.depth_m = from.depth_m; }

// ---- fitted numbers

/// Returns every third sample of every third frame, which is enough for one number.
ConventionData thinned(const ConventionData& data) {
  ConventionData few = data;
  few.step = 3 * data.step;
  for (GridFrame& frame : few.frames) {
    frame.depth_m = sample_grid(frame.depth_m, 3);
    frame.flow = sample_grid(frame.flow, 3);
    frame.mask = sample_grid(frame.mask, 3);
  }
  return few;
}

/// Finds the factor in [1/limit, limit] that reduces the residual of the static flow most, and applies it.
/// For depth (steps = 1) and camera positions (steps = -1) it is refined from the step lengths. `fitted` is
/// the inverse of the factor; the hypothesis does not apply if the factor is within 0.5 % of 1.
template <typename MakeUndo>  // factor -> Undo
Undo fitted_factor(double limit, MakeUndo make_undo, int steps = 0) {
  return [limit, make_undo, steps](ConventionData& data, double& fitted) {
    const ConventionData few = thinned(data);
    const auto residual = [&](double log_factor) {
      ConventionData changed = few;
      double ignored = 0;
      make_undo(std::exp(log_factor))(changed, ignored);
      const Finding finding = check_static_flow(changed);
      return finding.value.value_or(1e9);
    };
    const double range = std::log(limit);
    double best = 0, step = range / 16, least = residual(0);
    for (double x = -range; x <= range; x += step) {
      if (const double r = residual(x); r < least) best = x, least = r;
    }
    for (step /= 2; step > 1e-3; step /= 2) {
      for (const double x : {best - step, best + step}) {
        if (const double r = residual(x); r < least) best = x, least = r;
      }
    }
    double ignored = 0;
    make_undo(std::exp(best))(data, ignored);
    // Distant points dominate the median; the step lengths are more accurate.
    if (const DepthFactor fit = fit_depth_factor(data); steps != 0 && fit.n > 0) {
      const double polish = std::pow(fit.factor, steps);
      make_undo(polish)(data, ignored);
      best += std::log(polish);
    }
    fitted = std::exp(-best);
    return std::abs(best) > 0.005;
  };
}

// ---- the table

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

/// Replaces each mask id by the id of the true object whose boxes its outline fits, and removes other masks.
/// Does not apply if a mask fits boxes of several objects, or two masks fit those of one.
Undo renumbered_masks() {
  return [](ConventionData& data, double& ignored) {
    std::map<int, std::map<int, int>> counts;  // mask id -> track id -> boxes that agree
    for (const auto& [frame, list] : data.truth.objects) {
      if (!data.has(frame)) continue;
      for (const ObjectTruth& object : list) {
        if (!object.box) continue;
        const ImageBox& box = *object.box;
        for (const auto& [id, outline] : data.at(frame).outlines) {
          const ImageBox& mask = outline.box;
          const bool fits = std::abs(mask.left - box.left) < 0.2 * box.width() &&
                            std::abs(mask.right - box.right) < 0.2 * box.width() &&
                            std::abs(mask.top - box.top) < 0.25 * box.height() &&
                            std::abs(mask.bottom - box.bottom) < 0.25 * box.height();
          if (fits) ++counts[id][object.id];
        }
      }
    }
    std::map<int, int> track_of;
    std::map<int, int> taken;
    for (const auto& [id, tracks] : counts) {
      const auto most = std::ranges::max_element(tracks, {}, [](const auto& t) { return t.second; });
      if (tracks.size() > 1 || taken.contains(most->first)) return false;
      track_of[id] = most->first;
      taken[most->first] = id;
    }
    if (track_of.empty()) return false;
    return mask_ids([track_of](int id) { return track_of.contains(id) ? track_of.at(id) : 0; })(data,
                                                                                                ignored);
  };
}

/// Reduces ids class * 1000 + track id to the track id + offset; applies if some id is 1000 or more.
Undo with_class(int offset) {
  return [offset](ConventionData& data, double& ignored) {
    const auto has_class = [](const GridFrame& f) {
      return !f.outlines.empty() && f.outlines.rbegin()->first >= 1000;
    };
    if (std::ranges::none_of(data.frames, has_class)) return false;
    return mask_ids([offset](int id) { return id % 1000 + offset; })(data, ignored);
  };
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
