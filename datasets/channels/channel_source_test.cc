#include "sextant/datasets/channels/channel_source.h"

#include <cmath>
#include <random>

#include "sextant/base/machine.h"
#include "sextant/base/testing.h"
#include "sextant/base/text.h"
#include "sextant/datasets/channels/computed_channels.h"
#include "sextant/datasets/channels/opencv_view.h"
#include "sextant/datasets/channels/testing.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/mots.h"

namespace sextant {
namespace {

constexpr int frame_width = 320;
constexpr int frame_height = 96;

// A smooth random texture, shifted left and up by (dx, dy) px.
Image<Rgb> texture(double dx, double dy, int width = frame_width, int height = frame_height) {
  std::mt19937 rng(1);
  std::vector<double> value(64 * 64);
  for (double& v : value) v = static_cast<double>(rng() % 256);
  const auto at = [&](int x, int y) { return value[static_cast<size_t>((y & 63) * 64 + (x & 63))]; };
  return image_of(width, height, [&](int x, int y) {
    const double u = (x + dx + 1000) / 4, v = (y + dy + 1000) / 4;
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const double a = u - i, b = v - j;
    const auto gray = static_cast<uint8_t>((1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) +
                                           b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1)));
    return Rgb{gray, gray, gray};
  });
}

// Frame k is shifted by k * (4.5, 1.25) px; the right image of every frame has 12.25 px of disparity.
class Channel : public testing::Test {
 protected:
  ChannelInputs inputs() {
    return {.left = [](int k) { return texture(-4.5 * k, -1.25 * k); },
            .right = [](int k) { return texture(12.25 - 4.5 * k, -1.25 * k); },
            .inputs = &log_,
            .width = frame_width,
            .height = frame_height,
            .last_frame = 2,
            .camera = {{200, 200, 160, 48}, 196}};
  }
  void flow_error(const std::string& choice, const std::string& part) {
    expect_error([&] { make_flow_source(choice, inputs())->read(0); }, part);
  }
  void depth_error(const std::string& choice, const std::string& part) {
    expect_error([&] { make_depth_source(choice, inputs())->read(0); }, part);
  }
  void mask_error(const std::string& choice, const std::string& part) {
    expect_error([&] { make_mask_source(choice, inputs())->read(0); }, part);
  }

  TempFolder folder_;
  InputLog log_;
};

TEST_F(Channel, DisGivesTheMotionFromPreviousToNext) {
  const auto source = make_flow_source("dis", inputs());
  EXPECT_EQ(source->provenance(), "flow: dis");
  const Image<Flow> flow = source->read(0);
  double error = 0;
  int n = 0;
  for (int y = 16; y < frame_height - 16; ++y) {
    for (int x = 16; x < frame_width - 16; ++x, ++n)
      error += std::hypot(flow(x, y).u - 4.5, flow(x, y).v - 1.25);
  }
  EXPECT_LT(error / n, 0.1);
  EXPECT_TRUE(source->read(2).empty());
}

TEST_F(Channel, SgbmGivesTheDepthOfTheDisparity) {
  const auto source = make_depth_source("sgbm", inputs());
  EXPECT_EQ(source->provenance(), "depth: sgbm, bf = 196");
  const Image<float> depth = source->read(1);
  int n_good = 0, n_valid = 0;
  for (int y = 0; y < frame_height; ++y) {
    for (int x = 13; x < frame_width; ++x) {
      n_valid += std::isfinite(depth(x, y));
      n_good += std::abs(196 / depth(x, y) - 12.25) < 0.25;
    }
    // Columns whose match lies outside the right image.
    for (int x = 0; x < 12; ++x) EXPECT_FALSE(depth(x, y) < 196 / 12.0 + 0.1) << x;
  }
  EXPECT_GT(n_valid, 0.97 * frame_height * (frame_width - 13));
  EXPECT_GT(n_good, 0.97 * n_valid);
}

TEST_F(Channel, SgbmIsInvalidWhereOnlyOneViewHasThePoint) {
  Image<Rgb> left = texture(0, 0), right = texture(5, 0);
  for (int y = 30; y < 70; ++y) {  // a near patch with 25 px of disparity
    for (int x = 150; x < 210; ++x) left(x, y) = right(x - 25, y) = texture(700, 33)(x, y);
  }
  const Image<float> disparity = sgbm_disparity(rgb_to_gray(left), rgb_to_gray(right));
  EXPECT_NEAR(disparity(180, 50), 25, 0.1);
  EXPECT_NEAR(disparity(250, 50), 5, 0.1);
  int n_hidden = 0;  // left of the patch, the right image shows the patch
  for (int x = 132; x < 148; ++x) n_hidden += std::isfinite(disparity(x, 50));
  EXPECT_LE(n_hidden, 4);
}

TEST_F(Channel, DepthOfADisparityOfZeroIsInvalid) {
  Image<float> disparity(3, 1);
  disparity(0, 0) = 0;
  disparity(1, 0) = 0.5f;
  disparity(2, 0) = NAN;
  const Image<float> depth = depth_from_disparity(disparity, 100);
  EXPECT_TRUE(std::isnan(depth(0, 0)));
  EXPECT_EQ(depth(1, 0), 200);
  EXPECT_TRUE(std::isnan(depth(2, 0)));
}

bool same(const Image<Flow>& a, const Image<Flow>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Flow)) == 0;
}

TEST_F(Channel, ComputedChannelsDoNotDependOnThreads) {
  const auto flow = make_flow_source("dis", inputs());
  const auto depth = make_depth_source("sgbm", inputs());
  const Image<Flow> flow_0 = flow->read(0), flow_1 = flow->read(1);
  const Image<float> depth_0 = depth->read(0);
  cv::setNumThreads(7);
  EXPECT_TRUE(same(make_flow_source("dis", inputs())->read(0), flow_0));
  parallel_for(8, 4, [&](int i) {
    EXPECT_TRUE(same(flow->read(i % 2), i % 2 == 0 ? flow_0 : flow_1));
    const Image<float> d = depth->read(0);
    EXPECT_EQ(std::memcmp(d.data(), depth_0.data(), d.size() * sizeof(float)), 0);
  });
}

TEST_F(Channel, BoxesAreDrawnFarToNear) {
  std::map<int, std::vector<LabelBox>> boxes;
  boxes[0] = {{7, {10, 10, 29.6, 20}, 5}, {3, {20.2, -5, 400, 15}, 9}};
  const auto source = make_mask_source("boxes", inputs(), boxes);
  const Image<uint16_t> mask = source->read(0);
  EXPECT_EQ(mask(10, 10), 7);
  EXPECT_EQ(mask(9, 10), 0);
  EXPECT_EQ(mask(25, 12), 7);
  EXPECT_EQ(mask(29, 20), 7);
  EXPECT_EQ(mask(30, 15), 3);
  EXPECT_EQ(mask(20, 0), 0);
  EXPECT_EQ(mask(21, 0), 3);
  EXPECT_EQ(mask(frame_width - 1, 15), 3);
  EXPECT_EQ(mask(frame_width - 1, 16), 0);
  EXPECT_EQ(source->read(1), Image<uint16_t>(frame_width, frame_height));
  boxes[0][0].box.left = NAN;
  expect_error([&] { make_mask_source("boxes", inputs(), boxes)->read(0); },
               "the box of object 7 is not finite");
  boxes[0][0] = {0, {0, 0, 1, 1}, 1};
  expect_error([&] { make_mask_source("boxes", inputs(), boxes)->read(0); }, "a box has id 0");
}

Image<Flow> some_flow() {
  Image<Flow> flow(frame_width, frame_height, Flow{1.5f, -2.25f});
  flow(3, 2) = {};
  return flow;
}

TEST_F(Channel, FlowFiles) {
  folder_.write("flo/flow_00001.flo", encode_flo(some_flow()));
  folder_.write("kitti/000001_10.png", encode_png(kitti_from_flow(some_flow())));
  folder_.write("vkitti/00001.png", encode_png(vkitti_from_flow(some_flow())));
  for (const auto& [name, missing, tolerance] :
       {std::tuple<const char*, const char*, double>{"flo", "flow_00000.flo", 0},
        {"kitti_png", "000000_10.png", 0},
        {"vkitti_png", "00000.png", 0.01}}) {
    const std::string path = folder_ / split(name, '_').front();
    const std::string choice = fmt::format("{}:{}", name, path);
    const auto source = make_flow_source(choice, inputs());
    EXPECT_EQ(source->provenance(), "flow: " + choice);
    const Image<Flow> flow = source->read(1);
    EXPECT_NEAR(flow(0, 0).u, 1.5, tolerance);
    EXPECT_NEAR(flow(0, 0).v, -2.25, tolerance);
    EXPECT_FALSE(flow(3, 2).valid());
    EXPECT_TRUE(source->read(2).empty());  // the last frame
    source->check_file(1);
    source->check_file(2);
    for (const auto& ask : {std::function([&] { source->check_file(0); }), {[&] { source->read(0); }}})
      expect_error(ask, path + "/" + missing + ": missing file: frame 0 needs its flow; add it, or");
  }
  EXPECT_EQ(log_.entries().size(), 3u);
}

TEST_F(Channel, OnlyTheFilesOfAPrefix) {
  for (const char* name : {"000007_10.flo", "000007_11.flo", "000008_10.flo"})
    folder_.write(fmt::format("pairs/{}", name), encode_flo(some_flow()));
  ChannelInputs of_pair = inputs();
  of_pair.last_frame = 12;
  const auto source = make_flow_source("flo:" + (folder_ / "pairs/000007_*"), of_pair);
  EXPECT_TRUE(source->has(10) && source->has(11));
  EXPECT_FALSE(source->has(7) || source->has(12));
  flow_error("flo:" + (folder_ / "pairs"), "pairs: two files of frame 7: 000007_10.flo and 000007_11.flo");
  expect_error([&] { make_flow_source("flo:" + (folder_ / "pairs/000008_*"), of_pair)->check_file(11); },
               folder_ / "pairs/000008_11.flo: missing file: frame 11 needs its flow");
  flow_error("flo:" + (folder_ / "pairs/9*"), "pairs/9*: no .flo files named by frame number in it");
}

TEST_F(Channel, DepthFiles) {
  Image<uint16_t> n(frame_width, frame_height, 12800);
  for (const char* name : {"disparity256", "depth256", "cm"}) {
    folder_.write(fmt::format("{}/000000.png", name), encode_png(n));
  }
  const auto read = [&](const std::string& name) {
    return make_depth_source(name + ":" + (folder_ / name), inputs())->read(0)(5, 5);
  };
  EXPECT_FLOAT_EQ(read("disparity256"), 196.0f / 50.0f);
  EXPECT_FLOAT_EQ(read("depth256"), 50.0f);
  EXPECT_FLOAT_EQ(read("cm"), 128.0f);
}

TEST_F(Channel, MaskFiles) {
  Image<uint16_t> mask(frame_width, frame_height);
  Image<uint8_t> small(frame_width, frame_height);
  mask(5, 6) = 12;
  small(5, 6) = 12;
  folder_.write("wide/000000.png", encode_png(mask));
  folder_.write("narrow/000000.png", encode_png(small));
  folder_.write("mots/000000.png", encode_png(mots_from_mask(mask, {{12, 2}})));
  folder_.write("text/000000.txt", encode_mask_text(mask));
  folder_.write("0003.txt", encode_mots_text({{0, mask}}, {{12, 2}}));
  const auto read = [&](const std::string& kind, const std::string& name) {
    return make_mask_source(kind + ":" + (folder_ / name), inputs())->read(0);
  };
  EXPECT_EQ(read("instance_png", "wide"), mask);
  EXPECT_EQ(read("instance_png", "narrow"), mask);
  EXPECT_EQ(read("mots_png", "mots"), mask);
  EXPECT_EQ(read("vdo_text", "text"), mask);
  EXPECT_EQ(read("mots_txt", "0003.txt"), mask);
  EXPECT_EQ(read("detections_txt", "0003.txt")(5, 6), 2011);
  EXPECT_EQ(make_mask_source("detections_txt:" + (folder_ / "0003.txt"), inputs())->provenance(),
            "masks: detections_txt:" + (folder_ / "0003.txt") +
                " (detections: ids are of one frame each, not tracks)");
}

TEST_F(Channel, UnknownChoicesNameTheKnownOnes) {
  flow_error("diss", "flow: unknown choice 'diss': did you mean 'dis'? known: dis, flo:DIR, kitti_png:DIR");
  flow_error("kiti_png:/x", "flow: unknown choice 'kiti_png:/x': did you mean 'kitti_png:DIR'?");
  flow_error("sgbm", "flow: unknown choice 'sgbm'");
  flow_error("kitti:/x", "flow: unknown choice 'kitti:/x': did you mean 'kitti_png:DIR'? known: dis");
  flow_error("flo", "flow: 'flo': expected flo:DIR");
  flow_error("flo:", "flow: 'flo:': expected flo:DIR");
  flow_error("dis:/x", "flow: 'dis:/x': expected dis");
  depth_error("sgm", "depth: unknown choice 'sgm': did you mean 'sgbm'? known: sgbm, disparity256:DIR");
  mask_error("mots_text:/x", "masks: unknown choice 'mots_text:/x': did you mean 'mots_txt:FILE'?");
  mask_error("", "masks: unknown choice ''");
}

TEST_F(Channel, HelpNamesTheKnownChoices) {
  const std::string flow = flow_option_help(), depth = depth_option_help(), masks = mask_option_help();
  flow_error("kitti:/x", "known: " + flow.substr(flow.find("or ") + 3));
  depth_error("kitti:/x", "known: " + depth.substr(depth.find("or ") + 3));
  mask_error("", "known: " + masks.substr(masks.find("or ") + 3));
  EXPECT_THAT(depth, HasSubstr("sgbm; none; or sgbm, disparity256:DIR"));
}

TEST_F(Channel, ErrorsNameTheFile) {
  flow_error("flo:" + (folder_ / "nowhere"), "nowhere: no such folder");
  flow_error("flo:" + (folder_ / ""), "no .flo files named by frame number in it");
  folder_.write("small/000000.flo", encode_flo(Image<Flow>(4, 3)));
  flow_error("flo:" + (folder_ / "small"), "small/000000.flo: 4x3 pixels, expected 320x96 as in the images");
  folder_.write("bad/000000.png", "not a PNG");
  depth_error("cm:" + (folder_ / "bad"), "bad/000000.png: ");
  mask_error("instance_png:" + (folder_ / "bad"), "bad/000000.png: ");
  mask_error("mots_txt:" + (folder_ / "no.txt"), "no.txt: cannot open");
  mask_error("mots_txt:" + folder_.write("m.txt", "0 1000 1 3 4 <\n"),
             "m.txt:1: the mask of id 1000 has 4x3 pixels, but the images have 320x96");
  mask_error("boxes", "masks: boxes needs label boxes");
}

TEST_F(Channel, ComputedChannelsNeedImages) {
  ChannelInputs blind = inputs();
  blind.right = nullptr;
  expect_error([&] { make_depth_source("sgbm", blind); }, "depth: sgbm needs the right images");
  blind.left = nullptr;
  expect_error([&] { make_depth_source("sgbm", blind); }, "depth: sgbm needs images");
  expect_error([&] { make_flow_source("dis", blind); }, "flow: dis needs images");
  expect_error([] { dis_flow(Image<uint8_t>(20, 20), Image<uint8_t>(21, 20)); }, "20x20 and 21x20");
  expect_error([] { dis_flow(Image<uint8_t>(20, 8), Image<uint8_t>(20, 8)); },
               "at least 16x16 pixels, got 20x8");
  expect_error([] { sgbm_disparity(Image<uint8_t>(20, 20), Image<uint8_t>(21, 20)); },
               "has 20x20 pixels and the right");
}

}  // namespace
}  // namespace sextant
