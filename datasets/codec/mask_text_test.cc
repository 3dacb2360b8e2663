#include "sextant/datasets/codec/mask_text.h"

#include <random>

#include "sextant/base/testing.h"

namespace sextant {
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
  std::string wide;  // claims 100,000 x 100,000 pixels
  for (int i = 0; i < 100'000; ++i) wide += "0 ";
  error((wide + std::string(100'000, '\n') + "0").c_str(), "semantic/000002.txt:2: row has 0 instance ids, the first");
  error("", "semantic/000002.txt: expected rows of instance ids, the file is empty");
  error(" \n \n", "the file is empty");
}

}  // namespace
}  // namespace sextant
