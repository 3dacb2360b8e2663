#include "sextant/eval/check/check_source.h"

#include "sextant/datasets/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"

namespace sextant {
namespace {

// Frames 3 to 5 with errors of (frame, 0) px in flow and 1 px in disparity; true flow in all frames but 4,
// true depth in frame 3 only.
class Crooked final : public MemorySequence {
 public:
  Crooked() {
    info_.first_frame = 3;
    info_.last_frame = 5;
    info_.camera = {{100, 100, 2, 2}, 100};
    info_.channels = {.depth = true, .flow = true};
  }
  Frame read(int frame, Channels channels) const override {
    Frame out;
    if (channels.flow && frame != 5) out.flow = Image<Flow>(4, 4, Flow{10.0f + static_cast<float>(frame), 0});
    if (channels.depth) out.depth_m = Image<float>(4, 4, 100.0f / 21.0f);
    return out;
  }
  std::optional<Image<Flow>> true_flow(int frame) const override {
    if (frame == 4 && hide_) return std::nullopt;
    return Image<Flow>(4, 4, Flow{10, 0});
  }
  std::optional<Image<float>> true_depth(int frame) const override {
    if (frame != 3) return std::nullopt;
    return Image<float>(4, 4, 5.0f);
  }

  bool hide_ = true;
};

TEST(DenseTruth, IsMeasuredWhereThereIsTruth) {
  Crooked sequence;
  const DenseTruthErrors errors = dense_truth_errors(sequence, 2);
  EXPECT_EQ(errors.n_flow_frames, 1);
  EXPECT_DOUBLE_EQ(errors.flow.value().epe_px, 3);
  EXPECT_EQ(errors.n_depth_frames, 1);
  EXPECT_NEAR(errors.disparity.value().mean_px, 1, 1e-5);
  EXPECT_EQ(errors.flow_text(),
            "EPE 3 px (3 along x, 0 along y), outliers 0.00 %, "
            "over 16 pixels of 1 frame, 100.0 % of those with truth");
  sequence.hide_ = false;
  EXPECT_DOUBLE_EQ(dense_truth_errors(sequence, 1).flow.value().epe_px, 3.5);
  EXPECT_DOUBLE_EQ(dense_truth_errors(sequence, 1).flow.value().outlier_share, 0.5);
  sequence.info_.channels = {};
  EXPECT_FALSE(dense_truth_errors(sequence, 1).flow.has_value());
  EXPECT_EQ(dense_truth_errors(sequence, 1).disparity_text(), "");
}

TEST(DenseTruth, IsAbsentWithoutTruth) {
  TempFolder temp;
  const auto sequence = open_source(SourceSpec::parse(make_vdo_fixture(temp.path() / "tiny").source()));
  const DenseTruthErrors errors = dense_truth_errors(*sequence, 2);
  EXPECT_FALSE(errors.flow.has_value());
  EXPECT_FALSE(errors.disparity.has_value());
  EXPECT_EQ(errors.flow_text(), "");
}

}  // namespace
}  // namespace sextant
