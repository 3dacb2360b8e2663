#include "sextant/noise/flow_noise.h"

#include <charconv>
#include <cmath>
#include <numbers>

namespace sextant {
namespace {

constexpr std::string_view object_prefix = "object:";

/// The id of "object:ID"; 0 when `key` is no such text.
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
  level(epe_px, "flow.epe_px");
  level(epe_x_px, "flow.epe_x_px");
  level(epe_y_px, "flow.epe_y_px");
  check_option(epe_px == 0 || (epe_x_px == 0 && epe_y_px == 0), "flow.epe_px", epe_px,
               "0 where epe_x_px or epe_y_px is given");
}

void FlowNoiseOptions::check() const {
  level.check();
  check_option(scale >= 0 && std::isfinite(scale), "flow.scale", scale, ">= 0");
  for (const auto& [key, body] : bodies) {
    body.check();
    check_option(key == "background" || key == "objects" || object_id(key) > 0, "flow.bodies key", key,
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

}  // namespace sextant
