#pragma once

// Functions that undo one mistake in sampled data (conventions.h), from which the table of hypotheses.cc is
// composed. `Change` computes a right value from a given one.

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "sextant/eval/check/conventions.h"

namespace sextant::undo {

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

inline Undo flow_between(int from, int to) {
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
inline Undo shifted_poses(int shift) {
  return [shift](ConventionData& data, double&) {
    Trajectory moved;
    for (const auto& [frame, pose] : data.truth.camera.poses()) moved.set(frame - shift, pose);
    data.truth.camera = moved;
    return !moved.empty();
  };
}

/// The poses of the file are in the reversed order of time. The world becomes that of the first camera,
/// because a later pose that is exactly the identity would look like missing truth.
inline Undo reversed_poses() {
  return [](ConventionData& data, double&) {
    const std::map<int, SE3> given = data.truth.camera.poses();
    if (given.empty()) return false;
    const SE3 T_first_world = given.rbegin()->second.inverse();
    auto last = given.rbegin();
    for (const auto& [frame, pose] : given) data.truth.camera.set(frame, T_first_world * (last++)->second);
    return true;
  };
}

inline Undo accumulated_poses() {
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

inline Undo shifted_objects(int shift) {
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
inline void take_mask(GridFrame& to, const GridFrame& from) {
  to.mask = from.mask, to.outlines = from.outlines;
}
inline void take_gray(GridFrame& to, const GridFrame& from) { to.gray = from.gray; }
inline void take_depth(GridFrame& to, const GridFrame& from) { to.depth_m = from.depth_m; }

/// Replaces each mask id by the id of the true object whose boxes its outline fits, and removes other masks.
/// Does not apply if a mask fits boxes of several objects, or two masks fit boxes of one object. Does not
/// apply to ids that are right either: removing the masks that fit no box would only hide them.
inline Undo renumbered_masks() {
  return [](ConventionData& data, double& ignored) {
    if (check_mask_ids(data).passes()) return false;
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
    if (std::ranges::all_of(track_of, [](const auto& t) { return t.first == t.second; })) return false;
    return mask_ids([track_of](int id) { return track_of.contains(id) ? track_of.at(id) : 0; })(data,
                                                                                                ignored);
  };
}

/// Reduces ids class * 1000 + track id to the track id + offset; applies if some id is 1000 or more.
inline Undo with_class(int offset) {
  return [offset](ConventionData& data, double& ignored) {
    const auto has_class = [](const GridFrame& f) {
      return !f.outlines.empty() && f.outlines.rbegin()->first >= 1000;
    };
    if (std::ranges::none_of(data.frames, has_class)) return false;
    return mask_ids([offset](int id) { return id % 1000 + offset; })(data, ignored);
  };
}

// ---- fitted numbers

/// Returns every third sample of every third frame, which is enough for one number.
inline ConventionData thinned(const ConventionData& data) {
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

}  // namespace sextant::undo
