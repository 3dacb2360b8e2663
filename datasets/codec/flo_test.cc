#include "sextant/datasets/codec/flo.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "sextant/base/testing.h"

namespace sextant {
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
  for (const Flow unknown : {Flow{1.67e9f, 0}, Flow{0, -1.1e9f}, Flow{nan, 0}, Flow{0, INFINITY}}) {
    std::string bytes = encode_flo(sample());
    std::memcpy(bytes.data() + 12 + 8 * 7, &unknown, 8);
    const Image<Flow> read = decode_flo(bytes, "");
    EXPECT_TRUE(std::isnan(read(2, 1).u) && std::isnan(read(2, 1).v));
    EXPECT_TRUE(read(1, 1).valid() && read(3, 1).valid());
  }
  flow(2, 1) = {1e9f, -1e9f};
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
  expect_error([&] { decode_flo(negative, "a.flo"); }, "a.flo: .flo header names -5x3 pixels");
}

}  // namespace
}  // namespace sextant
