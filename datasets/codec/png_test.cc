#include "sextant/datasets/codec/png.h"

#include <libdeflate.h>

#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "sextant/base/testing.h"

namespace sextant {
namespace {

// Smooth with noise, so that every filter predicts something and every byte value occurs.
template <typename T>
T sample(int x, int y, int channel, std::mt19937& rng) {
  constexpr int range = std::numeric_limits<T>::max() + 1;
  const double wave = 0.5 + 0.4 * std::sin(0.05 * x + channel) * std::cos(0.07 * y);
  return static_cast<T>(static_cast<int>(wave * range + static_cast<double>(rng() % 64) * range / 1024.0) %
                        range);
}

template <typename T>
Image<T> gray(int w, int h) {
  std::mt19937 rng(sizeof(T));
  return image_of(w, h, [&](int x, int y) { return sample<T>(x, y, 0, rng); });
}

template <typename Pixel>
Image<Pixel> colour(int w, int h) {
  using T = decltype(Pixel::r);
  std::mt19937 rng(2 + sizeof(T));
  return image_of(w, h, [&](int x, int y) {
    return Pixel{sample<T>(x, y, 0, rng), sample<T>(x, y, 1, rng), sample<T>(x, y, 2, rng)};
  });
}

cv::Mat opencv_decode(const std::string& png, int flags) {
  const std::vector<uint8_t> bytes(png.begin(), png.end());
  return cv::imdecode(bytes, flags);
}

std::string opencv_encode(const cv::Mat& image, const std::vector<int>& parameters = {}) {
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(".png", image, bytes, parameters));
  return {bytes.begin(), bytes.end()};
}

// Compares pixels; OpenCV orders colours B, G, R.
template <typename Pixel>
bool equal(const Image<Pixel>& ours, cv::Mat theirs) {
  if (theirs.channels() == 3) cv::cvtColor(theirs, theirs, cv::COLOR_BGR2RGB);
  if (theirs.cols != ours.width() || theirs.rows != ours.height() || theirs.elemSize() != sizeof(Pixel))
    return false;
  return std::memcmp(ours.data(), theirs.data, ours.size() * sizeof(Pixel)) == 0;
}

void set_byte(std::string& bytes, size_t at, int value) { bytes[at] = static_cast<char>(value); }

// Parameter: filter type, or -1 = selected per row.
class PngFilters : public testing::TestWithParam<int> {};

TEST_P(PngFilters, RoundTripsAndAgreesWithOpenCv) {
  const PngEncoding encoding{6, GetParam()};
  for (const auto& [w, h] : {std::pair{131, 47}, {1, 1}, {1, 9}, {9, 1}, {2, 3}}) {
    const auto g8 = encode_png(gray<uint8_t>(w, h), encoding);
    EXPECT_EQ(decode_png_gray(g8, "g8"), gray<uint8_t>(w, h));
    EXPECT_TRUE(equal(decode_png_gray(g8, "g8"), opencv_decode(g8, cv::IMREAD_UNCHANGED)));
    const auto g16 = encode_png(gray<uint16_t>(w, h), encoding);
    EXPECT_EQ(decode_png16(g16, "g16"), gray<uint16_t>(w, h));
    EXPECT_TRUE(equal(decode_png16(g16, "g16"), opencv_decode(g16, cv::IMREAD_UNCHANGED)));
    const auto c8 = encode_png(colour<Rgb>(w, h), encoding);
    EXPECT_EQ(decode_png_rgb(c8, "c8"), colour<Rgb>(w, h));
    EXPECT_TRUE(equal(decode_png_rgb(c8, "c8"), opencv_decode(c8, cv::IMREAD_COLOR)));
    const auto c16 = encode_png(colour<Rgb16>(w, h), encoding);
    EXPECT_EQ(decode_png_rgb16(c16, "c16"), colour<Rgb16>(w, h));
    EXPECT_TRUE(equal(decode_png_rgb16(c16, "c16"), opencv_decode(c16, cv::IMREAD_UNCHANGED)));
  }
}

INSTANTIATE_TEST_SUITE_P(All, PngFilters, testing::Values(-1, 0, 1, 2, 3, 4));

TEST(Png, ReadsWhatOpenCvWrites) {
  cv::Mat rgba(40, 61, CV_8UC4), color(40, 61, CV_8UC3), depth(40, 61, CV_16UC1), flow(40, 61, CV_16UC3);
  for (cv::Mat* m : {&rgba, &color, &depth, &flow}) cv::randu(*m, 0, m->depth() == CV_8U ? 256 : 65536);
  EXPECT_TRUE(equal(decode_png_rgb(opencv_encode(color), ""), color));
  EXPECT_TRUE(equal(decode_png16(opencv_encode(depth), ""), depth));
  EXPECT_TRUE(equal(decode_png_rgb16(opencv_encode(flow), ""), flow));
  cv::Mat without_alpha;
  cv::cvtColor(rgba, without_alpha, cv::COLOR_BGRA2BGR);
  EXPECT_TRUE(equal(decode_png_rgb(opencv_encode(rgba), ""), without_alpha));
}

TEST(Png, GrayOfColourIsOpenCvsFixedPointFormula) {
  const Image<Rgb> image = colour<Rgb>(333, 257);
  const cv::Mat rgb(image.height(), image.width(), CV_8UC3, const_cast<Rgb*>(image.data()));
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  EXPECT_TRUE(equal(rgb_to_gray(image), gray));
  EXPECT_EQ(decode_png_gray(encode_png(image), ""), rgb_to_gray(image));
}

TEST(Png, ReadsFewBitsPerPixel) {
  cv::Mat bits(11, 13, CV_8UC1);
  for (const auto [x, y] : PixelRange(bits.cols, bits.rows))
    bits.at<uint8_t>(y, x) = (x * y + x) % 3 == 0 ? 255 : 0;
  const std::string png = opencv_encode(bits, {cv::IMWRITE_PNG_BILEVEL, 1});
  ASSERT_EQ(png_header(png, "").bit_depth, 1);
  EXPECT_TRUE(equal(decode_png_gray(png, ""), bits));
  EXPECT_EQ(decode_png_ids(png, "")(0, 0), 1);
  EXPECT_EQ(decode_png_rgb(png, "")(0, 0), (Rgb{255, 255, 255}));
}

TEST(Png, ReadsPalettes) {
  // 3x1, indices 2 0 1, two bits each; palette red, green, blue.
  const unsigned char png[] = {
      137, 80,  78, 71,  13, 10,  26,  10,  0,   0,   0, 13, 73, 72, 68, 82, 0,   0,  0,   3,  0,  0,   0,
      1,   2,   3,  0,   0,  0,   102, 142, 252, 39,  0, 0,  0,  9,  80, 76, 84,  69, 255, 0,  0,  0,   255,
      0,   0,   0,  255, 45, 74,  205, 138, 0,   0,   0, 13, 73, 68, 65, 84, 120, 1,  1,   2,  0,  253, 255,
      0,   132, 0,  134, 0,  133, 54,  138, 239, 229, 0, 0,  0,  0,  73, 69, 78,  68, 174, 66, 96, 130};
  const std::string bytes(reinterpret_cast<const char*>(png), sizeof png);
  const Image<uint16_t> index = decode_png_ids(bytes, "");
  EXPECT_EQ(index(0, 0), 2);
  EXPECT_EQ(index(1, 0), 0);
  EXPECT_EQ(index(2, 0), 1);
  EXPECT_EQ(decode_png_rgb(bytes, "")(0, 0), (Rgb{0, 0, 255}));
  EXPECT_EQ(decode_png_rgb(bytes, "")(1, 0), (Rgb{255, 0, 0}));
}

TEST(Png, SizeComesFromTheHeaderAlone) {
  const PngHeader header = png_header(encode_png(colour<Rgb>(31, 7)).substr(0, 40), "a.png");
  EXPECT_EQ(header.width, 31);
  EXPECT_EQ(header.height, 7);
  EXPECT_EQ(header.bit_depth, 8);
}

TEST(PngErrors, EveryTruncationIsSeen) {
  const std::string png = encode_png(gray<uint16_t>(40, 30));
  for (size_t n = 0; n < png.size(); ++n) {
    EXPECT_THROW(decode_png16(std::string_view(png).substr(0, n), "depth/000003.png"), Error) << n;
  }
  expect_error([&] { decode_png16(png.substr(0, png.size() / 2), "depth/000003.png"); },
               "depth/000003.png: PNG file is truncated");
  expect_error([] { decode_png16("", "a.png"); }, "a.png: expected a PNG image, the file is empty");
}

TEST(PngErrors, EveryDamagedByteIsSeen) {
  const std::string png = encode_png(gray<uint16_t>(20, 10));
  for (size_t i = 0; i < png.size(); ++i) {
    std::string damaged = png;
    set_byte(damaged, i, damaged[i] ^ 0x10);
    EXPECT_THROW(decode_png16(damaged, "a.png"), Error) << i;
  }
  std::string damaged = png;
  set_byte(damaged, png.size() / 2, damaged[png.size() / 2] ^ 1);
  expect_error([&] { decode_png16(damaged, "a.png"); }, "a.png: PNG chunk at byte 33 is damaged");
}

TEST(PngErrors, AHeaderWithMorePixelsThanTheFileIsRefused) {
  const auto claiming = [](uint32_t width, uint32_t height) {
    std::string png = encode_png(Image<uint16_t>(40, 30));
    for (int i = 0; i < 4; ++i) {
      set_byte(png, 16 + static_cast<size_t>(i), static_cast<int>(width >> (24 - 8 * i) & 255U));
      set_byte(png, 20 + static_cast<size_t>(i), static_cast<int>(height >> (24 - 8 * i) & 255U));
    }
    const uint32_t crc = libdeflate_crc32(0, png.data() + 12, 17);
    for (int i = 0; i < 4; ++i)
      set_byte(png, 29 + static_cast<size_t>(i), static_cast<int>(crc >> (24 - 8 * i) & 255U));
    return png;
  };
  EXPECT_EQ(decode_png16(claiming(40, 30), "a.png"), Image<uint16_t>(40, 30));
  for (const auto& decode : {+[](const std::string& png) { png_header(png, "a.png"); },
                             +[](const std::string& png) { decode_png16(png, "a.png"); }}) {
    expect_error([&] { decode(claiming(1'000'000, 1'000'000)); },
                 "a.png: its header claims a PNG of "
                 "1000000x1000000");
    expect_error([&] { decode(claiming(40'000, 40'000)); }, "expected at most 134217728 pixels");
    expect_error([&] { decode(claiming(10'000, 10'000)); }, "expected at most 64 MB or 200 times the file");
    expect_error([&] { decode(claiming(3'000, 3'000)); }, "is too short for the 3000x3000 pixels");
  }
  // The decoded image would have more than 64 MB and be 200 times the size of the file.
  expect_error([] { decode_png16(encode_png(Image<uint16_t>(5'000, 5'000)), "a.png"); },
               "expected at most 64 MB or 200 times");
}

TEST(PngErrors, OtherFilesAndKinds) {
  expect_error([] { decode_png16("\xff\xd8\xff JPEG", "a.jpg"); }, "a.jpg: not a PNG image");
  expect_error([] { decode_png16(encode_png(colour<Rgb>(4, 4)), "a.png"); },
               "a.png: expected a PNG of 16-bit gray, got 8-bit RGB");
  expect_error([] { decode_png_rgb(encode_png(gray<uint16_t>(4, 4)), "a.png"); }, "got 16-bit gray");
  expect_error([] { decode_png_rgb16(encode_png(gray<uint16_t>(4, 4)), "a.png"); },
               "expected a PNG of 16-bit RGB");
}

}  // namespace
}  // namespace sextant
