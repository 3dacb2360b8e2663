#include <gtest/gtest.h>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/dense_maps.h"

namespace sextant {
namespace {

TEST(KittiPng, DisparityGivesDepthAndBack) {
  Image<uint16_t> n(3, 1);
  n(0, 0) = 0;
  n(1, 0) = 256;
  n(2, 0) = 12345;
  const Image<float> depth = depth_from_disparity256(n, 387.5744);
  EXPECT_TRUE(std::isnan(depth(0, 0)));
  EXPECT_FLOAT_EQ(depth(1, 0), 387.5744f);
  EXPECT_FLOAT_EQ(depth(2, 0), static_cast<float>(387.5744 / (12345 / 256.0)));
  EXPECT_EQ(disparity256_from_depth(depth, 387.5744), n);
}

TEST(KittiPng, DepthBenchmarkHasSteps256) {
  Image<uint16_t> n(2, 1);
  n(1, 0) = 3200;
  EXPECT_TRUE(std::isnan(depth_from_depth256(n)(0, 0)));
  EXPECT_EQ(depth_from_depth256(n)(1, 0), 12.5f);
}

TEST(KittiPng, CentimetresGiveDepthAndBack) {
  Image<uint16_t> n(3, 1);
  n(0, 0) = 65535;
  n(1, 0) = 0;
  n(2, 0) = 1234;
  const Image<float> depth = depth_from_cm(n);
  EXPECT_TRUE(std::isnan(depth(0, 0)));
  EXPECT_TRUE(std::isnan(depth(1, 0)));  // no measurement, as in the other encodings
  EXPECT_FLOAT_EQ(depth(2, 0), 12.34f);
  n(1, 0) = 65535;
  EXPECT_EQ(cm_from_depth(depth), n);
}

TEST(KittiPng, UnrepresentableValuesBecomeInvalid) {
  Image<float> depth(3, 1);
  depth(0, 0) = NAN;
  depth(1, 0) = 1e-4f;
  depth(2, 0) = 1e6f;
  const Image<uint16_t> disparity = disparity256_from_depth(depth, 400.0);
  EXPECT_EQ(disparity, Image<uint16_t>(3, 1, 0));
  EXPECT_EQ(cm_from_depth(depth), Image<uint16_t>(3, 1, 65535));
}

TEST(KittiPng, FlowOfBothDialectsGoesThroughWithinHalfAStep) {
  Image<Flow> flow(1242, 2);
  flow(0, 0) = {12.34f, -0.77f};
  flow(5, 1) = {-300.0f, 0.4f};
  const Image<Flow> kitti = flow_from_kitti(kitti_from_flow(flow));
  const Image<Flow> vkitti = flow_from_vkitti(vkitti_from_flow(flow));
  for (const auto& [x, y] : {std::pair{0, 0}, {5, 1}}) {
    EXPECT_NEAR(kitti(x, y).u, flow(x, y).u, 0.5 / 64 + 1e-4);
    EXPECT_NEAR(kitti(x, y).v, flow(x, y).v, 0.5 / 64 + 1e-4);
    EXPECT_NEAR(vkitti(x, y).u, flow(x, y).u, 1241.0 / 65535 + 1e-4);
    EXPECT_NEAR(vkitti(x, y).v, flow(x, y).v, 1.0 / 65535 + 1e-4);
  }
  EXPECT_FALSE(kitti(1, 1).valid());
  EXPECT_FALSE(vkitti(1, 1).valid());
}

}  // namespace

namespace {

Image<Flow> sample() {
  return image_of(5, 3, [](int x, int y) {
    return Flow{0.25f * static_cast<float>(x) - 1.0f, -3.5f * static_cast<float>(y)};
  });
}

TEST(Flo, RoundTripsBitForBit) {
  const Image<Flow> flow = sample();
  const Image<Flow> back = decode_flo(encode_flo(flow), "a.flo");
  ASSERT_EQ(back.width(), 5);
  ASSERT_EQ(back.height(), 3);
  EXPECT_EQ(std::memcmp(back.data(), flow.data(), flow.size() * sizeof(Flow)), 0);
}

TEST(Flo, UnknownPixelsAreInvalid) {
  Image<Flow> flow = sample();
  flow(2, 1) = {};
  EXPECT_FALSE(decode_flo(encode_flo(flow), "")(2, 1).valid());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Flow unknown :
       {Flow{1.67e9f, 0}, Flow{1e9f, 0}, Flow{0, -1e9f}, Flow{0, -1.1e9f}, Flow{nan, 0}, Flow{0, INFINITY}}) {
    std::string bytes = encode_flo(sample());
    std::memcpy(bytes.data() + 12 + 8 * 7, &unknown, 8);
    const Image<Flow> read = decode_flo(bytes, "");
    EXPECT_TRUE(std::isnan(read(2, 1).u) && std::isnan(read(2, 1).v));
    EXPECT_TRUE(read(1, 1).valid() && read(3, 1).valid());
  }
  flow(2, 1) = {0.99e9f, -0.99e9f};
  EXPECT_TRUE(decode_flo(encode_flo(flow), "")(2, 1).valid());
}

TEST(FloErrors, WrongMagic) {
  std::string bytes = encode_flo(sample());
  bytes[0] = 'X';
  expect_error([&] { decode_flo(bytes, "flow/000001.flo"); }, "flow/000001.flo: not a Middlebury .flo file");
}

TEST(FloErrors, WrongSize) {
  const std::string bytes = encode_flo(sample());
  expect_error([&] { decode_flo(bytes.substr(0, 100), "a.flo"); },
               "a.flo: .flo file is truncated: 100 bytes instead of 132 for its 5x3 pixels");
  expect_error([&] { decode_flo(bytes + "x", "a.flo"); },
               "a.flo: .flo file is too long: 133 bytes instead of 132");
  expect_error([&] { decode_flo(bytes.substr(0, 7), "a.flo"); }, "has only 7 bytes");
  std::string negative = bytes;
  const int32_t width = -5;
  std::memcpy(negative.data() + 4, &width, 4);
  expect_error([&] { decode_flo(negative, "a.flo"); }, "a.flo: its .flo header names -5x3 pixels");
}

}  // namespace

namespace {

Image<uint16_t> random_mask(int w, int h, uint32_t seed, bool large_ids) {
  std::mt19937 rng(seed);
  Image<uint16_t> mask(w, h);
  uint16_t label = 0;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (rng() % 7 == 0) label = static_cast<uint16_t>(rng() % (large_ids ? 65536u : 14u));
    mask.data()[i] = label;
  }
  return mask;
}

TEST(MaskText, RoundTrips) {
  for (uint32_t seed = 0; seed < 40; ++seed) {
    const auto mask =
        random_mask(static_cast<int>(1 + seed * 3), static_cast<int>(1 + seed % 5), seed, seed % 2 == 0);
    EXPECT_EQ(decode_mask_text(encode_mask_text(mask), "m.txt"), mask);
  }
}

TEST(MaskText, LayoutDoesNotMatter) {
  Image<uint16_t> expected(5, 2);
  expected(4, 0) = 1;
  expected(0, 1) = 12;
  for (const char* text :
       {"0 0 0 0 1\n12 0 0 0 0", "0 0 0 0 1 \n12 0 0 0 0 \n", "0\t0 0 0 1\r\n  12 0 0 0 0 \r\n\n \n",
        "\xef\xbb\xbf"
        "0 0 0 0 1\n012 00 0 0 0\n"}) {
    EXPECT_EQ(decode_mask_text(text, "m.txt"), expected) << text;
  }
}

TEST(MaskTextErrors, NameFileLineAndColumn) {
  const auto error = [](const char* text, const char* message) {
    expect_error([&] { decode_mask_text(text, "semantic/000002.txt"); }, message);
  };
  error("0 0 0 0 0\n0 0 0 x 0\n", "semantic/000002.txt:2:7: expected an instance id 0..65535, got 'x'");
  error("0 0 0 -1 0\n", "semantic/000002.txt:1:7: expected an instance id 0..65535, got '-1'");
  error("0 0 0 0 65536\n", "semantic/000002.txt:1:9: expected an instance id 0..65535, got '65536'");
  error("0 99999999999999999999999\n", "semantic/000002.txt:1:3: expected an instance id");
  error("0 1.5 0\n", "got '1.5'");
  error("0 0 : 0 0 0 0 0\n", "semantic/000002.txt:1:5: expected an instance id 0..65535, got ':'");
  error("0 0 0\n0 0\n", "semantic/000002.txt:2: row has 2 instance ids, the first row has 3");
  error("0 0 0\n0 0 0 0 0 0 0 0 0 0\n",
        "semantic/000002.txt:2: row has 10 instance ids, the first row has 3");
  error("0 0 0\n\n0 0 0\n", "semantic/000002.txt:2: row has 0 instance ids");
  std::string wide;  // declares 100,000 x 100,000 pixels
  for (int i = 0; i < 100'000; ++i) wide += "0 ";
  error((wide + std::string(100'000, '\n') + "0").c_str(),
        "semantic/000002.txt:2: row has 0 instance ids, "
        "the first");
  error("", "semantic/000002.txt: expected rows of instance ids, the file is empty");
  error(" \n \n", "the file is empty");
}

}  // namespace

}  // namespace sextant
