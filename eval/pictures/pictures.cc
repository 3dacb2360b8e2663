#include "sextant/eval/pictures/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "sextant/base/error.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/eval/experiment/run.h"

namespace sextant {
namespace {

cv::Mat bgr_of(const Image<Rgb>& image) {
  const cv::Mat rgb(image.height(), image.width(), CV_8UC3,
                    const_cast<Rgb*>(image.data()));  // OpenCV cannot view constant data
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

Image<Rgb> rgb_of(const cv::Mat& bgr) {
  Image<Rgb> image(bgr.cols, bgr.rows);
  cv::cvtColor(bgr, cv::Mat(bgr.rows, bgr.cols, CV_8UC3, image.data()), cv::COLOR_BGR2RGB);
  return image;
}

std::string png_of(const cv::Mat& bgr) { return encode_png(rgb_of(bgr), {.level = 9}); }
std::string jpeg_of(const cv::Mat& bgr, int quality) { return encode_jpeg(rgb_of(bgr), quality); }

constexpr int scale = 2;              // canvas pixels per image pixel: thin lines and text stay sharp
constexpr int strip_height = 56;      // height of the legend, canvas pixels
constexpr double flow_length = 0.25;  // drawn share of each flow vector

const cv::Scalar white(255, 255, 255);
const cv::Scalar static_colour(233, 180, 86);  // BGR, sky blue
const cv::Scalar outlier_colour(0, 94, 213);   // vermilion
const std::array<cv::Scalar, 5> object_colours = {cv::Scalar(0, 159, 230), cv::Scalar(66, 228, 240),
                                                  cv::Scalar(167, 121, 204), cv::Scalar(115, 158, 0),
                                                  cv::Scalar(0, 94, 213)};

/// Sub-pixel position for OpenCV's fixed-point drawing, in the picture below the legend.
constexpr int sub_pixel_bits = 4;
cv::Point at(double u, double v) {
  const double sub = 1 << sub_pixel_bits;
  return {static_cast<int>(std::lround((u + 0.5) * scale * sub)),
          static_cast<int>(std::lround(((v + 0.5) * scale + strip_height) * sub))};
}

cv::Mat canvas_of(const Frame& frame) {
  cv::Mat large;
  cv::resize(bgr_of(frame.rgb), large, {}, scale, scale, cv::INTER_CUBIC);
  large = large * 0.8;  // darker, for contrast with the marks
  cv::Mat canvas;
  cv::copyMakeBorder(large, canvas, strip_height, 0, 0, 0, cv::BORDER_CONSTANT, cv::Scalar(32, 32, 32));
  return canvas;
}

/// Draws inliers with the start of their flow. With `thin_out`, only points in the first three of every nine
/// columns and rows of pixels are drawn.
void draw_points(const BodyResult& body, const cv::Scalar& colour, bool thin_out, cv::Mat& canvas) {
  constexpr double radius = 3.0;
  constexpr int cell_px = 9, kept_px = 3;
  const auto& inliers = body.estimate.inliers;
  for (size_t i = 0; i < body.points.size(); ++i) {
    if (i < inliers.size() && inliers[i] == 0) continue;
    const double u = body.points.u[i], v = body.points.v[i];
    if (thin_out && (static_cast<int>(u) % cell_px >= kept_px || static_cast<int>(v) % cell_px >= kept_px))
      continue;
    cv::line(canvas, at(u, v),
             at(u + flow_length * body.points.flow_u[i], v + flow_length * body.points.flow_v[i]), colour, 1,
             cv::LINE_AA, sub_pixel_bits);
    cv::circle(canvas, at(u, v), static_cast<int>(radius * (1 << sub_pixel_bits)), colour, cv::FILLED,
               cv::LINE_AA, sub_pixel_bits);
  }
}

/// Draws the outline of one instance; returns its bounding box on the canvas.
cv::Rect draw_contour(const Image<uint16_t>& mask, int instance, const cv::Scalar& colour, cv::Mat& canvas) {
  cv::Mat region(mask.height(), mask.width(), CV_8UC1, cv::Scalar(0));
  for (const auto [x, y] : pixels(mask)) region.at<uint8_t>(y, x) = mask(x, y) == instance ? 255 : 0;
  cv::Mat large;
  cv::resize(region, large, {}, scale, scale, cv::INTER_LINEAR);
  cv::threshold(large, large, 127, 255, cv::THRESH_BINARY);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(large, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE, {0, strip_height});
  cv::drawContours(canvas, contours, -1, colour, 3, cv::LINE_AA);
  cv::Rect box;
  for (const auto& contour : contours)
    box = box.empty() ? cv::boundingRect(contour) : box | cv::boundingRect(contour);
  return box;
}

/// Draws text on a dark plate with a coloured edge, inside the picture.
void draw_label(const std::string& text, cv::Point corner, const cv::Scalar& colour, cv::Mat& canvas) {
  constexpr double size = 0.8;
  int baseline = 0;
  const cv::Size extent = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, size, 1, &baseline);
  cv::Rect plate(corner.x, corner.y - extent.height - 24, extent.width + 24, extent.height + 18);
  plate.x = std::clamp(plate.x, 0, std::max(0, canvas.cols - plate.width));
  plate.y = std::max(plate.y, strip_height + 4);
  cv::rectangle(canvas, plate, cv::Scalar(24, 24, 24), cv::FILLED);
  cv::rectangle(canvas, plate, colour, 2, cv::LINE_AA);
  cv::putText(canvas, text, {plate.x + 12, plate.y + plate.height - 10}, cv::FONT_HERSHEY_DUPLEX, size, white,
              1, cv::LINE_AA);
}

void draw_legend(const std::string& text, cv::Mat& canvas) {
  cv::circle(canvas, {26, strip_height / 2}, 8, static_colour, cv::FILLED, cv::LINE_AA);
  cv::putText(canvas, text, {46, strip_height / 2 + 9}, cv::FONT_HERSHEY_DUPLEX, 0.8, white, 1, cv::LINE_AA);
}

/// Draws a subset of the body's inliers and outliers, evenly selected.
void draw_points_of_both_kinds(const BodyResult& body, const cv::Scalar& colour, cv::Mat& canvas) {
  constexpr size_t most = 500;
  const auto& inliers = body.estimate.inliers;
  const size_t n = body.points.size(), kept = std::min(n, most);
  for (size_t k = 0; k < kept; ++k) {
    const size_t i = k * n / kept;
    if (!body.points.has_pixels(i)) continue;
    const bool agrees = i < inliers.size() && inliers[i] != 0;
    const double u = body.points.u[i], v = body.points.v[i];
    const cv::Point begin = at(u, v);
    const cv::Point end =
        at(u + flow_length * body.points.flow_u[i], v + flow_length * body.points.flow_v[i]);
    const cv::Scalar& shade = agrees ? colour : outlier_colour;
    cv::line(canvas, begin, end, shade, 1, cv::LINE_AA, sub_pixel_bits);
    if (agrees)
      cv::circle(canvas, begin, 3 << sub_pixel_bits, shade, cv::FILLED, cv::LINE_AA, sub_pixel_bits);
    if (agrees) continue;
    const int arm = 5 << sub_pixel_bits;
    for (const int sign : {-1, 1}) {
      cv::line(canvas, begin - cv::Point(arm, sign * arm), begin + cv::Point(arm, sign * arm), shade, 2,
               cv::LINE_AA, sub_pixel_bits);
    }
  }
}

/// Returns a region around the body's points, in canvas pixels: twice their extent, at least a quarter of the
/// picture's width, 16:9.
cv::Rect region_of(const BodyResult& body, const cv::Size& canvas) {
  constexpr double room = 2.0, aspect = 16.0 / 9.0;
  double left = canvas.width, right = 0, top = canvas.height, bottom = 0;
  for (size_t i = 0; i < body.points.size(); ++i) {
    if (!body.points.has_pixels(i)) continue;
    const double x = body.points.u[i] * scale, y = body.points.v[i] * scale + strip_height;
    left = std::min(left, x), right = std::max(right, x), top = std::min(top, y),
    bottom = std::max(bottom, y);
  }
  if (left > right) return {0, strip_height, canvas.width, canvas.height - strip_height};
  const double most_high = canvas.height - strip_height;
  double width = std::max({room * (right - left), room * aspect * (bottom - top), 0.25 * canvas.width});
  width = std::min<double>(width, canvas.width);
  const double height = std::min(width / aspect, most_high);
  const auto place = [](double middle, double size, double low, double high) {
    return static_cast<int>(std::clamp(middle - size / 2, low, std::max(low, high - size)));
  };
  return {place((left + right) / 2, width, 0, canvas.width),
          place((top + bottom) / 2, height, strip_height, canvas.height), static_cast<int>(width),
          static_cast<int>(height)};
}

const Record* find_record(const std::vector<Record>& records, const std::string& body) {
  const auto it =
      std::find_if(records.begin(), records.end(), [&](const Record& r) { return r.body == body; });
  return it == records.end() ? nullptr : &*it;
}

std::string number(const Record* record, Record::Numbers Record::*map, const std::string& key, int decimals,
                   const std::string& before, const std::string& after) {
  if (record == nullptr) return "";
  const auto it = (record->*map).find(key);
  return it == (record->*map).end() ? "" : fmt::format("{}{:.{}f}{}", before, it->second, decimals, after);
}

}  // namespace

std::string draw_overlay(const Frame& frame, const FrameResult& result, const std::vector<Record>& records,
                         int width_px) {
  SEXTANT_CHECK(!frame.rgb.empty() && !frame.mask.empty());
  cv::Mat canvas = canvas_of(frame);
  draw_points(result.ego, static_colour, false, canvas);

  size_t n_moving = 0;
  for (const BodyResult& body : result.objects) {
    if (body.status != Status::ok) continue;
    const cv::Scalar& colour = object_colours[n_moving++ % object_colours.size()];
    draw_points(body, colour, true, canvas);
    const cv::Rect box = draw_contour(frame.mask, body.instance, colour, canvas);
    const Record* record = find_record(records, object_body(body.instance));
    const std::string label = fmt::format("object {}{}{}", body.instance,
                                          number(record, &Record::values, "v_kmh", 1, "  ", " km/h"),
                                          number(record, &Record::values, "v_gt_kmh", 1, " (true ", ")"));
    draw_label(label, box.tl(), colour, canvas);
  }

  const Record* ego = find_record(records, "ego");
  draw_legend(fmt::format("{} static features with 1/4 of their flow    camera: {}{}{}    moving objects: "
                          "{}    frames {} to {}",
                          result.ego.n_inliers, number(ego, &Record::values, "step_m", 3, "", " m/frame"),
                          number(ego, &Record::errors, "Et_m", 3, ", E_t ", " m"),
                          number(ego, &Record::errors, "ER_deg", 3, ", E_R ", " deg"), n_moving, result.prev,
                          result.curr),
              canvas);

  if (width_px > 0 && width_px < canvas.cols) {
    const int height_px =
        static_cast<int>(std::lround(static_cast<double>(canvas.rows) * width_px / canvas.cols));
    cv::resize(cv::Mat(canvas), canvas, {width_px, std::max(height_px, 1)}, 0, 0, cv::INTER_AREA);
  }
  return png_of(canvas);
}

std::string draw_body(const Frame& frame, const BodyResult& body, int width_px) {
  SEXTANT_CHECK(!frame.rgb.empty() && width_px > 0);
  constexpr int quality = 85;
  cv::Mat canvas = canvas_of(frame);
  const bool is_camera = body.instance == 0;
  if (!is_camera && !frame.mask.empty()) draw_contour(frame.mask, body.instance, white, canvas);
  draw_points_of_both_kinds(body, static_colour, canvas);
  const cv::Rect whole(0, strip_height, canvas.cols, canvas.rows - strip_height);
  cv::Mat cut = canvas(is_camera ? whole : region_of(body, canvas.size()));
  const int height_px = std::max(1, static_cast<int>(std::lround(1.0 * cut.rows * width_px / cut.cols)));
  cv::Mat small;
  cv::resize(cut, small, {width_px, height_px}, 0, 0, cv::INTER_AREA);
  return jpeg_of(small, quality);
}

namespace {

constexpr int gap_px = 4;
constexpr double nearest_m = 4;  // the red end of the depth scale

/// Colours of Okabe and Ito, BGR.
const std::array<cv::Vec3b, 7> object_tints = {cv::Vec3b(0, 159, 230), {233, 180, 86}, {115, 158, 0},
                                               {66, 228, 240},         {178, 114, 0},  {0, 94, 213},
                                               {167, 121, 204}};

/// Returns the colour image in BGR, or the gray one if there is no colour; empty if there is neither.
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

/// Reduces the levels per channel with ordered dither, so that a noisy picture compresses well as PNG.
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

/// Returns hue by direction, and saturation by length as a share of `longest_px`, from white to full colour.
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

/// Returns evenly spaced frames, at most `n_frames`. The last frame of the sequence has no flow and is left
/// out.
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

Showcase make_showcase(const ShowcaseRequest& request) {
  const std::unique_ptr<Sequence> sequence = open_source(request.source);
  const SequenceInfo& info = sequence->info();
  const int frame = request.frame.value_or(info.first_frame + 1);
  if (frame <= info.first_frame || frame > info.last_frame) {
    fail("frame {}: expected a frame from {} to {}, after the first one of {}", frame, info.first_frame + 1,
         info.last_frame, request.source.text);
  }
  if (!info.channels.rgb) fail("{}: has no colour images to draw on", request.source.text);

  std::optional<FrameResult> result;
  std::vector<Record> records;
  RunConfig config;
  config.sources = {request.source};
  config.sources.front().first = info.first_frame;
  config.sources.front().last = frame;
  config.estimator = request.estimator;
  config.options = request.options;
  config.jobs = request.jobs;
  config.quiet = request.quiet;
  config.on_pair = [&](const FrameResult& pair, std::span<const Record> of_pair) {
    result = pair;
    records.assign(of_pair.begin(), of_pair.end());
  };
  Showcase showcase;
  showcase.run = run(config);
  Channels channels;
  channels.rgb = channels.mask = true;
  showcase.overlay_png =
      draw_overlay(sequence->read(result->prev, channels), *result, records, request.width_px);
  return showcase;
}

OutputFiles showcase_files(const ShowcaseRequest& request) {
  Showcase showcase = make_showcase(request);
  OutputFiles files = run_files(showcase.run);
  files["overlay.png"] = std::move(showcase.overlay_png);
  return files;
}

}  // namespace sextant
