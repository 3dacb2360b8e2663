#pragma once

// Mistakes to plant in sources, and what the checks are expected to report about them.

#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/testing.h"
#include "sextant/eval/check/check_source.h"

namespace sextant::planted {

constexpr double pi = std::numbers::pi;

/// A source in memory, so that a mistake is a change of values.
class LoadedSequence final : public MemorySequence {
 public:
  explicit LoadedSequence(const std::string& source) {
    const auto original = open_source(SourceSpec::parse(source));
    info_ = original->info();
    truth_ = original->truth();
    info_.channels = {.gray = original->info().channels.gray,
                      .depth = true,
                      .flow = true,
                      .mask = original->info().channels.mask};
    for (int k = info_.first_frame; k <= info_.last_frame; ++k) {
      frames_.push_back(original->read(k, info_.channels));
    }
  }
  LoadedSequence(const LoadedSequence& from) : frames_(from.frames_) {
    info_ = from.info_;
    truth_ = from.truth_;
  }
  Frame read(int frame, Channels channels) const override {
    const Frame& from = frames_[static_cast<size_t>(frame - info_.first_frame)];
    Frame out;
    if (channels.gray) out.gray = from.gray;
    if (channels.depth) out.depth_m = from.depth_m;
    if (channels.flow) out.flow = from.flow;
    if (channels.mask) out.mask = from.mask;
    return out;
  }

  std::vector<Frame>
      frames_;  // NOLINT(misc-non-private-member-variables-in-classes): mistakes change anything
};

// ---- the changes that make up a mistake

using Mistake = std::function<void(LoadedSequence&)>;

template <typename Change>
Mistake depth(Change change) {
  return [change](LoadedSequence& s) {
    for (Frame& frame : s.frames_) {
      for (const auto [x, y] : pixels(frame.depth_m)) {
        float& z = frame.depth_m(x, y);
        if (std::isfinite(z)) z = static_cast<float>(change(s.info_, double{z}, x, y));
      }
    }
  };
}

template <typename Change>
Mistake flow(Change change) {
  return [change](LoadedSequence& s) {
    for (Frame& frame : s.frames_) {
      for (size_t i = 0; i < frame.flow.size(); ++i) {
        Flow& f = frame.flow.data()[i];
        if (f.valid()) f = change(s.info_, f);
      }
    }
  };
}

template <typename Change>
Mistake pose(Change change) {
  return [change](LoadedSequence& s) {
    const std::map<int, SE3> given = s.truth_.camera.poses();
    for (const auto& [frame, T] : given) s.truth_.camera.set(frame, change(T));
  };
}

template <typename Change>
Mistake object(Change change) {
  return [change](LoadedSequence& s) {
    for (auto& [frame, list] : s.truth_.objects) {
      for (ObjectTruth& o : list) change(o, *s.truth_.camera.pose(frame));
    }
  };
}

template <typename Change>
Mistake mask(Change change) {
  return [change](LoadedSequence& s) {
    for (Frame& frame : s.frames_) {
      for (size_t i = 0; i < frame.mask.size(); ++i) {
        uint16_t& id = frame.mask.data()[i];
        if (id != 0) id = static_cast<uint16_t>(change(int{id}));
      }
    }
  };
}

/// Replaces `channel` in each frame but the last by that of the next frame (of the previous one for shift =
/// -1).
template <typename T>
Mistake shifted(Image<T> Frame::*channel, int shift) {
  return [channel, shift](LoadedSequence& s) {
    const std::vector<Frame> given = s.frames_;
    const int n = static_cast<int>(given.size());
    for (int i = 0; i < n; ++i) {
      const int from = std::clamp(i + shift, 0, n - 1);
      s.frames_[static_cast<size_t>(i)].*channel = given[static_cast<size_t>(from)].*channel;
    }
  };
}

/// Computes the flow from each frame to the previous one, from the true motions of background and objects.
inline void backward_flow(LoadedSequence& s, int from_offset) {
  const PinholeCamera& camera = s.info_.camera.left;
  const std::vector<Frame> given = s.frames_;
  for (int k = s.info_.first_frame; k < s.info_.last_frame; ++k) {
    const int from = k + from_offset, to = from - 1;
    Image<Flow>& out = s.frames_[static_cast<size_t>(k - s.info_.first_frame)].flow;
    std::fill_n(out.data(), out.size(), Flow());
    if (to < s.info_.first_frame) continue;
    const Frame& frame = given[static_cast<size_t>(from - s.info_.first_frame)];
    for (const auto [x, y] : pixels(out)) {
      const int id = frame.mask(x, y);
      const auto motion =
          id == 0 ? s.truth_.background_motion(from, to) : s.truth_.object_motion(id, from, to);
      if (!motion || !std::isfinite(frame.depth_m(x, y))) continue;
      const Eigen::Vector3d p = *motion * camera.backproject(x, y, frame.depth_m(x, y));
      if (p.z() < 0.1) continue;
      const Eigen::Vector2d q = camera.project(p);
      out(x, y) = {static_cast<float>(q.x() - x), static_cast<float>(q.y() - y)};
    }
  }
}

template <typename Offset>
Mistake displaced(Offset offset_m) {
  return object([offset_m](ObjectTruth& o, const SE3&) {
    o.T_camera_object = SE3(o.T_camera_object.rotation(), o.T_camera_object.translation() + offset_m(o));
  });
}

template <typename NewYaw>
Mistake yaw(NewYaw new_yaw) {
  return object([new_yaw](ObjectTruth& o, const SE3&) {
    const Eigen::Vector3d ahead = o.T_camera_object.rotation() * Eigen::Vector3d::UnitZ();
    const double yaw_rad = new_yaw(std::atan2(ahead.x(), ahead.z()));
    o.T_camera_object = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY())),
                            o.T_camera_object.translation());
  });
}

/// Scales the calibration with bf as for images of another size; depth is computed from disparity.
inline void scale_calibration(LoadedSequence& s, double factor) {
  StereoCamera& camera = s.info_.camera;
  PinholeCamera& c = camera.left;
  c = {factor * c.fx, factor * c.fy, factor * (c.cx + 0.5) - 0.5, factor * (c.cy + 0.5) - 0.5};
  camera.bf *= factor;
  depth([factor](const SequenceInfo&, double z, int, int) { return factor * z; })(s);
}

// ---- the table of mistakes

struct Seed {
  const char* name;
  const char* cause;  ///< expected part of the reported cause
  Mistake mistake;
  const char* source = "synthetic:s18@0-3";
};

using I = const SequenceInfo&;

inline std::vector<Seed> seeds() {
  const auto axes = [](const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
    Eigen::Matrix3d columns;
    columns << x, y, z;
    return SE3(Eigen::Quaterniond(columns), Eigen::Vector3d::Zero());
  };
  const auto X = Eigen::Vector3d::UnitX(), Y = Eigen::Vector3d::UnitY(), Z = Eigen::Vector3d::UnitZ();
  const SE3 T_camera_robot = axes(Z, -X, -Y);
  const SE3 T_camera_opengl = axes(X, -Y, -Z);
  const char* turning = "synthetic:s01-turn@0-4";
  return {
      {"DepthIsDisparity", "depth looks like disparity",
       depth([](I i, double z, int, int) { return i.camera.bf / z; })},
      {"DepthIsDisparity256", "depth looks like disparity*256",
       depth([](I i, double z, int, int) { return 256 * i.camera.bf / z; })},
      {"DepthInCentimetres", "centimetres", depth([](I, double z, int, int) { return 100 * z; })},
      {"DepthInMillimetres", "millimetres", depth([](I, double z, int, int) { return 1000 * z; })},
      {"DepthTimes256", "depth*256", depth([](I, double z, int, int) { return 256 * z; })},
      {"CentimetresReadAsDisparity", "depth looks like centimetres: the files are read as disparity * 256",
       depth([](I i, double z, int, int) { return i.camera.bf / (std::round(100 * z) / 256); })},
      {"DisparityReadAsCentimetres", "depth looks like disparity * 256: the files are read as centimetres",
       depth([](I i, double z, int, int) { return std::round(256 * i.camera.bf / z) / 100; })},
      {"DepthIsRange", "range along the ray",
       depth([](I i, double z, int x, int y) { return z * i.camera.left.ray(x, y).norm(); })},
      {"DepthScale", "depth is too large by a factor 1.1",
       depth([](I, double z, int, int) { return 1.1 * z; })},
      {"DepthSlightlyTooSmall", "depth is too small by a factor 1.04",
       depth([](I, double z, int, int) { return 0.96 * z; })},
      {"DepthOfNextFrame", "depth is of the next frame", shifted(&Frame::depth_m, 1)},
      {"FlowBackward", "flow is backward", [](LoadedSequence& s) { backward_flow(s, 1); }},
      {"FlowToPrevious", "flow is backward", [](LoadedSequence& s) { backward_flow(s, 0); }},
      {"FlowNegated", "flow is backward", flow([](I, Flow f) {
         return Flow{-f.u, -f.v};
       })},
      {"FlowSwapped", "u and v swapped", flow([](I, Flow f) {
         return Flow{f.v, f.u};
       })},
      {"FlowDouble", "flow is 2 times too large", flow([](I, Flow f) {
         return Flow{2 * f.u, 2 * f.v};
       })},
      {"FlowHalf", "flow is 2 times too small", flow([](I, Flow f) {
         return Flow{f.u / 2, f.v / 2};
       })},
      {"FlowUndecoded", "flow is not decoded", flow([](I, Flow f) {
         return Flow{64 * f.u + 32768, 64 * f.v + 32768};
       })},
      {"FlowNormalised", "normalised by the image size", flow([](I i, Flow f) {
         return Flow{f.u / static_cast<float>(i.width - 1), f.v / static_cast<float>(i.height - 1)};
       })},
      {"FlowOfNextPair", "flow is off by one frame", shifted(&Frame::flow, 1), turning},
      {"PosesInverted", "inverted", pose([](const SE3& T) { return T.inverse(); })},
      {"PosesInvertedInTurn", "inverted", pose([](const SE3& T) { return T.inverse(); }), turning},
      {"PosesWithRobotAxes", "robot axes", pose([=](const SE3& T) { return T * T_camera_robot; })},
      {"PosesWithOpenGlAxes", "OpenGL axes", pose([=](const SE3& T) { return T * T_camera_opengl; })},
      {"PosesLeftHanded", "left-handed: the x axes", pose([](const SE3& T) {
         const Eigen::Quaterniond& q = T.rotation();
         const Eigen::Vector3d& t = T.translation();
         return SE3(Eigen::Quaterniond(q.w(), q.x(), -q.y(), -q.z()), {-t.x(), t.y(), t.z()});
       }),
       turning},
      {"PosesTransposed", "transposed rotations, with the right positions",
       pose([](const SE3& T) { return SE3(T.rotation().conjugate(), T.translation()); }), turning},
      {"PosesTransposedBeforeInversion", "transposed rotations in the matrices world -> camera",
       pose([](const SE3& T) {
         const SE3 given = T.inverse();
         return SE3(given.rotation().conjugate(), given.translation()).inverse();
       }),
       turning},
      {"PosesReversed", "reversed order of time",
       [](LoadedSequence& s) {
         const std::map<int, SE3> given = s.truth_.camera.poses();
         auto last = given.rbegin();
         for (const auto& [frame, T] : given) s.truth_.camera.set(frame, (last++)->second);
       },
       turning},
      {"PosesScaled", "camera positions are too large by a factor 1.2",
       pose([](const SE3& T) { return SE3(T.rotation(), 1.2 * T.translation()); })},
      {"PosesSlightlyScaled", "camera positions are too large by a factor 1.04",
       pose([](const SE3& T) { return SE3(T.rotation(), 1.04 * T.translation()); })},
      {"PosesAllIdentity", "all camera poses are the identity", pose([](const SE3&) { return SE3(); })},
      {"PosesOfNextFrame", "poses are off by one frame",
       [](LoadedSequence& s) {
         Trajectory moved;
         for (const auto& [frame, T] : s.truth_.camera.poses()) moved.set(frame - 1, T);
         s.truth_.camera = moved;
       },
       turning},
      {"PosesMissingAsIdentity", "identity",
       [](LoadedSequence& s) { s.truth_.camera.set(s.info_.first_frame + 2, SE3()); }},
      {"YawOffByHalfPi", "yaw is off by pi/2", yaw([](double a) { return a + pi / 2; })},
      {"YawOffByMinusHalfPi", "yaw is off by pi/2", yaw([](double a) { return a - pi / 2; })},
      {"YawOffByPi", "yaw is off by pi", yaw([](double a) { return a + pi; })},
      {"YawNegated", "wrong sign", yaw([](double a) { return pi - a; }), turning},
      {"ObjectsInTheWorld", "world frame",
       object([](ObjectTruth& o, const SE3& T) { o.T_camera_object = T * o.T_camera_object; }), turning},
      {"ObjectsAtTheBoxCentre", "box centre",
       displaced([](const ObjectTruth& o) { return Eigen::Vector3d(0, -o.size_m->y() / 2, 0); })},
      {"ObjectsOfTheRightCamera", "stereo baseline",
       displaced([](const ObjectTruth&) { return Eigen::Vector3d(-0.54, 0, 0); })},
      {"ObjectIdsOffByOne", "mask ids are off by one",
       mask([](int id) { return id - 1 == 0 ? 60 : id - 1; })},
      {"MaskIdsWithClass", "class * 1000 + track id", mask([](int id) { return 1000 + id; })},
      {"MaskIdsRenumbered", "renumbered", mask([](int id) { return 100 - 7 * id; })},
      {"MasksOfNextFrame", "masks are of the next frame", shifted(&Frame::mask, 1), turning},
      {"MaskBackgroundIs255", "id 255 is void or background",
       [](LoadedSequence& s) {
         for (Frame& frame : s.frames_)
           std::replace(frame.mask.data(), frame.mask.data() + frame.mask.size(), 0, 255);
       }},
      {"ImagesMirrored", "images are mirrored",
       [](LoadedSequence& s) {
         for (Frame& frame : s.frames_) {
           for (int y = 0; y < frame.gray.height(); ++y)
             std::reverse(frame.gray.row(y), frame.gray.row(y) + frame.gray.width());
         }
       },
       turning},
      {"PrincipalPointSwapped", "cx and cy are swapped",
       [](LoadedSequence& s) { std::swap(s.info_.camera.left.cx, s.info_.camera.left.cy); }},
      {"CalibrationOfLargeImages", "images twice as large",
       [](LoadedSequence& s) {
         PinholeCamera& c = s.info_.camera.left;
         c = {2 * c.fx, 2 * c.fy, 2 * c.cx + 0.5, 2 * c.cy + 0.5};
       }},
      {"CalibrationAndBfOfLargeImages", "the calibration, with bf, is of images twice as large",
       [](LoadedSequence& s) { scale_calibration(s, 2); }},
      {"CalibrationAndBfOfSmallImages", "the calibration, with bf, is of images half as large",
       [](LoadedSequence& s) { scale_calibration(s, 0.5); }},
  };
}

inline std::string report(const std::vector<SourceCheck>& checks) {
  std::string text;
  for (const SourceCheck& c : checks) {
    text += fmt::format("{} {} {} of {}: {} | {}\n", to_string(c.outcome), c.name, c.value.value_or(NAN),
                        c.limit.value_or(NAN), c.cause, c.message);
  }
  return text;
}

/// Expects that a check fails, or is SUSPECT if that is the `least` outcome, and that it names the mistake.
inline void expect_caught(const LoadedSequence& sequence, const std::string& cause,
                          CheckOutcome least = CheckOutcome::fail) {
  const std::vector<SourceCheck> checks = check_source(sequence, {.jobs = 2, .quiet = true});
  bool failed = false, named = false;
  for (const SourceCheck& c : checks) {
    if (c.outcome != CheckOutcome::fail && c.outcome != least) continue;
    failed = true;
    named |= (c.cause + c.message).find(cause) != std::string::npos;
  }
  EXPECT_TRUE(failed) << report(checks);
  EXPECT_TRUE(named) << "expected: " << cause << "\n" << report(checks);
}

inline void expect_clean(const std::vector<SourceCheck>& checks) {
  for (const SourceCheck& c : checks) {
    EXPECT_TRUE(c.outcome == CheckOutcome::pass || c.outcome == CheckOutcome::note) << c.name << "\n"
                                                                                    << report(checks);
  }
}

/// Returns a source that is decoded once for all tests.
inline const LoadedSequence& clean_source(const std::string& source) {
  static std::map<std::string, std::unique_ptr<LoadedSequence>> opened;
  auto& sequence = opened[source];
  if (!sequence) sequence = std::make_unique<LoadedSequence>(source);
  return *sequence;
}

inline LoadedSequence copy_of(const std::string& source) {
  LoadedSequence copy(clean_source(source));
  for (auto& [frame, list] : copy.truth_.objects) {
    for (ObjectTruth& o : list) o.size_m = o.size_m.value_or(Eigen::Vector3d(1.78, 1.46, 4.3));
  }
  return copy;
}

}  // namespace sextant::planted
