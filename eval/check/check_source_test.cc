// Correct sources pass every convention check; each planted mistake fails a check, and is named as its cause.

#include <functional>
#include <numbers>
#include <set>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/testing.h"
#include "sextant/eval/check/check_source.h"

namespace sextant {
namespace {

constexpr double pi = std::numbers::pi;

/// A source in memory, so that a mistake is a change of values.
class LoadedSequence final : public MemorySequence, public KnowsTruthFloor {
 public:
  explicit LoadedSequence(const std::string& source) {
    const auto original = open_source(SourceSpec::parse(source));
    info_ = original->info();
    truth_ = original->truth();
    floor_ = truth_floor(*original);
    info_.channels = {.depth = true, .flow = true, .mask = original->info().channels.mask};
    for (int k = info_.first_frame; k <= info_.last_frame; ++k) {
      frames_.push_back(original->read(k, info_.channels));
    }
  }
  LoadedSequence(const LoadedSequence& from) : frames_(from.frames_), floor_(from.floor_) {
    info_ = from.info_;
    truth_ = from.truth_;
  }
  const TruthFloor& floor() const override { return floor_; }
  Frame read(int frame, Channels channels) const override {
    const Frame& from = frames_[static_cast<size_t>(frame - info_.first_frame)];
    Frame out;
    if (channels.depth) out.depth_m = from.depth_m;
    if (channels.flow) out.flow = from.flow;
    if (channels.mask) out.mask = from.mask;
    return out;
  }

  std::vector<Frame>
      frames_;  // NOLINT(misc-non-private-member-variables-in-classes): mistakes change anything

 private:
  TruthFloor floor_;
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
void backward_flow(LoadedSequence& s, int from_offset) {
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

// ---- the table of mistakes

struct Seed {
  const char* name;
  const char* cause;  ///< expected part of the reported cause
  Mistake mistake;
  const char* source = "synthetic:s18@0-3";
};

using I = const SequenceInfo&;

std::vector<Seed> seeds() {
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
      {"PosesScaled", "camera positions are too large by a factor 1.2",
       pose([](const SE3& T) { return SE3(T.rotation(), 1.2 * T.translation()); })},
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
      {"PrincipalPointSwapped", "cx and cy are swapped",
       [](LoadedSequence& s) { std::swap(s.info_.camera.left.cx, s.info_.camera.left.cy); }},
      {"CalibrationOfLargeImages", "images twice as large",
       [](LoadedSequence& s) {
         PinholeCamera& c = s.info_.camera.left;
         c = {2 * c.fx, 2 * c.fy, 2 * c.cx + 0.5, 2 * c.cy + 0.5};
       }},
  };
}

std::string report(const std::vector<SourceCheck>& checks) {
  std::string text;
  for (const SourceCheck& c : checks) {
    text += fmt::format("{} {} {} of {}: {} | {}\n", to_string(c.outcome), c.name, c.value.value_or(NAN),
                        c.limit.value_or(NAN), c.cause, c.message);
  }
  return text;
}

/// Expects that at least one check fails, and that every reported cause names the mistake or is empty.
void expect_caught(const LoadedSequence& sequence, const std::string& cause) {
  const std::vector<SourceCheck> checks = check_source(sequence, {.jobs = 2, .quiet = true});
  bool failed = false, named = false;
  for (const SourceCheck& c : checks) {
    if (c.outcome != CheckOutcome::fail) continue;
    failed = true;
    named |= (c.cause + c.message).find(cause) != std::string::npos;
  }
  EXPECT_TRUE(failed) << report(checks);
  EXPECT_TRUE(named) << "expected: " << cause << "\n" << report(checks);
}

void expect_clean(const std::vector<SourceCheck>& checks) {
  for (const SourceCheck& c : checks) {
    EXPECT_TRUE(c.outcome == CheckOutcome::pass || c.outcome == CheckOutcome::note) << c.name << "\n"
                                                                                    << report(checks);
  }
}

/// Returns a source that is decoded once for all tests.
const LoadedSequence& clean_source(const std::string& source) {
  static std::map<std::string, std::unique_ptr<LoadedSequence>> opened;
  auto& sequence = opened[source];
  if (!sequence) sequence = std::make_unique<LoadedSequence>(source);
  return *sequence;
}

LoadedSequence copy_of(const std::string& source) {
  LoadedSequence copy(clean_source(source));
  for (auto& [frame, list] : copy.truth_.objects) {
    for (ObjectTruth& o : list) o.size_m = o.size_m.value_or(Eigen::Vector3d(1.78, 1.46, 4.3));
  }
  return copy;
}

// A single test, because separate ones would render the scenes again in their own processes.
TEST(CheckSource, EachSeededMistakeFailsAndIsNamed) {
  for (const Seed& seed : seeds()) {
    SCOPED_TRACE(seed.name);
    LoadedSequence sequence = copy_of(seed.source);
    seed.mistake(sequence);
    expect_caught(sequence, seed.cause);
  }
}

TEST(CheckSource, ExactSourcesPass) {
  for (const char* source : {"synthetic:s18@0-3", "synthetic:s01-turn@0-4", "synthetic:s01-crossing@0-3"}) {
    const std::vector<SourceCheck> checks = check_source(copy_of(source), {.jobs = 2, .quiet = true});
    expect_clean(checks);
    for (const SourceCheck& c : checks) {
      if (c.name == "static flow" && c.value) {
        EXPECT_LT(*c.value, 1e-4) << source;
      }
      if (c.name == "object flow") {
        EXPECT_LT(c.value.value(), 1e-5) << source;
      }
    }
  }
}

TEST(CheckSource, AStandingCameraIsNotCheckedByLuck) {
  const std::vector<SourceCheck> checks =
      check_source(copy_of("synthetic:s01-crossing@0-3"), {.quiet = true});
  for (const char* name : {"static flow", "depth scale", "camera path"}) {
    const auto line = std::ranges::find(checks, name, &SourceCheck::name);
    ASSERT_NE(line, checks.end());
    EXPECT_EQ(line->outcome, CheckOutcome::note);
    EXPECT_THAT(line->message, HasSubstr("not checkable"));
  }
}

TEST(CheckSource, TruthAloneIsEnough) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  sequence.info_.channels = {};
  expect_clean(check_source(sequence, {.quiet = true}));
  sequence.truth_.objects.clear();
  sequence.truth_.camera = {};
  expect_clean(check_source(sequence, {.quiet = true}));
}

TEST(CheckSource, TimeStampsMustIncrease) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  sequence.info_.channels = {};
  const auto times = [&](const std::map<int, double>& stamps) {
    sequence.info_.times_s = stamps;
    const auto checks = check_source(sequence, {.quiet = true});
    return *std::ranges::find(checks, "times", &SourceCheck::name);
  };
  EXPECT_EQ(times({}).outcome, CheckOutcome::note);
  EXPECT_EQ(times({{0, 0.0}, {1, 0.1}, {2, 0.2}, {3, 0.3}}).outcome, CheckOutcome::pass);
  const SourceCheck other_rate = times({{0, 0.0}, {1, 0.05}, {2, 0.1}, {3, 0.15}});
  EXPECT_EQ(other_rate.outcome, CheckOutcome::pass);
  EXPECT_THAT(other_rate.message, HasSubstr("0.05 s, but the rate in use is 10 Hz"));
  EXPECT_EQ(times({{0, 0.0}, {1, 0.1}, {2, 0.3}, {3, 0.4}}).outcome, CheckOutcome::suspect);
  EXPECT_EQ(times({{0, 0.0}, {1, 0.2}, {2, 0.1}, {3, 0.3}}).outcome, CheckOutcome::fail);
  EXPECT_EQ(times({{0, 0.0}, {1, 0.1}, {2, 0.1}, {3, 0.3}}).outcome, CheckOutcome::fail);
}

TEST(CheckSource, LongSourcesAreSampledForTheConventionsAndDecodedForTheTable) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  Frame frame;
  frame.depth_m = sequence.frames_[0].depth_m;
  sequence.truth_ = {};
  sequence.info_.channels = {.depth = true};
  sequence.info_.last_frame = 31;
  sequence.frames_.assign(32, frame);
  sequence.frames_[10].depth_m = {};  // between the runs 5-8 and 11-14
  for (const bool quick : {false, true}) {
    SCOPED_TRACE(quick);
    const auto checks = check_source(sequence, {.quiet = true, .quick = quick});
    const auto depth = std::ranges::find(checks, "depth", &SourceCheck::name);
    EXPECT_EQ(depth->outcome, quick ? CheckOutcome::pass : CheckOutcome::fail);
    EXPECT_EQ(depth->n_present, quick ? 24 : 31);
    EXPECT_EQ(depth->n_expected, quick ? 24 : 32);
    EXPECT_EQ(std::ranges::find(checks, "depth order", &SourceCheck::name)->n, 24);
  }
}

TEST(CheckSource, OutcomesDoNotDependOnThreads) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  pose([](const SE3& T) { return T.inverse(); })(sequence);
  EXPECT_EQ(report(check_source(sequence, {.quiet = true})),
            report(check_source(sequence, {.jobs = 3, .quiet = true})));
}

// ---- the real demo: flow of a network, noisy depth, jittering poses

std::string demo(const char* frames = "@0-5") {
  return "vdo:" + real_data("kitti_03_demo").string() + frames;
}

TEST(CheckRealSource, TheDemoPasses) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  expect_clean(check_source(clean_source(demo()), {.jobs = 2, .quiet = true}));
  expect_clean(check_source(*open_with(demo("")), {.jobs = 2, .quiet = true}));
}

std::vector<Seed> real_seeds() {
  // Returns the depth that results if the files contain n instead of disparity * 256; the reader computes bf
  // / (n / 256).
  const auto stored = [](double (*n)(double z, double bf)) {
    return depth([n](I i, double z, int, int) { return i.camera.bf * 256 / std::round(n(z, i.camera.bf)); });
  };
  std::vector<Seed> all = {
      {"DepthInCentimetres", "depth looks like centimetres",
       stored([](double z, double) { return 100 * z; })},
      {"DepthInMillimetres", "depth looks like millimetres",
       stored([](double z, double) { return 1000 * z; })},
      {"DepthTimes256", "depth looks like depth * 256", stored([](double z, double) { return 256 * z; })},
      {"DisparityWithoutFactor", "depth looks like disparity in whole px",
       stored([](double z, double bf) { return bf / z; })},
      {"DepthScale", "depth is too large by a factor 1.",
       depth([](I, double z, int, int) { return 1.1 * z; })},
      {"MaskIdsWithoutPlusOne", "mask ids are off by one", mask([](int id) { return id - 1; })},
  };
  const std::set<std::string> as_in_exact_sources = {
      "FlowNegated",    "FlowBackward",        "FlowSwapped", "FlowDouble",       "PosesInverted",
      "YawOffByHalfPi", "YawOffByMinusHalfPi", "YawOffByPi",  "ObjectsInTheWorld"};
  std::ranges::copy_if(seeds(), std::back_inserter(all),
                       [&](const Seed& seed) { return as_in_exact_sources.contains(seed.name); });
  EXPECT_EQ(all.size(), 6 + as_in_exact_sources.size());
  return all;
}

TEST(CheckRealSource, EachSeededMistakeInTheDemoFailsAndIsNamed) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  for (const Seed& seed : real_seeds()) {
    SCOPED_TRACE(seed.name);
    LoadedSequence sequence(clean_source(demo()));
    seed.mistake(sequence);
    expect_caught(sequence, seed.cause);
  }
}

// The baseline of another camera pair: the first reported cause is the factor, not a similar one.
TEST(CheckRealSource, AWrongBaselineIsToldAsAFactorOnDepth) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  for (const char* frames : {"@0-5", "@6-12", "@0-19"}) {
    SCOPED_TRACE(frames);
    const auto checks =
        check_source(*open_with(demo(frames), {{"bf", 387.5744 * 1.1}}), {.jobs = 2, .quiet = true});
    const auto line = std::ranges::find(checks, "depth scale", &SourceCheck::name);
    EXPECT_NE(line->outcome, CheckOutcome::pass) << report(checks);
    EXPECT_THAT(line->cause, testing::StartsWith("depth is too large by a factor 1.")) << report(checks);
  }
}

TEST(CheckRealSource, TartanairAgreesToSixHundredthsOfAPixel) {
  SEXTANT_NEEDS_DATA("tartanair2_abs_P000");
  const auto checks = check_source(*open_with("tartanair:" + real_data("tartanair2_abs_P000").string()),
                                   {.jobs = 2, .quiet = true});
  for (const SourceCheck& c : checks) EXPECT_NE(c.outcome, CheckOutcome::fail) << report(checks);
  const auto flow = std::ranges::find(checks, "static flow", &SourceCheck::name);
  ASSERT_TRUE(flow->value) << report(checks);
  EXPECT_LT(*flow->value, 0.06) << report(checks);
  EXPECT_EQ(flow->outcome, CheckOutcome::pass) << report(checks);
}

// ---- pairs of KITTI scene flow in the form of tracking frames: stereo depth, flow of DIS, and a camera that
// moves by 0.3 m (0000) or 0.8 m (0001), with true steps accurate to 0.03 m

struct TrackingPair {
  const char* pair;
  const char* sequence;
  int first_frame;
};
constexpr TrackingPair tracking_pairs[] = {{"000002", "0000", 10}, {"000007", "0001", 354}};

/// Writes the pair below `root`; returns the SOURCE.
std::string lay_out(const TrackingPair& pair, const fs::path& root) {
  const fs::path training = root / "training", from = real_data("kitti_tracking") / "training";
  for (const char* part : {"calib", "oxts", "label_02", "instances_txt"}) {
    // MOTS has no masks of the vans and the cyclist in 0000.
    if (std::string_view(part) == "instances_txt" && std::string_view(pair.sequence) == "0000") continue;
    fs::create_directories(training / part);
    const std::string name = std::string(pair.sequence) + ".txt";
    write_file(training / part / name, read_file(from / part / name));
  }
  for (const char* side : {"2", "3"}) {
    const fs::path folder = training / (std::string("image_0") + side) / pair.sequence;
    fs::create_directories(folder);
    for (const int k : {0, 1}) {
      write_file(folder / fmt::format("{:06}.png", pair.first_frame + k),
                 read_file(real_data("kitti_sceneflow_2015") / (std::string("image_") + side) /
                           fmt::format("{}_1{}.png", pair.pair, k)));
    }
  }
  return fmt::format("kitti:{}#{}@{}-{}", root.string(), pair.sequence, pair.first_frame,
                     pair.first_frame + 1);
}

TEST(CheckRealSource, PairsOfSceneFlowPassAsTrackingFrames) {
  SEXTANT_NEEDS_DATA("kitti_sceneflow_2015");
  SEXTANT_NEEDS_DATA("kitti_tracking");
  const std::vector<Seed> large = {
      {"DepthDouble", "depth is too large by a factor", depth([](I, double z, int, int) { return 2 * z; })},
      {"DepthHalf", "depth is too large by a factor 0", depth([](I, double z, int, int) { return z / 2; })},
      {"BaselineTooLong", "depth is too large by a factor",
       depth([](I, double z, int, int) { return 1.5 * z; })},
      {"BaselineTooShort", "depth is too large by a factor 0",
       depth([](I, double z, int, int) { return z / 1.5; })},
  };
  for (const TrackingPair& pair : tracking_pairs) {
    SCOPED_TRACE(pair.pair);
    const TempFolder folder;
    const LoadedSequence clean(lay_out(pair, folder.path()));
    expect_clean(check_source(clean, {.jobs = 2, .quiet = true}));
    for (const Seed& seed : large) {
      SCOPED_TRACE(seed.name);
      LoadedSequence sequence(clean);
      seed.mistake(sequence);
      expect_caught(sequence, seed.cause);
    }
  }
}

// The mistakes above that two frames can reveal: no shifts by a frame, no yaw of cars that drive straight on.
// Two frames do not distinguish all causes, so the test requires only that a check fails.
TEST(CheckRealSource, PlantedMistakesFailOnAPairOfSceneFlow) {
  SEXTANT_NEEDS_DATA("kitti_sceneflow_2015");
  SEXTANT_NEEDS_DATA("kitti_tracking");
  const std::set<std::string> of_several_frames = {
      "FlowToPrevious",         "FlowOfNextPair",   "DepthOfNextFrame", "PosesOfNextFrame",
      "PosesMissingAsIdentity", "MasksOfNextFrame", "YawNegated"};
  const std::set<std::string> within_the_noise = {"DepthIsRange", "DepthScale", "PosesScaled"};
  const TempFolder folder;
  const LoadedSequence clean(lay_out(tracking_pairs[1], folder.path()));
  int n_planted = 0;
  for (const Seed& seed : seeds()) {
    if (of_several_frames.contains(seed.name) || within_the_noise.contains(seed.name)) continue;
    SCOPED_TRACE(seed.name);
    LoadedSequence sequence(clean);
    seed.mistake(sequence);
    const auto checks = check_source(sequence, {.jobs = 2, .quiet = true});
    EXPECT_TRUE(std::ranges::any_of(checks, [](const SourceCheck& c) {
      return c.outcome == CheckOutcome::fail;
    })) << report(checks);
    ++n_planted;
  }
  EXPECT_GE(n_planted, 20);
}

}  // namespace
}  // namespace sextant
