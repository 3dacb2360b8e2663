// Consistency of the channels of rendered frames.

#include <algorithm>
#include <cmath>

#include "sextant/base/quantile.h"
#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/datasets/testing.h"

namespace sextant {
namespace {

class RenderedChannels : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<Sequence> sequence_ = open_uncached("synthetic:" + GetParam());
  const SequenceInfo& info_ = sequence_->info();
};

/// Bilinear interpolation; nullopt unless all four pixels are valid and have equal depth within 2 %.
std::optional<Flow> flow_at(const Frame& frame, const Image<Flow>& flow, double x, double y) {
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (!flow.contains(x0, y0) || !flow.contains(x0 + 1, y0 + 1)) return std::nullopt;
  const double a = x - x0, b = y - y0;
  double u = 0, v = 0;
  const double z0 = frame.depth_m(x0, y0);
  for (const auto& [i, j, w] :
       {std::tuple(0, 0, (1 - a) * (1 - b)), {1, 0, a * (1 - b)}, {0, 1, (1 - a) * b}, {1, 1, a * b}}) {
    const Flow& f = flow(x0 + i, y0 + j);
    if (!f.valid() || frame.mask(x0 + i, y0 + j) != frame.mask(x0, y0)) return std::nullopt;
    if (!(std::abs(frame.depth_m(x0 + i, y0 + j) - z0) < 0.02 * z0)) return std::nullopt;
    u += w * static_cast<double>(f.u);
    v += w * static_cast<double>(f.v);
  }
  return Flow{static_cast<float>(u), static_cast<float>(v)};
}

/// Depths of the nearest and the farthest surface at the four pixels around (x, y); the sky is at infinity.
std::pair<double, double> depths_around(const Image<float>& depth_m, double x, double y) {
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  double nearest = INFINITY, farthest = 0;
  for (const auto& [i, j] : {std::pair(0, 0), {1, 0}, {0, 1}, {1, 1}}) {
    const double z =
        depth_m(std::clamp(left + i, 0, depth_m.width() - 1), std::clamp(top + j, 0, depth_m.height() - 1));
    nearest = std::min(nearest, std::isnan(z) ? INFINITY : z);
    farthest = std::max(farthest, std::isnan(z) ? INFINITY : z);
  }
  return {nearest, farthest};
}

TEST_P(RenderedChannels, VisiblePixelsComeBackAndHiddenOnesAreCovered) {
  const int k = info_.first_frame + 2;
  const auto pair = open_uncached(fmt::format("synthetic:{}@{}-{}", GetParam(), k, k + 1));
  const Frame here = pair->read(k, {.depth = true, .flow = true, .mask = true});
  const Frame next = pair->read(k + 1, {.depth = true, .backward_flow = true, .mask = true});
  int n_inside = 0, n_visible = 0, n_back = 0, n_hidden = 0, n_seen_through = 0;
  for (const auto [x, y] : PixelRange(info_.width, info_.height)) {
    const Flow& flow = here.flow(x, y);
    if (!flow.valid()) continue;
    const double to_x = x + static_cast<double>(flow.u), to_y = y + static_cast<double>(flow.v);
    const auto [i, j, inside] = target_pixel(x, y, flow, info_.width, info_.height);
    if (!inside) continue;
    const int id = here.mask(x, y);
    const auto motion =
        id == 0 ? pair->truth().background_motion(k, k + 1) : pair->truth().object_motion(id, k, k + 1);
    if (!motion) continue;
    const double depth_m = (*motion * info_.camera.left.backproject(x, y, here.depth_m(x, y))).z();
    ++n_inside;
    // Where the next frame does not show the point, it shows a nearer surface.
    const auto [nearest_m, farthest_m] = depths_around(next.depth_m, to_x, to_y);
    const double tolerance_m = std::max(0.03, 0.005 * depth_m);
    n_hidden += farthest_m < depth_m - tolerance_m ? 1 : 0;
    n_seen_through += nearest_m > depth_m + tolerance_m ? 1 : 0;
    const auto back = flow_at(next, next.backward_flow, to_x, to_y);
    if (!back || next.mask(i, j) != id || std::abs(next.depth_m(i, j) - depth_m) > 0.02 * depth_m) continue;
    ++n_visible;
    n_back +=
        std::hypot(to_x + static_cast<double>(back->u) - x, to_y + static_cast<double>(back->v) - y) < 0.02;
  }
  EXPECT_GT(n_visible, 100000);
  EXPECT_GT(n_back, 0.99 * n_visible);  // the rest lies on edges between planes
  EXPECT_GT(n_hidden, 20);
  EXPECT_LT(n_seen_through, 0.01 * n_inside);  // surfaces that are thinner than a pixel
  RecordProperty("visible_returning", fmt::format("{:.5f}", 1.0 * n_back / n_visible));
  RecordProperty("hidden", n_hidden);
  RecordProperty("seen_through", fmt::format("{:.5f}", 1.0 * n_seen_through / n_inside));
}

TEST_P(RenderedChannels, RightImageIsTheLeftOneShiftedByDisparity) {
  const Frame frame = sequence_->read(info_.first_frame + 1, {.rgb = true, .rgb_right = true, .depth = true});
  ASSERT_EQ(frame.rgb_right.width(), info_.width);
  std::vector<double> shifted, unshifted;
  for (int y = 0; y < info_.height; y += 2) {
    for (int x = 0; x < info_.width; x += 2) {
      const double depth_m = frame.depth_m(x, y);
      if (!std::isfinite(depth_m)) continue;
      const double right_x = x - info_.camera.disparity_px(depth_m);
      const int x0 = static_cast<int>(std::floor(right_x));
      if (x0 < 0 || x0 + 1 >= info_.width) continue;
      const double a = right_x - x0;
      const double there = (1 - a) * frame.rgb_right(x0, y).g + a * frame.rgb_right(x0 + 1, y).g;
      shifted.push_back(std::abs(there - frame.rgb(x, y).g));
      unshifted.push_back(std::abs(frame.rgb_right(x, y).g - static_cast<double>(frame.rgb(x, y).g)));
    }
  }
  ASSERT_GT(shifted.size(), 50000U);
  EXPECT_LT(upper_median(shifted), 4.0);
  EXPECT_LT(2 * upper_median(shifted), upper_median(unshifted));
  RecordProperty("median_gray", fmt::format("{:.2f}", upper_median(shifted)));
}

TEST_P(RenderedChannels, FirstAndLastFramesLackTheirNeighbours) {
  constexpr Channels neighbours{.flow = true, .backward_flow = true};
  const Frame first = sequence_->read(info_.first_frame, neighbours),
              last = sequence_->read(info_.last_frame, neighbours);
  EXPECT_TRUE(first.backward_flow.empty());
  EXPECT_FALSE(first.flow.empty());
  EXPECT_TRUE(last.flow.empty());
  EXPECT_FALSE(last.backward_flow.empty());
}

INSTANTIATE_TEST_SUITE_P(All, RenderedChannels, testing::ValuesIn(synthetic::scenario_names()),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace sextant
