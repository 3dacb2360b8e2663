// PairReader::extract() (eval/experiment/case_runner.cc) calls extract_frame_pair() with the frames of an
// adapter, for example of datasets/vdo_folder.cc.

#include "sextant/estimator/points/extraction.h"

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <tuple>

#include "sextant/geometry/lanes.h"
#include "sextant/measurement/frame.h"

namespace sextant {
namespace {

constexpr int radius = 3;
constexpr int block = 32;
using Bytes = uint8_t __attribute__((vector_size(block)));
using UnalignedBytes = uint8_t __attribute__((vector_size(block), aligned(1), may_alias));
using Words = uint64_t __attribute__((vector_size(block)));

struct Offset {
  int x, y;
};
constexpr std::array<Offset, 16> circle = {{{0, -3},
                                            {1, -3},
                                            {2, -2},
                                            {3, -1},
                                            {3, 0},
                                            {3, 1},
                                            {2, 2},
                                            {1, 3},
                                            {0, 3},
                                            {-1, 3},
                                            {-2, 2},
                                            {-3, 1},
                                            {-3, 0},
                                            {-3, -1},
                                            {-2, -2},
                                            {-1, -3}}};

// Macros as in lanes.h: functions that return vectors would have different calling conventions in the clones.
#define SEXTANT_MIN(a, b) ((a) < (b) ? (a) : (b))
#define SEXTANT_MAX(a, b) ((a) > (b) ? (a) : (b))

/// Returns true if the block contains nothing but zeros.
SEXTANT_INLINED bool is_zero(const Words& words) { return (words[0] | words[1] | words[2] | words[3]) == 0; }

/// Computes the FAST responses of the pixels centre[0 .. n), 0 if not a corner. Reads and writes whole
/// blocks.
SEXTANT_SIMD void score_row(const uint8_t* centre, std::ptrdiff_t stride, int n, int threshold,
                            uint8_t* scores) {
  const Bytes t = Bytes{} + static_cast<uint8_t>(threshold);
  std::array<std::ptrdiff_t, 16> offset;
  for (size_t k = 0; k < 16; ++k) offset[k] = circle[k].y * stride + circle[k].x;
  for (int x = 0; x < n; x += block) {
    const auto load = [&](size_t k) {
      return reinterpret_cast<const UnalignedBytes*>(centre + x + offset[k]);
    };
    const Bytes c = *reinterpret_cast<const UnalignedBytes*>(centre + x);
    auto* out = reinterpret_cast<UnalignedBytes*>(scores + x);
    *out = Bytes{};
    const Bytes high = SEXTANT_MAX(c, ~t) == c ? ~Bytes{} : c + t;  // saturated
    const Bytes low = SEXTANT_MAX(c, t) - t;
    // Nine contiguous pixels always include two adjacent ones of top, right, bottom and left.
    const Bytes top = *load(0), right = *load(4), bottom = *load(8), left = *load(12);
    const Bytes bright4 = SEXTANT_MIN(SEXTANT_MAX(top, bottom), SEXTANT_MAX(right, left));
    const Bytes dark4 = SEXTANT_MAX(SEXTANT_MIN(top, bottom), SEXTANT_MIN(right, left));
    if (is_zero(
            reinterpret_cast<Words>((SEXTANT_MAX(bright4, high) - high) | (SEXTANT_MAX(low, dark4) - dark4))))
      continue;

    // Two arcs of nine share the eight pixels from an even pixel on: one adds the pixel before them, the
    // other the pixel after them. The brightness of an arc is that of its darkest pixel.
    Bytes p[16];
    for (size_t k = 0; k < 16; ++k) p[k] = *load(k);
    Bytes min2[8], max2[8];
    for (size_t k = 0; k < 8; ++k) {
      min2[k] = SEXTANT_MIN(p[2 * k], p[2 * k + 1]);
      max2[k] = SEXTANT_MAX(p[2 * k], p[2 * k + 1]);
    }
    Bytes min4[8], max4[8];
    for (size_t k = 0; k < 8; ++k) {
      min4[k] = SEXTANT_MIN(min2[k], min2[(k + 1) % 8]);
      max4[k] = SEXTANT_MAX(max2[k], max2[(k + 1) % 8]);
    }
    Bytes brightest = {};
    Bytes darkest = ~Bytes{};
    for (size_t k = 0; k < 8; ++k) {
      const Bytes before = p[(2 * k + 15) % 16];
      const Bytes after = p[(2 * k + 8) % 16];
      const Bytes min8 = SEXTANT_MIN(min4[k], min4[(k + 2) % 8]);
      const Bytes max8 = SEXTANT_MAX(max4[k], max4[(k + 2) % 8]);
      const Bytes outer_max = SEXTANT_MAX(before, after);
      const Bytes outer_min = SEXTANT_MIN(before, after);
      const Bytes min9 = SEXTANT_MIN(min8, outer_max);
      const Bytes max9 = SEXTANT_MAX(max8, outer_min);
      brightest = SEXTANT_MAX(brightest, min9);
      darkest = SEXTANT_MIN(darkest, max9);
    }
    const Bytes bright = SEXTANT_MAX(brightest, c) - c;
    const Bytes dark = c - SEXTANT_MIN(darkest, c);
    const Bytes contrast = SEXTANT_MAX(bright, dark);
    *out = contrast > t ? contrast - 1 : Bytes{};
  }
}

/// Computes maxima: the scores row[0 .. n) that exceed those of their 8 neighbours, 0 for all other pixels.
/// Writes whole blocks.
SEXTANT_SIMD void keep_maxima(const uint8_t* above, const uint8_t* row, const uint8_t* below, int n,
                              uint8_t* maxima) {
  for (int x = 0; x < n; x += block) {
    const auto load = [&](const uint8_t* scores) {
      return reinterpret_cast<const UnalignedBytes*>(scores + x);
    };
    const Bytes score = *load(row);
    Bytes strongest = *load(row - 1);
    for (const uint8_t* other :
         {row + 1, above - 1, above, above + 1, below - 1, below, static_cast<const uint8_t*>(below + 1)}) {
      const Bytes neighbour = *load(other);
      strongest = SEXTANT_MAX(strongest, neighbour);
    }
    *reinterpret_cast<UnalignedBytes*>(maxima + x) = score > strongest ? score : Bytes{};
  }
}

/// Appends the pixels with a score. Reads whole blocks.
void append_nonzero(const uint8_t* row, int n, int y, std::vector<Feature>& corners) {
  for (int x = 0; x < n; x += block) {
    Words words;
    std::memcpy(&words, row + x, sizeof(words));
    if (is_zero(words)) continue;  // true for most blocks
    for (int word = 0; word < 4; ++word) {
      for (uint64_t eight = words[word]; eight != 0;) {
        const int byte = std::countr_zero(eight) / 8, at = x + 8 * word + byte;
        if (at >= n) break;
        corners.push_back({at + radius, y, row[at]});
        eight &= ~(uint64_t{0xff} << (8 * byte));
      }
    }
  }
}

}  // namespace

std::vector<Feature> fast_corners(const Image<uint8_t>& gray, int threshold) {
  SEXTANT_CHECK(threshold > 0 && threshold < 255);
  std::vector<Feature> corners;
  const int width = gray.width() - 2 * radius;
  if (width <= 0 || gray.height() <= 2 * radius) return corners;
  // The last block of a row may extend beyond the end of the image, so the rows at the end are read from a
  // padded copy.
  const int beyond = block / gray.width() + 1;
  const int first_copied = std::max(gray.height() - 2 * radius - beyond, 0);
  const size_t before = static_cast<size_t>(first_copied) * gray.width();
  std::vector<uint8_t> last_rows(gray.size() - before + block);
  std::copy_n(gray.data() + before, gray.size() - before, last_rows.begin());
  const auto centre = [&](int y) {
    const bool is_inside = y + radius + beyond < gray.height();
    const size_t at = static_cast<size_t>(y) * gray.width() + radius;
    return is_inside ? gray.data() + at : last_rows.data() + (at - before);
  };
  // Three rows of scores with a margin on both sides, used in rotation.
  const size_t length = static_cast<size_t>(width) + 2 * block;
  std::vector<uint8_t> scores(3 * length);
  std::vector<uint8_t> maxima(length);
  const auto row = [&](int y) { return scores.data() + static_cast<size_t>(y % 3) * length + block; };
  for (int y = radius; y <= gray.height() - radius; ++y) {
    if (y < gray.height() - radius) {
      score_row(centre(y), gray.width(), width, threshold, row(y));
    } else {
      std::fill_n(row(y), width, uint8_t{0});
    }
    std::fill_n(row(y) + width, block - 1, uint8_t{0});
    keep_maxima(row(y - 2), row(y - 1), row(y), width, maxima.data());
    append_nonzero(maxima.data(), width, y - 1, corners);
  }
  return corners;
}

namespace {

double depth_at(const Image<float>& depth_m, const TargetPixel& target) {
  if (depth_m.empty()) return NAN;
  const float depth = depth_m(target.x, target.y);
  return valid_depth(depth) ? depth : NAN;
}

/// Returns true if no instance lies within `margin` px, checked at the centre, the corners and the edge
/// centres of the square.
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

/// Rectangle of pixels: columns first_x .. last_x and rows first_y .. last_y; initially empty.
struct Box {
  int first_x = INT_MAX / 2, last_x = -INT_MAX / 2;
  int first_y = INT_MAX / 2, last_y = -INT_MAX / 2;

  void add(const Box& other) {
    first_x = std::min(first_x, other.first_x), last_x = std::max(last_x, other.last_x);
    first_y = std::min(first_y, other.first_y), last_y = std::max(last_y, other.last_y);
  }
  bool contains(int x, int y, int margin) const {
    return x >= first_x - margin && x <= last_x + margin && y >= first_y - margin && y <= last_y + margin;
  }
};

/// The instances of a mask and their bounding boxes.
class Instances {
 public:
  struct Instance {
    size_t pixels = 0;
    Box box;
  };

  explicit Instances(const Image<uint16_t>& mask) {
    const int width = mask.width();
    for (int y = 0; y < mask.height(); ++y) {
      const uint16_t* row = mask.row(y);
      for (int begin = 0; begin < width;) {  // masks consist of long runs
        const uint16_t id = row[begin];
        const Words run = Words{} + id * uint64_t{0x0001000100010001};
        constexpr int step = block / static_cast<int>(sizeof(id));
        int end = begin + 1;
        for (Words next; end + step <= width; end += step) {
          std::memcpy(&next, row + end, sizeof(next));
          if (!is_zero(next ^ run)) break;
        }
        while (end < width && row[end] == id) ++end;
        if (id != 0) {
          Instance& instance = by_id_[id];
          instance.pixels += static_cast<size_t>(end - begin);
          instance.box.add({begin, end - 1, y, y});
        }
        begin = end;
      }
    }
    for (const auto& [id, instance] : by_id_) {
      boxes_.push_back(instance.box);
      around_.add(instance.box);
    }
  }

  const std::map<int, Instance>& by_id() const { return by_id_; }
  /// Returns true if (x, y) lies within `margin` px of the box of an instance; otherwise the mask need not be
  /// read.
  bool is_near(int x, int y, int margin) const {
    return around_.contains(x, y, margin) && std::any_of(boxes_.begin(), boxes_.end(), [&](const Box& box) {
             return box.contains(x, y, margin);
           });
  }
  /// Bounding box of all instances.
  const Box& around() const { return around_; }

 private:
  std::map<int, Instance> by_id_;
  std::vector<Box> boxes_;
  Box around_;
};

/// Keeps the features for which `keep` returns true. Their pixels are scattered over the images, so that
/// memory latency dominates: `fetch` prefetches the memory of a feature some iterations ahead.
template <typename Fetch, typename Keep>
void filter(std::vector<Feature>& features, Fetch&& fetch, Keep&& keep) {
  constexpr size_t ahead = 64;
  size_t kept = 0;
  for (size_t i = 0; i < features.size(); ++i) {
    if (i + ahead < features.size()) fetch(features[i + ahead]);
    const Feature feature = features[i];
    if (keep(feature)) features[kept++] = feature;
  }
  features.resize(kept);
}

Correspondences extract_background(const Frame& prev, const Frame& curr, const Instances& instances_prev,
                                   const Instances& instances_curr, const ExtractionOptions& options) {
  const int width = prev.gray.width();
  const int height = prev.gray.height();
  const int margin = options.mask_margin_px;
  const auto target_of = [&](const Feature& f) {
    return target_pixel(f.x, f.y, prev.flow(f.x, f.y), width, height);
  };
  std::vector<Feature> corners = fast_corners(prev.gray, options.fast_threshold);
  filter(
      corners, [&](const Feature& f) { __builtin_prefetch(&prev.depth_m(f.x, f.y)); },
      [&](const Feature& f) {
        const float depth = prev.depth_m(f.x, f.y);
        return valid_depth(depth) && depth <= options.max_static_depth_m;
      });
  filter(
      corners, [&](const Feature& f) { __builtin_prefetch(&prev.flow(f.x, f.y)); },
      [&](const Feature& f) {
        const bool off =
            !instances_prev.is_near(f.x, f.y, margin) || off_instances(prev.mask, f.x, f.y, margin);
        return off && target_of(f).inside;
      });
  filter(
      corners,
      [&](const Feature& f) {
        const TargetPixel target = target_of(f);
        if (!curr.depth_m.empty()) __builtin_prefetch(&curr.depth_m(target.x, target.y));
      },
      [&](const Feature& f) {
        const TargetPixel target = target_of(f);
        return !instances_curr.is_near(target.x, target.y, 0) || curr.mask(target.x, target.y) == 0;
      });
  Correspondences points;
  for (const Feature& f : strongest_per_cell(corners, width, height, options)) {
    const Flow& flow = prev.flow(f.x, f.y);
    const TargetPixel target = target_of(f);
    points.push_back(f.x, f.y, prev.depth_m(f.x, f.y), flow.u, flow.v, depth_at(curr.depth_m, target));
  }
  return points;
}

/// Returns all instances of the current mask. Their points are samples of the previous image whose flow ends
/// on the instance: pixel (x, y), depth there, flow, and depth of the current frame at the target pixel,
/// which is the pixel nearest to (x, y) + flow.
std::vector<ObjectObservation> extract_objects(const Frame& prev, const Frame& curr,
                                               const Instances& instances, const ExtractionOptions& options) {
  const int width = prev.mask.width();
  const int height = prev.mask.height();
  std::map<int, ObjectObservation> objects;
  for (const auto& [id, instance] : instances.by_id()) {
    ObjectObservation& object = objects[id];
    object.instance = id;
    object.area_fraction = static_cast<double>(instance.pixels) / (static_cast<double>(width) * height);
    object.points.reserve(instance.pixels / static_cast<size_t>(options.object_step_px) /
                          options.object_step_px);
  }
  const auto left = static_cast<float>(instances.around().first_x) - 1;
  const auto right = static_cast<float>(instances.around().last_x) + 1;
  const auto top = static_cast<float>(instances.around().first_y) - 1;
  const auto bottom = static_cast<float>(instances.around().last_y) + 1;
  for (int y = 0; y < height; y += options.object_step_px) {
    const Flow* flows = prev.flow.row(y);
    for (int x = 0; x < width; x += options.object_step_px) {
      const Flow& flow = flows[x];
      const float u = static_cast<float>(x) + flow.u;
      const float v = static_cast<float>(y) + flow.v;
      if (!(u > left && u < right && v > top && v < bottom)) continue;  // true for most pixels
      const TargetPixel target = target_pixel(x, y, flow, width, height);
      if (!target.inside || curr.mask(target.x, target.y) == 0) continue;
      ObjectObservation& object = objects.at(curr.mask(target.x, target.y));
      const uint16_t from = prev.mask(x, y);
      if (from == 0) {
        ++object.n_background;
      } else if (valid_depth(prev.depth_m(x, y))) {
        object.points.push_back(x, y, prev.depth_m(x, y), flow.u, flow.v, depth_at(curr.depth_m, target));
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

std::vector<Feature> strongest_per_cell(const std::vector<Feature>& corners, int width, int height,
                                        const ExtractionOptions& options) {
  const int columns = (width + options.cell_px - 1) / options.cell_px;
  const int rows = (height + options.cell_px - 1) / options.cell_px;
  const auto cell_of = [&](const Feature& f) {
    return static_cast<size_t>(f.y / options.cell_px) * columns + f.x / options.cell_px;
  };
  // Counting sort by cell.
  std::vector<size_t> begin(static_cast<size_t>(columns) * rows + 1, 0);
  for (const Feature& corner : corners) ++begin[cell_of(corner) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Feature> by_cell(corners.size());
  std::vector<size_t> next(begin.begin(), begin.end() - 1);
  for (const Feature& corner : corners) by_cell[next[cell_of(corner)]++] = corner;

  const auto stronger = [](const Feature& a, const Feature& b) {
    return std::tuple(b.response, a.y, a.x) < std::tuple(a.response, b.y, b.x);
  };
  std::vector<Feature> features;
  for (size_t cell = 0; cell + 1 < begin.size(); ++cell) {
    const auto first = by_cell.begin() + static_cast<std::ptrdiff_t>(begin[cell]);
    const auto last = by_cell.begin() + static_cast<std::ptrdiff_t>(begin[cell + 1]);
    const auto end = first + std::min<std::ptrdiff_t>(last - first, options.features_per_cell);
    std::partial_sort(first, end, last, stronger);
    features.insert(features.end(), first, end);
  }
  return features;
}

FramePair extract_frame_pair(const Frame& prev, const Frame& curr, const StereoCamera& camera, double dt_s,
                             const ExtractionOptions& options) {
  check_frame(prev, true);
  check_frame(curr, false);
  FramePair pair{.prev = prev.index,
                 .curr = curr.index,
                 .dt_s = dt_s,
                 .width = prev.gray.width(),
                 .height = prev.gray.height(),
                 .camera = camera};
  const Instances instances_prev(prev.mask);
  const Instances instances_curr(curr.mask);
  pair.background = extract_background(prev, curr, instances_prev, instances_curr, options);
  pair.objects = extract_objects(prev, curr, instances_curr, options);
  for (const auto& [id, instance] : instances_prev.by_id()) {
    if (!instances_curr.by_id().contains(id)) pair.lost_instances.push_back(id);
  }
  return pair;
}

}  // namespace sextant
