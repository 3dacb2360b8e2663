#include "sextant/eval/pictures/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/eval/pictures/canvas.h"

namespace sextant {
namespace {

constexpr int gap_px = 4;
constexpr double nearest_m = 4;  // the red end of the depth scale

/// Okabe and Ito's colours, BGR.
const std::array<cv::Vec3b, 7> object_tints = {cv::Vec3b(0, 159, 230), {233, 180, 86}, {115, 158, 0},
                                               {66, 228, 240},         {178, 114, 0},  {0, 94, 213},
                                               {167, 121, 204}};

/// The image in BGR; few colours, so that the file stays small. Gray stands in for colour.
cv::Mat image_of(const Frame& frame) {
  if (!frame.rgb.empty()) return bgr_of(frame.rgb);
  cv::Mat bgr;
  if (!frame.gray.empty()) {
    const cv::Mat gray(frame.gray.height(), frame.gray.width(), CV_8UC1,
                       const_cast<uint8_t*>(frame.gray.data()));
    cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
  }
  return bgr;
}

/// Few levels a channel, with ordered dither, so that a noisy picture stays small as PNG.
void reduce_colours(cv::Mat& bgr) {
  constexpr int level_step = 8;
  static constexpr int bayer[2][2] = {{0, 4}, {6, 2}};
  for (const auto [x, y] : PixelRange(bgr.cols, bgr.rows)) {
    for (int c = 0; c < 3; ++c) {
      uint8_t& value = bgr.at<cv::Vec3b>(y, x)[c];
      value = static_cast<uint8_t>(std::min(255, (value + bayer[y % 2][x % 2]) / level_step * level_step));
    }
  }
}

cv::Mat depth_picture(const Image<float>& depth_m) {
  cv::Mat level(depth_m.height(), depth_m.width(), CV_8UC1), colour;
  for (const auto [x, y] : pixels(depth_m)) {
    const double near = nearest_m / static_cast<double>(depth_m(x, y));
    level.at<uint8_t>(y, x) =
        std::isfinite(near) ? static_cast<uint8_t>(25 + 230 * std::sqrt(std::clamp(near, 0.0, 1.0))) : 0;
  }
  cv::applyColorMap(level, colour, cv::COLORMAP_TURBO);
  colour.setTo(cv::Scalar(40, 40, 40), level == 0);
  return colour;
}

/// Hue by direction, from white to full colour by length as a share of `longest_px`.
cv::Vec3b flow_colour(double u, double v, double longest_px) {
  const double hue = std::fmod(std::atan2(v, u) / (2 * std::numbers::pi) + 1.0, 1.0) * 6;
  const double strength = std::sqrt(std::min(std::hypot(u, v) / longest_px, 1.0));
  const auto channel = [&](double shift) {
    const double at = std::fmod(hue + shift, 6.0);
    const double full = std::clamp(std::abs(at - 3.0) - 1.0, 0.0, 1.0);
    return static_cast<uint8_t>(std::lround(255 * (1 - strength * (1 - full))));
  };
  return {channel(2), channel(4), channel(0)};
}

cv::Mat flow_picture(const Image<Flow>& flow) {
  cv::Mat colour(flow.height(), flow.width(), CV_8UC3, cv::Scalar(40, 40, 40));
  std::vector<float> lengths;
  for (size_t i = 0; i < flow.size(); i += 7) {
    if (flow.data()[i].valid()) lengths.push_back(std::hypot(flow.data()[i].u, flow.data()[i].v));
  }
  if (lengths.empty()) return colour;
  const auto high = lengths.begin() + static_cast<ptrdiff_t>(lengths.size() * 95 / 100);
  std::ranges::nth_element(lengths, high);
  const double longest_px = std::max(1.0, static_cast<double>(*high));
  for (const auto [x, y] : pixels(flow)) {
    const Flow& f = flow(x, y);
    if (f.valid()) colour.at<cv::Vec3b>(y, x) = flow_colour(f.u, f.v, longest_px);
  }
  const int radius = flow.height() / 8;
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      if (std::hypot(x, y) > radius || radius >= flow.width() / 2) continue;
      colour.at<cv::Vec3b>(radius + 6 + y, flow.width() - radius - 7 + x) = flow_colour(x, y, radius);
    }
  }
  return colour;
}

cv::Mat mask_picture(const Image<uint16_t>& mask, const cv::Mat& image) {
  cv::Mat colour(mask.height(), mask.width(), CV_8UC3, cv::Scalar(60, 60, 60));
  if (image.size() == colour.size()) {
    cv::Mat gray;
    cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
    cv::cvtColor(gray * 0.45, colour, cv::COLOR_GRAY2BGR);
  }
  for (const auto [x, y] : pixels(mask)) {
    if (mask(x, y) == 0) continue;
    const cv::Vec3b& tint = object_tints[mask(x, y) % object_tints.size()];
    cv::Vec3b& pixel = colour.at<cv::Vec3b>(y, x);
    for (int c = 0; c < 3; ++c) pixel[c] = static_cast<uint8_t>(0.75 * tint[c] + 0.4 * pixel[c]);
  }
  return colour;
}

/// Evenly spread; the last frame has no flow.
std::vector<Frame> frames_of(const Sequence& sequence, int n_frames) {
  const SequenceInfo& info = sequence.info();
  Channels channels;
  channels.rgb = info.channels.rgb;
  channels.gray = !info.channels.rgb && info.channels.gray;
  channels.depth = info.channels.depth;
  channels.flow = info.channels.flow;
  channels.mask = info.channels.mask;
  const int last = std::max(info.first_frame, info.last_frame - 1);
  const int n = std::min(n_frames, last - info.first_frame + 1);
  std::vector<Frame> frames;
  for (int i = 0; i < n; ++i) {
    const int step = n > 1 ? (last - info.first_frame) * i / (n - 1) : 0;
    frames.push_back(sequence.read(info.first_frame + step, channels));
  }
  return frames;
}

}  // namespace

std::string draw_strip(const Sequence& sequence, int n_frames, int tile_px) {
  const std::vector<Frame> frames = frames_of(sequence, n_frames);
  SEXTANT_CHECK(!frames.empty() && tile_px > 0);
  cv::Size size;
  std::vector<std::array<cv::Mat, 4>> rows;
  for (const Frame& frame : frames) {
    const cv::Mat image = image_of(frame);
    std::array<cv::Mat, 4> row = {image, {}, {}, {}};
    if (!frame.depth_m.empty()) row[1] = depth_picture(frame.depth_m);
    if (!frame.flow.empty()) row[2] = flow_picture(frame.flow);
    if (!frame.mask.empty()) row[3] = mask_picture(frame.mask, image);
    for (const cv::Mat& tile : row) {
      if (!tile.empty()) size = tile.size();
    }
    rows.push_back(std::move(row));
  }
  if (size.width == 0) fail("strip: the frames hold neither image, depth, flow nor masks");
  const int tile_height_px =
      std::max(1, static_cast<int>(std::lround(1.0 * size.height * tile_px / size.width)));
  cv::Mat canvas(static_cast<int>(rows.size()) * (tile_height_px + gap_px) - gap_px,
                 4 * (tile_px + gap_px) - gap_px, CV_8UC3, cv::Scalar(255, 255, 255));
  for (size_t r = 0; r < rows.size(); ++r) {
    for (size_t c = 0; c < rows[r].size(); ++c) {
      const cv::Rect place(static_cast<int>(c) * (tile_px + gap_px),
                           static_cast<int>(r) * (tile_height_px + gap_px), tile_px, tile_height_px);
      cv::Mat tile(place.size(), CV_8UC3, cv::Scalar(40, 40, 40));
      if (!rows[r][c].empty()) cv::resize(rows[r][c], tile, place.size(), 0, 0, cv::INTER_AREA);
      reduce_colours(tile);
      tile.copyTo(canvas(place));
    }
  }
  return png_of(canvas);
}

}  // namespace sextant
