#include "sextant/datasets/vdo_layout.h"

#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"

namespace sextant {
namespace {

class VdoLayoutTest : public testing::Test {
 protected:
  VdoLayoutTest() {
    make_vdo_fixture(folder_.path() / "a", {.n_frames = 3, .first_frame = 7, .width = 64, .height = 32});
  }

  std::unique_ptr<Sequence> open(const std::string& name) const {
    return open_source(SourceSpec::parse("vdo:" + (folder_.path() / name).string()));
  }
  std::string write(const Sequence& sequence, const std::string& name, int jobs = 1) const {
    LayoutRequest request{.out = folder_.path() / name, .jobs = jobs, .quiet = true};
    return find_layout("vdo").write(sequence, request);
  }

  TempFolder folder_;
};

TEST_F(VdoLayoutTest, EverythingComesBack) {
  const auto before = open("a");
  const std::string source = write(*before, "b", 2);
  const auto after = open_source(SourceSpec::parse(source));
  EXPECT_EQ(after->info().first_frame, 7);
  EXPECT_EQ(after->info().last_frame, 9);
  EXPECT_EQ(after->info().camera.bf, before->info().camera.bf);
  EXPECT_EQ(after->info().camera.left.fx, before->info().camera.left.fx);
  EXPECT_EQ(after->info().rate_hz, before->info().rate_hz);
  for (int frame = 7; frame <= 9; ++frame) {
    const Channels channels{.rgb = true, .depth = true, .flow = true, .mask = true};
    const Frame a = before->read(frame, channels), b = after->read(frame, channels);
    EXPECT_EQ(a.rgb, b.rgb);
    EXPECT_EQ(a.mask, b.mask);
    ASSERT_EQ(a.flow.size(), b.flow.size());
    for (size_t i = 0; i < a.flow.size(); ++i) EXPECT_EQ(a.flow.data()[i].u, b.flow.data()[i].u);
    for (size_t i = 0; i < a.depth_m.size(); ++i) {
      const float z = a.depth_m.data()[i];
      if (std::isfinite(z)) {
        EXPECT_EQ(z, b.depth_m.data()[i]);
      }
    }
    const auto pose = after->truth().camera.pose(frame);
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->inverse() * *before->truth().camera.pose(frame)).log().norm(), 1e-12);
    const ObjectTruth* object = after->truth().find(frame, 1);
    ASSERT_NE(object, nullptr);
    EXPECT_LT(
        (object->T_camera_object.inverse() * before->truth().find(frame, 1)->T_camera_object).log().norm(),
        1e-9);
    EXPECT_EQ(object->box, before->truth().find(frame, 1)->box);
  }
}

TEST_F(VdoLayoutTest, TimesAreThoseOfTheRate) {
  write(*open("a"), "b");
  EXPECT_TRUE(open("b")->info().warnings.empty()) << open("b")->info().warnings.front();
  EXPECT_NEAR(open("b")->info().times_s.at(8), 0.8, 1e-12);
}

TEST_F(VdoLayoutTest, NothingIsOverwritten) {
  write(*open("a"), "b");
  expect_error([&] { write(*open("a"), "b"); }, "is there already");
}

}  // namespace
}  // namespace sextant
