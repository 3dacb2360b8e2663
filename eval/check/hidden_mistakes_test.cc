// Mistakes of single objects, frames or flags, which medians over all data hide; right data of few samples.

#include <algorithm>

#include "sextant/eval/check/check_source.h"
#include "sextant/eval/check/planted_mistakes_testing.h"

namespace sextant {
namespace {

using namespace planted;

std::vector<SourceCheck> checks_of(const Sequence& sequence) {
  return check_source(sequence, {.jobs = 2, .quiet = true});
}

SourceCheck line_of(const std::vector<SourceCheck>& checks, const std::string& name) {
  const auto line = std::ranges::find(checks, name, &SourceCheck::name);
  return line == checks.end() ? SourceCheck{} : *line;
}

/// Changes the true object `id` in each frame.
template <typename Change>
void change_object(LoadedSequence& sequence, int id, const Change& change) {
  for (auto& [frame, list] : sequence.truth_.objects) {
    for (ObjectTruth& object : list) {
      if (object.id == id) change(object, frame);
    }
  }
}

/// Returns the ids of objects with a mask and a pose in every frame.
std::vector<int> ids_in_all_frames(const LoadedSequence& sequence) {
  std::vector<int> ids;
  for (const ObjectTruth& object : sequence.truth_.objects.begin()->second) {
    const bool always = std::ranges::all_of(sequence.frames_, [&](const Frame& frame) {
      return mask_outlines(frame.mask).contains(object.id) && sequence.truth_.find(frame.index, object.id);
    });
    if (always) ids.push_back(object.id);
  }
  return ids;
}

TEST(HiddenMistakes, MaskIdsThatAreExchangedInSomeFramesAreNamed) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  const std::vector<int> ids = ids_in_all_frames(sequence);
  ASSERT_GE(ids.size(), 2U);
  const int a = ids[0], b = ids[1];
  for (size_t k = 4; k < sequence.frames_.size(); ++k) {
    Image<uint16_t>& mask = sequence.frames_[k].mask;
    for (size_t i = 0; i < mask.size(); ++i) {
      uint16_t& id = mask.data()[i];
      if (id == a || id == b) id = static_cast<uint16_t>(a + b - id);
    }
  }
  const std::vector<SourceCheck> checks = checks_of(sequence);
  const SourceCheck line = line_of(checks, "mask ids");
  EXPECT_EQ(line.outcome, CheckOutcome::fail) << report(checks);
  EXPECT_EQ(line.cause,
            fmt::format("ids {} and {} are exchanged between masks and truth from frame 4 on", a, b));
}

TEST(HiddenMistakes, TheWrongPosesOfASingleObjectAreNamed) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  const int id = ids_in_all_frames(sequence).at(0);
  change_object(sequence, id, [&](ObjectTruth& object, int frame) {
    object.T_camera_object = *sequence.truth_.camera.pose(frame) * object.T_camera_object;
  });
  const std::vector<SourceCheck> checks = checks_of(sequence);
  bool named = false;
  for (const SourceCheck& c : checks) {
    if (c.cause != "only some objects are wrong") continue;
    named = true;
    EXPECT_EQ(c.outcome, CheckOutcome::fail);
    EXPECT_THAT(c.message, HasSubstr(fmt::format("objects, of ids {};", id)));
  }
  EXPECT_TRUE(named) << report(checks);
}

TEST(HiddenMistakes, TheWrongDepthOfASingleNearObjectIsNamed) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  sequence.info_.channels.flow = false;
  const int id = ids_in_all_frames(sequence).at(0);
  change_object(sequence, id, [&](ObjectTruth& object, int) {
    object.T_camera_object =
        SE3(object.T_camera_object.rotation(), 1.6 * object.T_camera_object.translation());
  });
  const std::vector<SourceCheck> checks = checks_of(sequence);
  const SourceCheck line = line_of(checks, "object depth");
  EXPECT_EQ(line.outcome, CheckOutcome::fail) << report(checks);
  EXPECT_EQ(line.cause, "only some objects are wrong");
  EXPECT_THAT(line.message, HasSubstr(fmt::format("objects, of ids {};", id)));
}

TEST(HiddenMistakes, ObjectPosesThatDoNotChangeAreCounted) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  const int id = ids_in_all_frames(sequence).at(0);
  const SE3 first = sequence.truth_.find(0, id)->T_camera_object;
  change_object(sequence, id, [&](ObjectTruth& object, int) { object.T_camera_object = first; });
  const SourceCheck line = line_of(checks_of(sequence), "repeated poses");
  EXPECT_EQ(line.outcome, CheckOutcome::fail);
  EXPECT_EQ(line.value, 5);
  EXPECT_THAT(line.message, HasSubstr("5 object poses equal the ones before"));
}

TEST(HiddenMistakes, FlagsOfMotionThatContradictThePosesFail) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  EXPECT_EQ(line_of(checks_of(sequence), "moving flags").outcome, CheckOutcome::pass);
  for (auto& [frame, list] : sequence.truth_.objects) {
    for (ObjectTruth& object : list) object.moving = !object.moving.value();
  }
  const SourceCheck line = line_of(checks_of(sequence), "moving flags");
  EXPECT_EQ(line.outcome, CheckOutcome::fail);
  EXPECT_THAT(line.cause, HasSubstr("flags of moving and of resting objects"));
}

TEST(HiddenMistakes, RepeatedImagesFail) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  for (Frame& frame : sequence.frames_) frame.gray = sequence.frames_[0].gray;
  const SourceCheck frozen = line_of(checks_of(sequence), "gray");
  EXPECT_EQ(frozen.outcome, CheckOutcome::fail);
  EXPECT_THAT(frozen.cause, HasSubstr("images are repeated"));
  EXPECT_THAT(frozen.message, HasSubstr("frames 1, 2, 3 equal the ones before"));
}

TEST(HiddenMistakes, UniformImagesFail) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-3");
  Image<uint8_t>& gray = sequence.frames_[2].gray;
  std::fill_n(gray.data(), gray.size(), uint8_t{0});
  const SourceCheck black = line_of(checks_of(sequence), "gray");
  EXPECT_EQ(black.outcome, CheckOutcome::fail);
  EXPECT_THAT(black.message, HasSubstr("all pixels have the same value in frames 2"));
}

TEST(HiddenMistakes, FlowOfZeroInPlaceOfMissingEstimatesIsSuspect) {
  for (const bool with_poses : {true, false}) {
    LoadedSequence sequence = copy_of("synthetic:s18@0-3");
    if (!with_poses) sequence.truth_.camera = {};
    EXPECT_EQ(line_of(checks_of(sequence), "flow").outcome, CheckOutcome::pass);
    for (Frame& frame : sequence.frames_) {
      for (const auto [x, y] : pixels(frame.flow)) {
        if (x * 10 < 3 * frame.flow.width()) frame.flow(x, y) = {0, 0};
      }
    }
    const SourceCheck line = line_of(checks_of(sequence), "flow");
    EXPECT_EQ(line.outcome, CheckOutcome::suspect);
    EXPECT_THAT(line.cause, HasSubstr("exactly (0, 0) where the background moves"));
  }
  // The flow of the background is 0 if the camera stands still.
  LoadedSequence still = copy_of("synthetic:s01-crossing@0-3");
  flow([](I, Flow f) { return std::hypot(f.u, f.v) < 0.01 ? Flow{0, 0} : f; })(still);
  EXPECT_EQ(line_of(checks_of(still), "flow").outcome, CheckOutcome::pass);
}

TEST(HiddenMistakes, PosesThatAreMissingWithinATrackAreCounted) {
  LoadedSequence sequence = copy_of("synthetic:s18@0-5");
  const int id = ids_in_all_frames(sequence).at(0);
  EXPECT_THAT(line_of(checks_of(sequence), "objects").message, testing::Not(HasSubstr("missing")));
  std::erase_if(sequence.truth_.objects.at(2), [&](const ObjectTruth& o) { return o.id == id; });
  EXPECT_THAT(line_of(checks_of(sequence), "objects").message,
              HasSubstr("1 pose is missing within the tracks"));
}

/// A camera that stands still repeats its images rightly.
TEST(HiddenMistakes, RepeatedImagesOfAStationaryCameraPass) {
  LoadedSequence sequence = copy_of("synthetic:s01-crossing@0-3");
  for (Frame& frame : sequence.frames_) frame.gray = sequence.frames_[0].gray;
  EXPECT_EQ(line_of(checks_of(sequence), "gray").outcome, CheckOutcome::pass);
}

/// A source with a damaged right image in one frame.
class DamagedRightImage final : public MemorySequence {
 public:
  DamagedRightImage() : whole_(open_source(SourceSpec::parse("synthetic:s18@0-2"))) {
    info_ = whole_->info();
    truth_ = whole_->truth();
  }
  Frame read(int frame, Channels channels) const override {
    if (channels.rgb_right && frame == 1) throw Error("right/000001.png: damaged");
    return whole_->read(frame, channels);
  }

 private:
  std::unique_ptr<Sequence> whole_;
};

TEST(HiddenMistakes, RightImagesAndBackwardFlowAreDecoded) {
  const DamagedRightImage sequence;
  ASSERT_TRUE(sequence.info().channels.rgb_right && sequence.info().channels.backward_flow);
  const std::vector<SourceCheck> checks = checks_of(sequence);
  const SourceCheck right = line_of(checks, "right image");
  EXPECT_EQ(right.outcome, CheckOutcome::fail);
  EXPECT_EQ(right.message, "right/000001.png: damaged");
  const SourceCheck backward = line_of(checks, "backward flow");
  EXPECT_EQ(backward.outcome, CheckOutcome::pass) << report(checks);
  EXPECT_EQ(backward.n_present, 2);
  EXPECT_EQ(backward.n_expected, 2);
  EXPECT_EQ(line_of(checks, "gray").outcome, CheckOutcome::pass);
  EXPECT_EQ(line_of(check_source(sequence, {.quiet = true, .quick = true}), "right image").name, "");
}

/// A small difference of few boxes is no evidence of a mistake whose correction happens to remove it.
TEST(HiddenMistakes, ASingleBoxIsNoEvidenceOfAShiftByOneFrame) {
  int n_different = 0;
  for (const int id : ids_in_all_frames(copy_of("synthetic:s18@0-3"))) {
    LoadedSequence sequence = copy_of("synthetic:s18@0-3");
    sequence.info_.channels = {.mask = true};
    for (auto& [frame, list] : sequence.truth_.objects) {
      for (ObjectTruth& object : list) object.box.reset();
    }
    const ImageBox next = mask_outlines(sequence.frames_[1].mask).at(id).box;
    change_object(sequence, id, [&](ObjectTruth& object, int frame) {
      if (frame == 0) object.box = next;
    });
    const std::vector<SourceCheck> checks = checks_of(sequence);
    const SourceCheck line = line_of(checks, "mask boxes");
    if (!line.value || *line.value > line.limit.value()) continue;
    n_different += *line.value > 0.1;
    EXPECT_EQ(line.n, 1);
    EXPECT_EQ(line.outcome, CheckOutcome::pass) << report(checks);
  }
  EXPECT_GT(n_different, 0);
}

}  // namespace
}  // namespace sextant
