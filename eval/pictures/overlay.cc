#include "sextant/eval/pictures/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sextant/base/error.h"
#include "sextant/eval/pictures/canvas.h"

namespace sextant {
namespace {

constexpr int scale = 2;              // canvas pixels per image pixel: thin lines and text stay sharp
constexpr int strip_height = 56;      // legend, canvas pixels
constexpr double flow_length = 0.25;  // drawn part of each flow vector

const cv::Scalar white(255, 255, 255);
const cv::Scalar black(0, 0, 0);
const cv::Scalar static_colour(233, 180, 86);  // BGR, sky blue
const cv::Scalar outlier_colour(0, 94, 213);    // vermilion
const std::array<cv::Scalar, 5> object_colours = {cv::Scalar(0, 159, 230), cv::Scalar(66, 228, 240),
                                                  cv::Scalar(167, 121, 204), cv::Scalar(115, 158, 0),
                                                  cv::Scalar(0, 94, 213)};

/// Sub-pixel position for OpenCV's fixed-point drawing, in the picture below the legend.
constexpr int shift = 4;
cv::Point at(double u, double v) {
  const double sub = 1 << shift;
  return {static_cast<int>(std::lround((u + 0.5) * scale * sub)),
          static_cast<int>(std::lround(((v + 0.5) * scale + strip_height) * sub))};
}

cv::Mat canvas_of(const Frame& frame) {
  cv::Mat large;
  cv::resize(bgr_of(frame.rgb), large, {}, scale, scale, cv::INTER_CUBIC);
  large = large * 0.8;  // darker, so that the marks stand out
  cv::Mat canvas;
  cv::copyMakeBorder(large, canvas, strip_height, 0, 0, 0, cv::BORDER_CONSTANT, cv::Scalar(32, 32, 32));
  return canvas;
}

/// Inliers with the start of their flow; of points on a grid, only those in one third of its columns and
/// rows.
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
             cv::LINE_AA, shift);
    cv::circle(canvas, at(u, v), static_cast<int>(radius * (1 << shift)), colour, cv::FILLED, cv::LINE_AA,
               shift);
  }
}

/// Outline of one instance; its top-left corner on the canvas is returned.
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

/// Text on a dark plate with a coloured edge, kept inside the picture.
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

/// Points of the body, evenly out of all.
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
    const cv::Point end = at(u + flow_length * body.points.flow_u[i], v + flow_length * body.points.flow_v[i]);
    const cv::Scalar& shade = agrees ? colour : outlier_colour;
    cv::line(canvas, begin, end, shade, 1, cv::LINE_AA, shift);
    if (agrees) cv::circle(canvas, begin, 3 << shift, shade, cv::FILLED, cv::LINE_AA, shift);
    if (agrees) continue;
    const int arm = 5 << shift;
    for (const int sign : {-1, 1}) {
      cv::line(canvas, begin - cv::Point(arm, sign * arm), begin + cv::Point(arm, sign * arm), shade, 2, cv::LINE_AA,
               shift);
    }
  }
}

/// Around the body's points, in canvas pixels: twice as large, at least a quarter of the picture wide, 16:9.
cv::Rect region_of(const BodyResult& body, const cv::Size& canvas) {
  constexpr double room = 2.0, aspect = 16.0 / 9.0;
  double left = canvas.width, right = 0, top = canvas.height, bottom = 0;
  for (size_t i = 0; i < body.points.size(); ++i) {
    if (!body.points.has_pixels(i)) continue;
    const double x = body.points.u[i] * scale, y = body.points.v[i] * scale + strip_height;
    left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
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

}  // namespace sextant
