#include "sextant/noise/models.h"

#include <charconv>
#include <cmath>
#include <numbers>

#include "sextant/noise/draws.h"

namespace sextant {

double focal_baseline(const StereoCamera& camera, double baseline_m) {
  const double bf = baseline_m > 0 ? camera.left.fx * baseline_m : camera.bf;
  if (!(bf > 0)) {
    fail(
        "noise: the source has no stereo baseline (bf = {}): set depth.baseline_m, and "
        "quantisation.baseline_m if that model is used, to a baseline in m",
        bf);
  }
  return bf;
}

void DepthNoiseOptions::check() const {
  check_option(delta_d_px >= 0 && std::isfinite(delta_d_px), "delta_d_px", delta_d_px, ">= 0");
  check_option(baseline_m >= 0 && std::isfinite(baseline_m), "baseline_m", baseline_m, ">= 0");
}

std::string DepthNoise::name() const {
  if (!changes_depth()) return "";
  std::string text = fmt::format("depth {} px", options_.delta_d_px);
  if (options_.baseline_m == 0) {
    text += " at the source's bf";
  } else if (options_.baseline_m != DepthNoiseOptions{}.baseline_m) {
    text += fmt::format(" at b {} m", options_.baseline_m);
  }
  return text;
}

double DepthNoise::depth_sigma_m(const StereoCamera& camera, double depth_m) const {
  if (!changes_depth()) return 0;
  return depth_m * depth_m / focal_baseline(camera, options_.baseline_m) * options_.delta_d_px;
}

void DepthNoise::corrupt_depth(const NoiseContext& context, const PixelBatch& pixels,
                               std::span<double> depth_m) const {
  if (!changes_depth()) return;
  const double scale = options_.delta_d_px / focal_baseline(context.camera, options_.baseline_m);
  std::vector<double> normal(pixels.size()), unused(pixels.size());
  context.normals(NoiseChannel::depth, pixels, normal, unused);
  for (size_t i = 0; i < pixels.size(); ++i) {
    depth_m[i] += depth_m[i] * depth_m[i] * scale * normal[i];
  }
}

namespace {

constexpr std::string_view object_prefix = "object:";

/// Returns the id of "object:ID"; 0 if `key` does not have this form.
int object_id(std::string_view key) {
  if (!key.starts_with(object_prefix)) return 0;
  key.remove_prefix(object_prefix.size());
  int id = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), id);
  const bool canonical = error == std::errc() && end == key.data() + key.size() && key.front() != '0';
  return canonical && id > 0 && id <= 65535 ? id : 0;
}

bool is_zero(const FlowLevel& level) {
  return level.epe_px == 0 && level.epe_x_px == 0 && level.epe_y_px == 0;
}

std::string text_of(const FlowLevel& level) {
  if (level.epe_px > 0) return fmt::format("{} px", level.epe_px);
  return fmt::format("{}/{} px", level.epe_x_px, level.epe_y_px);
}

}  // namespace

void FlowLevel::check() const {
  const auto level = [](double value, const char* name) {
    check_option(value >= 0 && std::isfinite(value), name, value, ">= 0");
  };
  level(epe_px, "epe_px");
  level(epe_x_px, "epe_x_px");
  level(epe_y_px, "epe_y_px");
  check_option(epe_px == 0 || (epe_x_px == 0 && epe_y_px == 0), "epe_px", epe_px,
               "0 if epe_x_px or epe_y_px is given");
}

void FlowNoiseOptions::check() const {
  level.check();
  check_option(scale >= 0 && std::isfinite(scale), "scale", scale, ">= 0");
  for (const auto& [key, body] : bodies) {
    body.check();
    check_option(key == "background" || key == "objects" || object_id(key) > 0, "bodies key", key,
                 "background, objects or object:ID with an instance id of 1..65535");
  }
}

FlowNoise::FlowNoise(const FlowNoiseOptions& options) : WithOptions(options) {
  of_background_ = of_objects_ = sigma_of(options_.level);
  for (const auto& [key, level] : options_.bodies) {
    if (key == "background") of_background_ = sigma_of(level);
    if (key == "objects") of_objects_ = sigma_of(level);
    if (const int id = object_id(key); id > 0) by_body_[id] = sigma_of(level);
  }
}

FlowSigma FlowNoise::sigma_of(const FlowLevel& level) const {
  const bool mean_error = options_.reading == EpeReading::epe_is_mean_error;
  const double factor = mean_error ? std::sqrt(std::numbers::pi / 2) : 1;
  if (level.epe_px > 0) {
    const double sigma_px = options_.scale * level.epe_px / factor;
    return {sigma_px, sigma_px};
  }
  return {options_.scale * level.epe_x_px * factor, options_.scale * level.epe_y_px * factor};
}

FlowSigma FlowNoise::flow_sigma(int body) const {
  if (body == 0) return of_background_;
  const auto it = by_body_.find(body);
  return it == by_body_.end() ? of_objects_ : it->second;
}

bool FlowNoise::changes_flow() const {
  if (options_.scale == 0) return false;
  bool all_zero = is_zero(options_.level);
  for (const auto& [key, level] : options_.bodies) all_zero = all_zero && is_zero(level);
  return !all_zero;
}

std::string FlowNoise::name() const {
  if (!changes_flow()) return "";
  std::string text = "flow " + text_of(options_.level);
  for (const auto& [key, level] : options_.bodies) text += fmt::format(", {} {}", key, text_of(level));
  if (options_.scale != 1) text += fmt::format(", x {}", options_.scale);
  if (options_.reading == EpeReading::epe_is_mean_error) text += ", mean error";
  return text;
}

void FlowNoise::corrupt_flow(const NoiseContext& context, const PixelBatch& pixels,
                             const FlowBatch& flow) const {
  if (!changes_flow()) return;
  std::vector<double> x(pixels.size()), y(pixels.size());
  context.normals(flow.backward ? NoiseChannel::backward_flow : NoiseChannel::flow, pixels, x, y);
  FlowSigma sigma = flow_sigma(0);
  int body = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (flow.body[i] != body) {
      body = flow.body[i];
      sigma = flow_sigma(body);
    }
    flow.u[i] += sigma.x_px * x[i];
    flow.v[i] += sigma.y_px * y[i];
  }
}

void FlowOutlierOptions::check() const {
  check_option(share >= 0 && share <= 1, "share", share, "in 0..1");
  check_option(radius_px > 0 && std::isfinite(radius_px), "radius_px", radius_px, "> 0");
}

std::string FlowOutliers::name() const {
  if (!changes_flow()) return "";
  return fmt::format("outliers {:.6g} % in {} {} px", options_.share * 100, to_string(options_.shape),
                     options_.radius_px);
}

void FlowOutliers::corrupt_flow(const NoiseContext& context, const PixelBatch& pixels,
                                const FlowBatch& flow) const {
  if (!changes_flow()) return;
  const auto channel = flow.backward ? NoiseChannel::backward_outlier : NoiseChannel::outlier;
  const auto offset = flow.backward ? NoiseChannel::backward_outlier_offset : NoiseChannel::outlier_offset;
  std::vector<double> chance(pixels.size()), unused(pixels.size());
  context.draws.uniforms(channel, pixels, chance, unused);
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (chance[i] > options_.share) continue;
    const auto [a, b] = context.draws.uniforms(offset, pixels.frame, pixels.x[i], pixels.y[i]);
    flow.is_outlier[i] = 1;
    if (options_.shape == OutlierShape::box) {
      flow.u[i] += options_.radius_px * (2 * a - 1);
      flow.v[i] += options_.radius_px * (2 * b - 1);
    } else {
      const double radius_px = options_.radius_px * std::sqrt(a);
      const internal::SineCosine angle = internal::sine_cosine_turns(b);
      flow.u[i] += radius_px * angle.cosine;
      flow.v[i] += radius_px * angle.sine;
    }
  }
}

namespace {

struct Offset {
  int dx;
  int dy;
};

constexpr Offset offsets[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}};

/// Calls body(id) for the id of every neighbour inside the image.
template <typename Body>
void for_neighbours(const Image<uint16_t>& mask, int x, int y, int neighbours, Body body) {
  for (const Offset& offset : std::span(offsets).first(neighbours)) {
    if (mask.contains(x + offset.dx, y + offset.dy)) body(mask(x + offset.dx, y + offset.dy));
  }
}

uint16_t eroded(const Image<uint16_t>& mask, int x, int y, int neighbours) {
  const uint16_t id = mask(x, y);
  bool edge = false;
  for_neighbours(mask, x, y, neighbours, [&](uint16_t other) { edge = edge || other != id; });
  return edge ? 0 : id;
}

uint16_t dilated(const Image<uint16_t>& mask, int x, int y, int neighbours) {
  uint16_t smallest = 0;
  for_neighbours(mask, x, y, neighbours, [&](uint16_t other) {
    if (other != 0 && (smallest == 0 || other < smallest)) smallest = other;
  });
  return smallest;
}

template <typename Step>
void repeat(Image<uint16_t>& mask, int times, Step step) {
  for (int i = 0; i < times; ++i) {
    Image<uint16_t> next = mask;
    for (int y = 0; y < mask.height(); ++y) {
      for (int x = 0; x < mask.width(); ++x) step(mask, next, x, y);
    }
    if (next == mask) return;
    mask = std::move(next);
  }
}

}  // namespace

void MaskNoiseOptions::check() const {
  check_option(erode_px >= 0, "erode_px", erode_px, ">= 0");
  check_option(dilate_px >= 0, "dilate_px", dilate_px, ">= 0");
  check_option(neighbours == 4 || neighbours == 8, "neighbours", neighbours, "4 or 8");
}

std::string MaskNoise::name() const {
  if (!changes_masks()) return "";
  std::string text = "mask";
  if (options_.erode_px > 0) text += fmt::format(" eroded {} px", options_.erode_px);
  if (options_.dilate_px > 0) text += fmt::format(" dilated {} px", options_.dilate_px);
  if (options_.neighbours != MaskNoiseOptions{}.neighbours)
    text += fmt::format(" by {}", options_.neighbours);
  return text;
}

void MaskNoise::corrupt_mask(Image<uint16_t>& mask) const {
  const int n = options_.neighbours;
  repeat(mask, options_.erode_px, [n](const Image<uint16_t>& from, Image<uint16_t>& to, int x, int y) {
    if (from(x, y) != 0) to(x, y) = eroded(from, x, y, n);
  });
  repeat(mask, options_.dilate_px, [n](const Image<uint16_t>& from, Image<uint16_t>& to, int x, int y) {
    if (from(x, y) == 0) to(x, y) = dilated(from, x, y, n);
  });
}

void QuantisationOptions::check() const {
  check_option(step_px >= 0 && std::isfinite(step_px), "step_px", step_px, ">= 0");
  check_option(baseline_m >= 0 && std::isfinite(baseline_m), "baseline_m", baseline_m, ">= 0");
}

std::string Quantisation::name() const {
  if (!changes_depth()) return "";
  std::string text = fmt::format("disparity step {} px", options_.step_px);
  if (options_.baseline_m > 0) text += fmt::format(" at b {} m", options_.baseline_m);
  return text;
}

double Quantisation::depth_rounding_sigma_m(const StereoCamera& camera, double depth_m) const {
  if (!changes_depth()) return 0;
  return depth_m * depth_m / focal_baseline(camera, options_.baseline_m) * options_.step_px / std::sqrt(12.0);
}

void Quantisation::corrupt_depth(const NoiseContext& context, const PixelBatch& pixels,
                                 std::span<double> depth_m) const {
  if (!changes_depth()) return;
  const double bf = focal_baseline(context.camera, options_.baseline_m);
  for (size_t i = 0; i < pixels.size(); ++i) {
    const double steps = std::round(bf / depth_m[i] / options_.step_px);
    depth_m[i] = depth_m[i] > 0 && steps > 0 ? bf / (steps * options_.step_px) : NAN;
  }
}

}  // namespace sextant
