// Correct data of unusual scenes, which contradict what the checks assume about a typical drive, do not fail.

#include <algorithm>

#include "sextant/eval/check/check_source.h"
#include "sextant/eval/check/planted_mistakes_testing.h"

namespace sextant {
namespace {

using namespace planted;

std::vector<SourceCheck> quiet_checks(const Sequence& sequence) {
  return check_source(sequence, {.jobs = 2, .quiet = true});
}

SourceCheck named(const std::vector<SourceCheck>& checks, const std::string& name) {
  const auto line = std::ranges::find(checks, name, &SourceCheck::name);
  return line == checks.end() ? SourceCheck{} : *line;
}

/// Removes the sizes of all objects, and moves their origins along their own axes by as much as in long
/// vehicles, of which the camera sees the end.
LoadedSequence long_vehicles_without_sizes() {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  object([](ObjectTruth& o, const SE3&) {
    o.size_m.reset();
    o.T_camera_object = o.T_camera_object * SE3(Eigen::Quaterniond::Identity(), {0, 0, 10});
  })(sequence);
  return sequence;
}

TEST(RightData, ObjectsOfUnknownSizeAreSuspectAtMost) {
  const auto checks = quiet_checks(long_vehicles_without_sizes());
  const SourceCheck depth = named(checks, "object depth");
  EXPECT_EQ(depth.outcome, CheckOutcome::suspect) << report(checks);
  EXPECT_EQ(depth.cause, "");
  EXPECT_THAT(depth.message, HasSubstr("a typical car of 1.7 x 1.5 x 4.2 m is assumed: other objects"));
  EXPECT_EQ(named(checks, "object flow").outcome, CheckOutcome::pass);
  for (const SourceCheck& c : checks) EXPECT_NE(c.outcome, CheckOutcome::fail) << report(checks);
}

TEST(RightData, MistakesOfObjectsOfUnknownSizeAreNamedByOtherChecks) {
  LoadedSequence sequence = copy_of("synthetic:s01-turn@0-4");
  object([](ObjectTruth& o, const SE3& T) {
    o.size_m.reset();
    o.T_camera_object = T * o.T_camera_object;
  })(sequence);
  expect_caught(sequence, "world frame");
}

/// Keeps one moving object, and turns its heading by `yaw_rad`.
LoadedSequence single_object(double yaw_rad) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  int kept = 0;
  for (auto& [frame, list] : sequence.truth_.objects) {
    for (const ObjectTruth& o : list) {
      if (kept == 0 && o.moving.value_or(false)) kept = o.id;
    }
    std::erase_if(list, [&](const ObjectTruth& o) { return o.id != kept; });
  }
  yaw([=](double a) { return a + yaw_rad; })(sequence);
  return sequence;
}

TEST(RightData, ASingleObjectMayDriveBackwardsOrSlide) {
  EXPECT_EQ(named(quiet_checks(single_object(0)), "heading").outcome, CheckOutcome::pass);
  for (const double yaw_rad : {pi, pi / 2}) {
    const auto checks = quiet_checks(single_object(yaw_rad));
    const SourceCheck heading = named(checks, "heading");
    EXPECT_EQ(heading.outcome, CheckOutcome::suspect) << report(checks);
    EXPECT_THAT(heading.cause, HasSubstr("yaw is off by pi"));
    EXPECT_THAT(heading.message, HasSubstr("alone contradicts its way: right if it drives backwards, or"));
  }
}

/// Rolls the camera by 180 degrees, so that the ground is at the top of the images, and removes depth beyond
/// 12 m from their middle.
LoadedSequence upside_down() {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  const auto turn = [](auto& image) { std::reverse(image.data(), image.data() + image.size()); };
  for (Frame& frame : sequence.frames_) {
    turn(frame.gray);
    turn(frame.depth_m);
    turn(frame.mask);
    turn(frame.flow);
  }
  depth([](I i, double z, int, int y) {
    return z > 12 && y > 0.3 * i.height && y < 0.7 * i.height ? NAN : z;
  })(sequence);
  flow([](I, Flow f) { return Flow{-f.u, -f.v}; })(sequence);
  PinholeCamera& camera = sequence.info_.camera.left;
  camera.cx = sequence.info_.width - 1 - camera.cx;
  camera.cy = sequence.info_.height - 1 - camera.cy;
  pose([](const SE3& T) {
    const Eigen::Quaterniond half(Eigen::AngleAxisd(pi, Eigen::Vector3d::UnitZ()));
    return T * SE3(half, Eigen::Vector3d::Zero());
  })(sequence);
  sequence.truth_.objects.clear();
  return sequence;
}

TEST(RightData, DepthMayGrowTowardsTheBottomIfItAgreesWithFlowAndPoses) {
  LoadedSequence sequence = upside_down();
  const SourceCheck right = named(quiet_checks(sequence), "depth order");
  EXPECT_EQ(right.outcome, CheckOutcome::suspect);
  EXPECT_EQ(right.cause, "");
  EXPECT_THAT(right.message, HasSubstr("agrees with flow and true poses"));
  sequence.truth_.camera = {};
  EXPECT_EQ(named(quiet_checks(sequence), "depth order").outcome, CheckOutcome::fail);
}

}  // namespace
}  // namespace sextant
