#include "sextant/estimator/extraction.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>

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
  std::map<int, size_t> pixels;
  const uint16_t* data = mask.data();
  for (size_t begin = 0; begin < mask.size();) {  // masks consist of long runs
    const uint16_t id = data[begin];
    const uint64_t four = id * 0x0001000100010001ULL;
    size_t end = begin + 1;
    for (uint64_t next = 0; end + 4 <= mask.size(); end += 4) {
      std::memcpy(&next, data + end, sizeof(next));
      if (next != four) break;
    }
    while (end < mask.size() && data[end] == id) ++end;
    if (id != 0) pixels[id] += end - begin;
    begin = end;
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
  const int columns = (gray.width() + options.cell_px - 1) / options.cell_px;
  const int rows = (gray.height() + options.cell_px - 1) / options.cell_px;
  const auto cell_of = [&](const Feature& f) {
    return static_cast<size_t>(f.y / options.cell_px) * columns + f.x / options.cell_px;
  };
  const std::vector<Feature> corners = fast_corners(gray, options.fast_threshold);
  // Counting sort by cell.
  std::vector<size_t> begin(static_cast<size_t>(columns) * rows + 1, 0);
  for (const Feature& corner : corners) ++begin[cell_of(corner) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Feature> by_cell(corners.size());
  std::vector<size_t> next(begin.begin(), begin.end() - 1);
  for (const Feature& corner : corners) by_cell[next[cell_of(corner)]++] = corner;

  const auto weaker = [](const Feature& a, const Feature& b) {
    return std::tuple(a.response, -a.y, -a.x) < std::tuple(b.response, -b.y, -b.x);
  };
  std::vector<Feature> features;
  for (size_t cell = 0; cell + 1 < begin.size(); ++cell) {
    const auto first = by_cell.begin() + static_cast<std::ptrdiff_t>(begin[cell]);
    auto last = by_cell.begin() + static_cast<std::ptrdiff_t>(begin[cell + 1]);
    // As a heap: few are asked for before enough are usable.
    std::make_heap(first, last, weaker);
    for (int wanted = options.features_per_cell; wanted > 0 && first != last;) {
      std::pop_heap(first, last, weaker);
      const Feature& strongest = *--last;
      if (!usable(strongest.x, strongest.y)) continue;
      features.push_back(strongest);
      --wanted;
    }
  }
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
