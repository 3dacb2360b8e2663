#include "sextant/estimator/extraction.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/features2d.hpp>
#include <set>

#include "sextant/measurement/landing.h"

namespace sextant {
namespace {

bool valid_depth(float depth_m) { return std::isfinite(depth_m) && depth_m > 0; }

double depth_at(const Image<float>& depth_m, const Landing& pixel) {
  if (depth_m.empty()) return NAN;
  const float depth = depth_m(pixel.x, pixel.y);
  return valid_depth(depth) ? depth : NAN;
}

/// No instance within `margin` px (checked at the eight corners and edge centres of the square).
bool off_instances(const Image<uint16_t>& mask, int x, int y, int margin) {
  for (int dy = -margin; dy <= margin; dy += std::max(margin, 1)) {
    for (int dx = -margin; dx <= margin; dx += std::max(margin, 1)) {
      if (mask.contains(x + dx, y + dy) && mask(x + dx, y + dy) != 0) return false;
    }
  }
  return true;
}

void check_frame(const Frame& frame, bool is_previous) {
  SEXTANT_CHECK(!frame.mask.empty());
  SEXTANT_CHECK(!is_previous || (!frame.gray.empty() && !frame.depth_m.empty() && !frame.flow.empty()));
}

Correspondences extract_background(const Frame& prev, const Frame& curr, const ExtractionOptions& options) {
  const int width = prev.gray.width();
  const int height = prev.gray.height();
  const auto usable = [&](int x, int y) {
    const float depth = prev.depth_m(x, y);
    if (!valid_depth(depth) || depth > options.max_static_depth_m) return false;
    if (!off_instances(prev.mask, x, y, options.mask_margin_px)) return false;
    const Landing to = land(x, y, prev.flow(x, y), width, height);
    return to.inside && curr.mask(to.x, to.y) == 0;
  };
  Correspondences points;
  for (const Feature& feature : detect_features(prev.gray, usable, options)) {
    const Flow& flow = prev.flow(feature.x, feature.y);
    const Landing to = land(feature.x, feature.y, flow, width, height);
    points.push_back(feature.x, feature.y, prev.depth_m(feature.x, feature.y), flow.u, flow.v,
                     depth_at(curr.depth_m, to));
  }
  return points;
}

std::map<int, size_t> count_pixels(const Image<uint16_t>& mask) {
  std::vector<size_t> histogram(65536, 0);
  for (int y = 0; y < mask.height(); ++y) {
    const uint16_t* row = mask.row(y);
    for (int x = 0; x < mask.width();) {  // masks consist of long runs
      const uint16_t id = row[x];
      int end = x + 1;
      while (end < mask.width() && row[end] == id) ++end;
      histogram[id] += end - x;
      x = end;
    }
  }
  std::map<int, size_t> pixels;
  for (size_t id = 1; id < histogram.size(); ++id) {
    if (histogram[id] > 0) pixels[static_cast<int>(id)] = histogram[id];
  }
  return pixels;
}

/// All instances of the current mask, with the samples of the previous image that land on them.
std::vector<ObjectObservation> extract_objects(const Frame& prev, const Frame& curr,
                                               const std::map<int, size_t>& instances,
                                               const ExtractionOptions& options) {
  const int width = prev.mask.width();
  const int height = prev.mask.height();
  std::map<int, ObjectObservation> objects;
  for (const auto& [id, pixels] : instances) {
    objects[id].instance = id;
    objects[id].area_fraction = static_cast<double>(pixels) / (static_cast<double>(width) * height);
  }
  for (int y = 0; y < height; y += options.object_step_px) {
    for (int x = 0; x < width; x += options.object_step_px) {
      const Flow& flow = prev.flow(x, y);
      const Landing to = land(x, y, flow, width, height);
      if (!to.inside || curr.mask(to.x, to.y) == 0) continue;
      ObjectObservation& object = objects.at(curr.mask(to.x, to.y));
      const uint16_t from = prev.mask(x, y);
      if (from == 0) {
        ++object.n_background;
      } else if (valid_depth(prev.depth_m(x, y))) {
        object.points.push_back(x, y, prev.depth_m(x, y), flow.u, flow.v, depth_at(curr.depth_m, to));
        object.instance_prev.push_back(from);
      }
    }
  }
  std::vector<ObjectObservation> ordered;
  for (auto& [id, object] : objects) ordered.push_back(std::move(object));
  return ordered;
}

}  // namespace

void ExtractionOptions::check() const {
  check_option(fast_threshold > 0 && fast_threshold < 255, "fast_threshold", fast_threshold, "in 1..254");
  check_option(cell_px > 0, "cell_px", cell_px, "> 0");
  check_option(features_per_cell > 0, "features_per_cell", features_per_cell, "> 0");
  check_option(mask_margin_px >= 0, "mask_margin_px", mask_margin_px, ">= 0");
  check_option(max_static_depth_m > 0, "max_static_depth_m", max_static_depth_m, "> 0");
  check_option(object_step_px > 0, "object_step_px", object_step_px, "> 0");
}

std::vector<Feature> detect_features(const Image<uint8_t>& gray, const std::function<bool(int, int)>& usable,
                                     const ExtractionOptions& options) {
  const cv::Mat view(gray.height(), gray.width(), CV_8UC1, const_cast<uint8_t*>(gray.data()));
  std::vector<cv::KeyPoint> corners;
  cv::FAST(view, corners, options.fast_threshold, /*nonmaxSuppression=*/true);

  const int columns = (gray.width() + options.cell_px - 1) / options.cell_px;
  const int rows = (gray.height() + options.cell_px - 1) / options.cell_px;
  std::vector<std::vector<Feature>> cells(static_cast<size_t>(columns) * rows);
  const auto stronger = [](const Feature& a, const Feature& b) {
    return std::tuple(-a.response, a.y, a.x) < std::tuple(-b.response, b.y, b.x);
  };
  for (const cv::KeyPoint& corner : corners) {
    const Feature feature{static_cast<int>(corner.pt.x), static_cast<int>(corner.pt.y),
                          static_cast<int>(corner.response)};
    std::vector<Feature>& cell = cells[feature.y / options.cell_px * columns + feature.x / options.cell_px];
    const bool full = static_cast<int>(cell.size()) == options.features_per_cell;
    if (full && !stronger(feature, cell.back())) continue;
    if (!usable(feature.x, feature.y)) continue;
    if (full) cell.pop_back();
    cell.insert(std::upper_bound(cell.begin(), cell.end(), feature, stronger), feature);
  }
  std::vector<Feature> features;
  for (const std::vector<Feature>& cell : cells) features.insert(features.end(), cell.begin(), cell.end());
  return features;
}

FramePair extract_frame_pair(const Frame& prev, const Frame& curr, const StereoCamera& camera, double dt_s,
                             const ExtractionOptions& options) {
  check_frame(prev, true);
  check_frame(curr, false);
  FramePair pair;
  pair.prev = prev.index;
  pair.curr = curr.index;
  pair.dt_s = dt_s;
  pair.width = prev.gray.width();
  pair.height = prev.gray.height();
  pair.camera = camera;
  pair.background = extract_background(prev, curr, options);
  const std::map<int, size_t> instances = count_pixels(curr.mask);
  pair.objects = extract_objects(prev, curr, instances, options);
  for (const auto& [id, pixels] : count_pixels(prev.mask)) {
    if (!instances.contains(id)) pair.lost_instances.push_back(id);
  }
  return pair;
}

}  // namespace sextant
