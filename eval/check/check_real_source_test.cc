// Sources of real data pass the convention checks; each planted mistake fails a check.

#include <set>

#include "sextant/eval/check/check_source.h"
#include "sextant/eval/check/planted_mistakes_testing.h"

namespace sextant {
namespace {

using namespace planted;

// ---- the real demo: flow of a network, noisy depth, jittering poses

std::string demo(const char* frames = "@0-5") {
  return "vdo:" + real_data("kitti_03_demo").string() + frames;
}

TEST(CheckRealSource, TheDemoPasses) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  expect_clean(check_source(clean_source(demo()), {.jobs = 2, .quiet = true}));
  expect_clean(check_source(*open_with(demo("")), {.jobs = 2, .quiet = true}));
}

/// A wrong yaw of a single moving object is SUSPECT at most, because a car can drive backwards.
CheckOutcome least_outcome(const Seed& seed) {
  return std::string_view(seed.name).starts_with("YawOff") ? CheckOutcome::suspect : CheckOutcome::fail;
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
    expect_caught(sequence, seed.cause, least_outcome(seed));
  }
}

// The baseline of another camera pair: the first reported cause is the factor, not a similar one.
TEST(CheckRealSource, AWrongBaselineIsReportedAsAFactorOnDepth) {
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

// Static points determine only the ratio of depth and camera steps. The sizes of the demo's cars are unknown,
// so the depth of their boxes does not decide which of the two is wrong.
TEST(CheckRealSource, ASmallFactorOnDisparityNamesDepthAndCameraPositions) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  LoadedSequence sequence(demo("@0-3"));
  depth([](I, double z, int, int) { return z / 1.1; })(sequence);
  const auto checks = check_source(sequence, {.jobs = 2, .quiet = true});
  const auto line = std::ranges::find(checks, "depth scale", &SourceCheck::name);
  EXPECT_EQ(line->outcome, CheckOutcome::fail) << report(checks);
  EXPECT_THAT(line->cause, HasSubstr("depth is too small by a factor 1.")) << report(checks);
  EXPECT_THAT(line->cause, HasSubstr("camera positions are too large by a factor 1.")) << report(checks);
}

// The masks of some distant cars cover their boxes badly, but have the right ids.
TEST(CheckRealSource, BadlyCoveredBoxesAreNotReportedAsRenumberedMasks) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  for (const char* frames : {"@0-1", "@1-2", "@10-13"}) {
    SCOPED_TRACE(frames);
    const auto checks = check_source(*open_with(demo(frames)), {.jobs = 2, .quiet = true});
    EXPECT_EQ(std::ranges::find(checks, "mask ids", &SourceCheck::name)->outcome, CheckOutcome::pass);
    const auto line = std::ranges::find(checks, "mask boxes", &SourceCheck::name);
    EXPECT_EQ(line->outcome, CheckOutcome::suspect) << report(checks);
    EXPECT_EQ(line->cause, no_known_cause) << report(checks);
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
      {"DepthHalf", "depth is too small by a factor", depth([](I, double z, int, int) { return z / 2; })},
      {"BaselineTooLong", "depth is too large by a factor",
       depth([](I, double z, int, int) { return 1.5 * z; })},
      {"BaselineTooShort", "depth is too small by a factor",
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
  // Straight motion looks nearly alike in mirrored images, which are SUSPECT, and in a mirrored world.
  const std::set<std::string> within_the_noise = {
      "DepthIsRange",        "DepthScale",     "PosesScaled",    "DepthSlightlyTooSmall",
      "PosesSlightlyScaled", "ImagesMirrored", "PosesLeftHanded"};
  const TempFolder folder;
  const LoadedSequence clean(lay_out(tracking_pairs[1], folder.path()));
  int n_planted = 0;
  for (const Seed& seed : seeds()) {
    if (of_several_frames.contains(seed.name) || within_the_noise.contains(seed.name)) continue;
    SCOPED_TRACE(seed.name);
    LoadedSequence sequence(clean);
    seed.mistake(sequence);
    const auto checks = check_source(sequence, {.jobs = 2, .quiet = true});
    EXPECT_TRUE(std::ranges::any_of(checks, [&](const SourceCheck& c) {
      return c.outcome == CheckOutcome::fail || c.outcome == least_outcome(seed);
    })) << report(checks);
    ++n_planted;
  }
  EXPECT_GE(n_planted, 20);
}

}  // namespace
}  // namespace sextant
