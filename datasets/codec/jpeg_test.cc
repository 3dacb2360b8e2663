#include "sextant/datasets/codec/jpeg.h"

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "sextant/base/testing.h"

namespace sextant {
namespace {

Image<Rgb> texture() {
  return image_of(67, 45, [](int x, int y) {
    return Rgb{static_cast<uint8_t>(x * 3 + (x * y) % 7 * 9), static_cast<uint8_t>(y * 5),
               static_cast<uint8_t>((x * 37 + y * 91) % 256)};
  });
}

std::string textured_jpeg() { return encode_jpeg(texture(), 85); }

TEST(Jpeg, DamagedFilesAreErrors) {
  Image<Rgb> image(64, 48, {10, 200, 90});
  const std::string bytes = encode_jpeg(image);
  const Image<Rgb> again = decode_jpeg_rgb(bytes, "x.jpg");
  EXPECT_EQ(again.width(), 64);
  EXPECT_EQ(again.height(), 48);
  EXPECT_NEAR(again(30, 20).r, 10, 2);  // the channels are not swapped
  EXPECT_NEAR(again(30, 20).g, 200, 2);
  EXPECT_NEAR(again(30, 20).b, 90, 2);
  expect_error([&] { decode_jpeg_rgb(bytes.substr(0, bytes.size() / 2), "x.jpg"); },
               "x.jpg: JPEG file is truncated");
  expect_error([&] { decode_jpeg_rgb("\x89PNG", "x.jpg"); }, "x.jpg: not a JPEG file");
  expect_error([&] { decode_jpeg_rgb("", "x.jpg"); }, "x.jpg: not a JPEG file");
  expect_error([&] { decode_jpeg_rgb("\xff\xd8\xff\xd9", "x.jpg"); }, "x.jpg: damaged JPEG file");
  // The lower half would otherwise be decoded as gray.
  const std::string half = textured_jpeg().substr(0, textured_jpeg().size() / 2) + "\xff\xd9";
  expect_error([&] { decode_jpeg_rgb(half, "x.jpg"); }, "x.jpg: damaged JPEG file (Corrupt JPEG data");
}

TEST(Jpeg, AHeaderWithMorePixelsThanTheFileIsRefused) {
  const auto claiming = [](int width, int height) {
    std::string bytes = textured_jpeg();
    const size_t frame = bytes.find("\xff\xc0");
    const auto set = [&](size_t at, int value) {
      bytes[frame + at] = static_cast<char>(value >> 8);
      bytes[frame + at + 1] = static_cast<char>(value & 255);
    };
    set(5, height);
    set(7, width);
    return bytes;
  };
  EXPECT_EQ(decode_jpeg_rgb(claiming(67, 45), "x.jpg").width(), 67);
  const auto refused = [&](int width, int height, const char* why) {
    expect_error([&] { decode_jpeg_rgb(claiming(width, height), "x.jpg"); }, why);
  };
  refused(65'000, 65'000, "x.jpg: its header claims a JPEG of 65000x65000");
  refused(10'000, 10'000, "expected at most 64 MB or 200 times the file");
  refused(4'000, 4'000, "is too short for the 4000x4000 pixels");
}

TEST(Jpeg, PixelsAreThoseOfOpenCv) {
  const std::string bytes = textured_jpeg();
  const std::vector<uint8_t> buffer(bytes.begin(), bytes.end());
  const Image<Rgb> ours = decode_jpeg_rgb(bytes, "x.jpg");
  cv::Mat theirs = cv::imdecode(buffer, cv::IMREAD_COLOR);
  for (const auto [x, y] : pixels(ours)) {
    const auto& bgr = theirs.at<cv::Vec3b>(y, x);
    ASSERT_EQ(ours(x, y), (Rgb{bgr[2], bgr[1], bgr[0]})) << x << " " << y;
  }
  std::vector<uint8_t> gray;
  ASSERT_TRUE(cv::imencode(".jpg", cv::Mat(8, 8, CV_8UC1, cv::Scalar(77)), gray));
  EXPECT_EQ(decode_jpeg_rgb({reinterpret_cast<const char*>(gray.data()), gray.size()}, "g.jpg")(3, 3),
            (Rgb{77, 77, 77}));
  std::vector<uint8_t> encoded;
  const Image<Rgb> image = texture();
  cv::Mat bgr(image.height(), image.width(), CV_8UC3);
  for (const auto [x, y] : PixelRange(bgr.cols, bgr.rows))
    bgr.at<cv::Vec3b>(y, x) = {image(x, y).b, image(x, y).g, image(x, y).r};
  ASSERT_TRUE(cv::imencode(".jpg", bgr, encoded, {cv::IMWRITE_JPEG_QUALITY, 85}));
  EXPECT_EQ(textured_jpeg(), std::string(encoded.begin(), encoded.end()));
}

}  // namespace
}  // namespace sextant
