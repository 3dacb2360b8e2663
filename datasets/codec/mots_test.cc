#include "sextant/datasets/codec/mots.h"

#include <numeric>
#include <random>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

// A mask of axis-parallel rectangles, whose runs are similar, with noise, whose runs are not.
Image<uint16_t> random_mask(int w, int h, uint32_t seed) {
  std::mt19937 rng(seed);
  Image<uint16_t> mask(w, h);
  for (int n = 0; n < 6; ++n) {
    const int x0 = static_cast<int>(rng() % static_cast<uint32_t>(w));
    const int y0 = static_cast<int>(rng() % static_cast<uint32_t>(h));
    for (int y = y0; y < std::min(h, y0 + h / 3 + 1); ++y) {
      for (int x = x0; x < std::min(w, x0 + w / 4 + 1); ++x) {
        mask(x, y) = static_cast<uint16_t>(rng() % 50 == 0 ? 0 : n * 37 + 1);
      }
    }
  }
  return mask;
}

TEST(Rle, IsTheFormatsOwn) {
  // Worked by hand from the definition: 37 = 5 + 1 * 32 -> 'U' (5 + 32 + 48), '1'; 16 needs a second group,
  // because bit 4 is the sign: '`' (16 + 32 + 48), '0'; the fourth number is 3 - 16 = -13 -> 19 -> 'C' (19 +
  // 48 with the sign bit set and no further group).
  const std::vector<uint32_t> runs{37, 16, 1, 3, 13};
  const std::string text = "U1`01C<";
  EXPECT_EQ(encode_rle(runs), text);
  EXPECT_EQ(decode_rle(text, 10, 7, "m.txt:1"), runs);
  EXPECT_EQ(std::accumulate(runs.begin(), runs.end(), 0u), 70u);
}

TEST(Rle, RunsGoDownTheColumns) {
  Image<uint16_t> mask(3, 2);
  mask(1, 0) = mask(1, 1) = mask(2, 0) = 4;
  EXPECT_EQ(encode_rle(mask, 4), "231");  // 2 background, 3 of the object, 1 background
}

TEST(Rle, RoundTripsLargeRunsAndNegativeSteps) {
  std::mt19937 rng(3);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<uint32_t> runs(1 + rng() % 40);
    for (uint32_t& run : runs) run = rng() % (trial % 2 ? 3u : 40000u);
    const uint32_t n = std::accumulate(runs.begin(), runs.end(), 0u);
    if (n == 0) continue;
    EXPECT_EQ(decode_rle(encode_rle(runs), static_cast<int>(n), 1, "x:1"), runs);
  }
}

TEST(Mots, TextRoundTrips) {
  std::map<int, Image<uint16_t>> masks;
  for (int frame = 0; frame < 12; ++frame) {
    masks[3 * frame] = random_mask(5 + 7 * frame, 3 + 4 * frame, static_cast<uint32_t>(frame));
  }
  masks[2] = Image<uint16_t>(8, 8);
  const std::string text = encode_mots_text(masks, {{38, 2}});
  const MotsText mots(text, "m.txt");
  for (const auto& [frame, mask] : masks) {
    EXPECT_EQ(mots.mask(frame, mask.width(), mask.height()), mask) << frame;
  }
  EXPECT_FALSE(mots.frames().contains(2));
  for (const MotsText::Row& row : mots.rows(30)) EXPECT_EQ(row.class_id, row.id == 2037 ? 2 : 1);
}

TEST(Mots, IgnoredRegionsAreBackground) {
  const MotsText mots("0 1004 1 2 3 042\n0 10000 10 2 3 42\n", "m.txt");
  const Image<uint16_t> mask = mots.mask(0, 3, 2);
  EXPECT_EQ(mask(0, 0), 5);
  EXPECT_EQ(mask(1, 1), 5);
  EXPECT_EQ(mask(2, 0), 0);
}

TEST(Mots, DetectionsKeepTheirIdsAndEarlierLinesAreInFront) {
  const MotsText mots("7 21 2 2 3 042\n7 22 1 2 3 24\n", "d.txt", MotsIds::detections);
  const Image<uint16_t> mask = mots.mask(7, 3, 2);
  EXPECT_EQ(mask(1, 0), 21);
  EXPECT_EQ(mask(1, 1), 21);
  EXPECT_EQ(mask(2, 1), 22);
}

TEST(Mots, PngRoundTrips) {
  const Image<uint16_t> mask = random_mask(60, 40, 5);
  const Image<uint16_t> image = mots_from_mask(mask, {{38, 2}});
  EXPECT_EQ(mask_from_mots(image, "m.png"), mask);
  Image<uint16_t> ignored(2, 1, 10000);
  EXPECT_EQ(mask_from_mots(ignored, "m.png"), Image<uint16_t>(2, 1));
}

TEST(MotsErrors, NameFileLineAndSums) {
  const auto error = [](const char* text, const char* message) {
    expect_error([&] { MotsText(text, "instances_txt/0003.txt").mask(0, 3, 2); }, message);
  };
  error(
      "0 1000 1 2 3 232\n",
      "instances_txt/0003.txt:1: the run lengths add up to 7 pixels or more, but width x height = 3 x 2 = 6");
  error("\n0 1000 1 2 3 22\n",
        "instances_txt/0003.txt:2: the run lengths add up to 4 pixels, but width x height = 3 x 2 = 6");
  error("0 1000 1 2 3 2p1\n", "character 2 is 'p' (code 112), expected one of '0' to 'o'");
  error("0 1000 1 2 3 2/1\n", "character 2 is '/' (code 47)");
  error("0 1000 1 2 3 23Q\n", "0003.txt:1: the run lengths end within a number, at character 3");
  error("0 1000 1 2 3 ooooooooooooo\n", "is too large");
  error("0 1000 1 2 3 22O\n", "0003.txt:1: run 3 has a negative length, -1");
  error("0 1000 1 2 3 042\n0 1001 1 2 3 33\n",
        "0003.txt:2: the mask of id 1001 overlaps an earlier one of "
        "frame 0 (track 0) in 1 pixels, the first at column 1, row 1");
  error("0 10000 10 2 3 042\n0 1001 1 2 3 33\n", "frame 0 (ignore) in 1 pixels");
  error("0 1000 1 2 4 044\n", "the mask of id 1000 has 4x2 pixels, but the images have 3x2");
  error("0 1000 1 2 3\n",
        "0003.txt:1: expected frame, id, class_id, height, width and run lengths (6 values), got 5");
  error("0 1000.5 1 2 3 6\n", "expected a whole number for the id, got '1000.5'");
  error("-1 1000 1 2 3 6\n", "frame -1: expected 0 or larger");
  error("0 1000 1 2000000000 2000000000 6\n",
        "height 2000000000 and width 2000000000: expected at most "
        "33554432 pixels");
  error("0 1000 1 0 3 6\n", "height 0 and width 3: expected positive numbers");
  error("0 3000 3 2 3 6\n", "class_id 3: expected 1 (car), 2 (pedestrian) or 10 (ignore)");
  error("0 2000 1 2 3 6\n", "id 2000 of class 1: expected 1000 to 1999");
  error("0 21 1 2 3 6\n", "ids of another kind are read with detections_txt");
  error("0 1004 1 2 3 6\n1 1004 1 2 3 6\n0 1004 1 2 3 6\n",
        "0003.txt:3: frame 0 has track 4 twice: id 1004 here and id 1004 in line 1");
  error("0 1004 1 2 3 6\n0 2004 2 2 3 6\n", "frame 0 has track 4 twice: id 2004 here and id 1004 in line 1");
}

TEST(MotsErrors, Png) {
  Image<uint16_t> image(3, 2);
  image(1, 1) = 3001;
  expect_error([&] { mask_from_mots(image, "i/000001.png"); },
               "i/000001.png: column 1, row 1: 3001 is not a MOTS id");
  image(1, 1) = 1007;
  image(2, 1) = 2007;
  expect_error([&] { mask_from_mots(image, "i/000001.png"); },
               "column 2, row 1: track 7 has two classes: it appears as 1007 and as 2007");
  expect_error([&] { mots_from_mask(Image<uint16_t>(1, 1, 1001), {}); }, "track ids 0 to 999");
  expect_error([&] { mots_from_mask(Image<uint16_t>(1, 1, 3), {{3, 10}}); }, "object 3 has class 10");
}

// All labels and detections of the real sequences: the runs of every row fill its image, and encode to the
// same string.
class MotsData : public testing::Test {
 protected:
  void SetUp() override {
    SEXTANT_NEEDS_DATA("kitti_tracking");
    SEXTANT_NEEDS_DATA("kitti_tracking_peers");
  }

  static int check(const MotsText& mots) {
    int n = 0;
    for (const int frame : mots.frames()) {
      const auto rows = mots.rows(frame);
      mots.mask(frame, rows.front().width, rows.front().height);  // throws Error on an overlap
      for (const MotsText::Row& row : rows) {
        EXPECT_EQ(encode_rle(decode_rle(row.rle, row.width, row.height, "row")), row.rle) << frame;
        ++n;
      }
    }
    return n;
  }
};

TEST_F(MotsData, LabelsDecodeAndEncode) {
  int n = 0;
  for (const char* sequence : {"0000", "0001", "0002", "0003", "0004", "0005", "0006", "0018", "0020"}) {
    const auto file = real_data(fmt::format("kitti_tracking/training/instances_txt/{}.txt", sequence));
    n += check(MotsText(read_file(file), file.string()));
  }
  EXPECT_EQ(n, 16869);
}

TEST_F(MotsData, MaskEncodesToTheLabelsRow) {
  const auto file = real_data("kitti_tracking/training/instances_txt/0003.txt");
  const MotsText mots(read_file(file), file.string());
  const Image<uint16_t> mask = mots.mask(0, 1242, 375);
  for (const MotsText::Row& row : mots.rows(0)) {
    if (row.class_id == 10) continue;
    EXPECT_EQ(encode_rle(mask, static_cast<uint16_t>(row.id % 1000 + 1)), row.rle);
  }
}

TEST_F(MotsData, DetectionsDecodeAndEncode) {
  const auto file = real_data("kitti_tracking_peers/trackrcnn_image_02/0003.txt");
  EXPECT_EQ(check(MotsText(read_file(file), file.string(), MotsIds::detections)), 523);
}

}  // namespace
}  // namespace sextant
