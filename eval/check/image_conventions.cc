#include <algorithm>
#include <cmath>

#include "sextant/eval/check/conventions.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

// The limits are explained in docs/datasets.md.
constexpr double min_flow_px = 2;         // shorter flow hardly changes the grey value
constexpr double min_difference = 8;      // levels; below, the noise of the images hides the flow
constexpr double capped_difference = 60;  // levels; of occlusions and reflections
constexpr size_t min_samples = 200;
constexpr double flow_limit = 0.8, flow_fail_limit = 0.95;

/// Returns the grey value at (x, y), interpolated linearly; (x, y) must not lie in the last row or column.
double grey_at(const Image<uint8_t>& gray, double x, double y) {
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const double right = x - i, below = y - j;
  return (1 - below) * ((1 - right) * gray(i, j) + right * gray(i + 1, j)) +
         below * ((1 - right) * gray(i, j + 1) + right * gray(i + 1, j + 1));
}

/// Returns the mean absolute deviation from the median, which is a change of the exposure.
double mean_difference(const std::vector<double>& differences) {
  const double exposure = median(differences);
  double sum = 0;
  for (const double d : differences) sum += std::min(std::abs(d - exposure), capped_difference);
  return sum / static_cast<double>(differences.size());
}

bool has_size(const GridFrame& frame, const ConventionData& data) {
  return frame.gray && frame.gray->width() == data.width && frame.gray->height() == data.height;
}

}  // namespace

Finding check_image_flow(const ConventionData& data) {
  Finding finding{.check = "image flow",
                  .limit = flow_limit,
                  .fail_limit = flow_fail_limit,
                  .unit = "x",
                  .counted = "pairs"};
  std::vector<double> ratios;
  bool any_images = false, any_flow = false;
  for (int k = data.first_frame; k <= data.last_frame(); ++k) {
    const int from = k + data.flow_from, to = k + data.flow_to;
    if (!data.has(from) || !data.has(to) || !has_size(data.at(from), data) || !has_size(data.at(to), data))
      continue;
    any_images = true;
    const Image<uint8_t>&before = *data.at(from).gray, &after = *data.at(to).gray;
    const Image<Flow>& flow = data.at(k).flow;
    any_flow |= !flow.empty();
    std::vector<double> with_flow, without;
    for (const auto [i, j] : pixels(flow)) {
      const Flow f = flow(i, j);
      if (!f.valid() || std::hypot(double{f.u}, double{f.v}) < min_flow_px) continue;
      const int x = static_cast<int>(data.pixel(i)), y = static_cast<int>(data.pixel(j));
      const double u = x + double{f.u}, v = y + double{f.v};
      if (!(u >= 0 && v >= 0 && u < data.width - 1 && v < data.height - 1) || !before.contains(x, y))
        continue;
      with_flow.push_back(grey_at(after, u, v) - before(x, y));
      without.push_back(static_cast<double>(after(x, y)) - before(x, y));
    }
    if (without.size() < min_samples) continue;
    const double still = mean_difference(without);
    if (still >= min_difference) ratios.push_back(mean_difference(with_flow) / still);
  }
  if (!finding.measure(ratios)) {
    return finding.not_checkable(!any_images ? "no successive images"
                                 : !any_flow ? "no flow"
                                             : "the flow is too short, or the images are too smooth");
  }
  if (!finding.passes()) {
    finding.message =
        "with the flow, successive images agree no better than without: are images or flow of another "
        "sequence, frame or size?";
  }
  return finding;
}

std::vector<int> frames_with_repeated_image(const ConventionData& data) {
  std::vector<int> repeated;
  for (int k = data.first_frame; k < data.last_frame(); ++k) {
    if (!has_size(data.at(k), data) || !has_size(data.at(k + 1), data)) continue;
    const Image<uint8_t>&before = *data.at(k).gray, &after = *data.at(k + 1).gray;
    const bool same = std::equal(before.data(), before.data() + before.size(), after.data());
    if (same && flow_shows_motion(data.at(k))) repeated.push_back(k + 1);
  }
  return repeated;
}

}  // namespace sextant
