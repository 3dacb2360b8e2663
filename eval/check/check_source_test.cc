// Correct sources pass every convention check; each planted mistake fails a check, and is named as its cause.

#include "sextant/eval/check/check_source.h"

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/kitti_testing.h"
#include "sextant/eval/check/check_report.h"
#include "sextant/eval/check/planted_mistakes_testing.h"

namespace sextant {
namespace {

using namespace planted;

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

TEST(CheckSource, FramesThatContradictTheOthersAreNamed) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  Image<Flow>& flow = sequence.frames_[1].flow;
  Image<float>& depth_m = sequence.frames_[3].depth_m;
  for (const auto [i, j] : pixels(flow)) flow(i, j) = {-flow(i, j).u, -flow(i, j).v};
  for (const auto [i, j] : pixels(depth_m)) depth_m(i, j) /= 2;
  const std::vector<SourceCheck> checks = check_source(sequence, {.jobs = 2, .quiet = true});
  const auto line = std::ranges::find(checks, "static flow", &SourceCheck::name);
  EXPECT_EQ(line->outcome, CheckOutcome::fail);
  EXPECT_EQ(line->cause, "only some frames are wrong");
  EXPECT_THAT(line->message, HasSubstr("in 2 of 5 pairs, of frames 1, 3;"));
}

TEST(CheckSource, WholeDisparitiesAreSuspect) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  depth([](I i, double z, int, int) { return i.camera.bf / std::max(1.0, std::floor(i.camera.bf / z)); })(
      sequence);
  const auto checks = check_source(sequence, {.jobs = 2, .quiet = true});
  const auto line = std::ranges::find(checks, "depth", &SourceCheck::name);
  EXPECT_EQ(line->outcome, CheckOutcome::suspect);
  EXPECT_EQ(line->cause, "disparities are whole pixels: sub-pixel part lost");
}

TEST(CheckSource, FramesWithoutValidPixelsAreNamed) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  const auto line_of = [&](const char* name) {
    const auto checks = check_source(sequence, {.jobs = 2, .quiet = true});
    return *std::ranges::find(checks, name, &SourceCheck::name);
  };
  const auto clear = [](Image<float>& depth_m) { std::fill_n(depth_m.data(), depth_m.size(), NAN); };
  clear(sequence.frames_[1].depth_m);
  const SourceCheck one = line_of("depth");
  EXPECT_EQ(one.outcome, CheckOutcome::suspect);
  EXPECT_EQ(one.message, "frames without a valid pixel: 1");
  for (Frame& frame : sequence.frames_) clear(frame.depth_m);
  EXPECT_EQ(line_of("depth").outcome, CheckOutcome::fail);
  sequence.info_.last_frame = sequence.info_.first_frame;
  EXPECT_THAT(line_of("files").message, HasSubstr("a run needs two"));
  EXPECT_EQ(line_of("files").outcome, CheckOutcome::fail);
}

TEST(CheckSource, ImagesOfAnotherSequenceContradictTheFlow) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  const LoadedSequence& other = clean_source("synthetic:s01-turn@0-4");
  for (size_t i = 0; i < sequence.frames_.size(); ++i) sequence.frames_[i].gray = other.frames_[i].gray;
  const auto checks = check_source(sequence, {.jobs = 2, .quiet = true});
  const auto line = std::ranges::find(checks, "image flow", &SourceCheck::name);
  EXPECT_EQ(line->outcome, CheckOutcome::fail) << report(checks);
  EXPECT_THAT(line->message, HasSubstr("of another sequence"));
  EXPECT_THAT(failures("S", checks), ElementsAre(HasSubstr("(failed: image flow)")));
  EXPECT_THAT(failures("S", {}), IsEmpty());
}

TEST(CheckSource, AStationaryCameraIsNotCheckable) {
  const std::vector<SourceCheck> checks =
      check_source(copy_of("synthetic:s01-crossing@0-3"), {.quiet = true});
  for (const char* name : {"static flow", "depth scale", "camera path"}) {
    const auto line = std::ranges::find(checks, name, &SourceCheck::name);
    ASSERT_NE(line, checks.end());
    EXPECT_EQ(line->outcome, CheckOutcome::note);
    EXPECT_THAT(line->message, HasSubstr("not checkable"));
  }
}

TEST(CheckSource, ChecksSourcesWithTruthOnly) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  sequence.info_.channels = {};
  expect_clean(check_source(sequence, {.quiet = true}));
  sequence.truth_.objects.clear();
  sequence.truth_.camera = {};
  expect_clean(check_source(sequence, {.quiet = true}));
}

TEST(CheckSource, PositionsThatContradictTheSpeedFail) {
  const TempFolder folder;
  const fs::path training = folder.path() / "training";
  for (const char* kind : {"calib", "oxts"}) fs::create_directories(training / kind);
  write_file(training / "calib/0003.txt", calibration_of_car(700, 620, 180, 350));
  std::vector<KittiOxts> samples = straight_drive({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  const auto failed = [&] {
    write_file(training / "oxts/0003.txt", encode_kitti_oxts(samples));
    const auto sequence = open_source(SourceSpec::parse("kitti:" + folder.path().string() + "#0003"));
    return failures("S", check_source(*sequence, {.quiet = true, .quick = true}));
  };
  EXPECT_THAT(failed(), IsEmpty());
  samples.erase(samples.begin() + 6);
  EXPECT_THAT(failed(), ElementsAre(HasSubstr("oxts/0003.txt:7: the position moves by 2.000 m")));
  for (KittiOxts& sample : samples) sample.longitude_deg = 0;
  EXPECT_THAT(failed(), ElementsAre(HasSubstr("oxts/0003.txt: the positions do not change")));
}

// A median hides that depth is of another rendering, which is right at most pixels.
TEST(CheckSource, GroundTruthOfFlowAndDepthMustAgreeAtAlmostEveryPixel) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  ASSERT_TRUE(sequence.info_.exact.depth && sequence.info_.exact.flow);
  const auto static_flow = [&] {
    const auto checks = check_source(sequence, {.jobs = 2, .quiet = true});
    return *std::ranges::find(checks, "static flow", &SourceCheck::name);
  };
  depth([](I i, double z, int x, int) { return x < 0.3 * i.width ? 1.15 * z : z; })(sequence);
  const SourceCheck third = static_flow();
  EXPECT_EQ(third.outcome, CheckOutcome::suspect);
  EXPECT_THAT(third.cause, HasSubstr("of another variation of the scene, or of another camera"));
  EXPECT_THAT(third.message, HasSubstr("differ by more than 0.25 px"));
  EXPECT_LT(third.value.value(), third.limit.value());
  sequence.info_.exact = {};
  EXPECT_EQ(static_flow().outcome, CheckOutcome::pass);
}

TEST(CheckSource, JumpsAreSuspectAndExchangedIdsAreNamed) {
  const LoadedSequence right = copy_of("synthetic:s18@0-5");
  const auto jumps = [&](const auto& change) {
    LoadedSequence sequence = right;
    sequence.info_.channels = {};
    change(sequence.truth_);
    const auto checks = check_source(sequence, {.quiet = true});
    return *std::ranges::find(checks, "jumps", &SourceCheck::name);
  };
  EXPECT_EQ(jumps([](SequenceTruth&) {}).outcome, CheckOutcome::pass);
  const SourceCheck exchanged = jumps([](SequenceTruth& truth) {
    for (auto& [frame, objects] : truth.objects) {
      for (ObjectTruth& object : objects) {
        if (frame >= 3 && object.id <= 2) object.id = 3 - object.id;
      }
      std::ranges::sort(objects, {}, &ObjectTruth::id);
    }
  });
  EXPECT_EQ(exchanged.outcome, CheckOutcome::suspect);
  EXPECT_THAT(exchanged.cause, HasSubstr("takes the place of object"));
  EXPECT_THAT(exchanged.cause, HasSubstr("at frame 3: are ids exchanged there?"));
  const SourceCheck camera = jumps([](SequenceTruth& truth) {
    Trajectory moved;
    for (const auto& [frame, pose] : truth.camera.poses())
      moved.set(frame,
                frame < 3 ? pose : SE3(pose.rotation(), pose.translation() + Eigen::Vector3d(0, 0, 8)));
    truth.camera = moved;
  });
  EXPECT_EQ(camera.outcome, CheckOutcome::suspect);
  EXPECT_THAT(camera.message, HasSubstr("the camera jumps at frame 3"));
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
  const SourceCheck decreasing = times({{0, 0.0}, {1, 0.2}, {2, 0.1}, {3, 0.3}});
  EXPECT_EQ(decreasing.outcome, CheckOutcome::fail);
  EXPECT_EQ(decreasing.cause, "time stamps do not increase");
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

}  // namespace
}  // namespace sextant
