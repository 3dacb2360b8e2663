#include "sextant/noise/noise.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "sextant/base/registry.h"
#include "sextant/noise/stored_profiles.h"

namespace sextant {
namespace {

constexpr const char* correlation_key = "correlation";

void refuse_unknown_keys(const Json& options) {
  std::vector<std::string> known;
  for (const NoiseModelEntry& entry : noise_models()) known.push_back(entry.name);
  for (const char* key : {correlation_key, "profile", "scale"}) known.emplace_back(key);
  for (const auto& item : options.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      fail("unknown option key 'noise.{}': {}", item.key(), suggest(item.key(), known));
    }
  }
}

}  // namespace

Noise::Noise(const Json& given) {
  if (!given.is_object()) fail("option noise: expected an object, got {}", json_excerpt(given));
  const Json options = without_profile(given);
  refuse_unknown_keys(options);
  if (options.contains(correlation_key))
    correlation_ = NoiseCorrelation::read(options.at(correlation_key), "noise.correlation");
  for (const NoiseModelEntry& entry : noise_models()) {
    if (!options.contains(entry.name)) continue;
    std::shared_ptr<const NoiseModel> model = entry.make(options.at(entry.name));
    if (model->changes_depth() || model->changes_flow() || model->changes_masks())
      models_.push_back({entry.name, std::move(model)});
  }
}

Noise Noise::parse(std::string_view text) {
  if (text.empty() || text == "none") return Noise();
  try {
    return Noise(parse_json(text, "noise"));
  } catch (const Error& error) {
    fail("{}: expected none or an object such as {}", error.what(), R"({"depth":{"delta_d_px":0.2}})");
  }
}

Json Noise::options() const {
  Json json = Json::object();
  for (const NamedModel& named : models_) json[named.key] = named.model->options();
  if (!none()) json[correlation_key] = correlation_.json();
  return json;
}

std::string Noise::name() const {
  std::string text;
  for (const NamedModel& named : models_) text += (text.empty() ? "" : " + ") + named.model->name();
  return text.empty() ? "none" : text + correlation_.name();
}

bool Noise::changes_masks() const {
  return std::any_of(models_.begin(), models_.end(), [](const auto& m) { return m.model->changes_masks(); });
}

Noise Noise::without_masks() const {
  Noise rest = *this;
  std::erase_if(rest.models_, [](const auto& m) { return m.model->changes_masks(); });
  return rest;
}

Noise Noise::only_masks() const {
  Noise masks = *this;
  std::erase_if(masks.models_, [](const auto& m) { return !m.model->changes_masks(); });
  return masks;
}

void Noise::corrupt_mask(Image<uint16_t>& mask) const {
  for (const NamedModel& named : models_) named.model->corrupt_mask(mask);
}

double Noise::depth_sigma_m(const StereoCamera& camera, double depth_m) const {
  double variance = 0;
  for (const NamedModel& named : models_) {
    const double sigma = named.model->depth_sigma_m(camera, depth_m);
    variance += sigma * sigma;
  }
  return std::sqrt(variance);
}

FlowSigma Noise::flow_sigma(int body) const {
  FlowSigma variance;
  for (const NamedModel& named : models_) {
    const FlowSigma sigma = named.model->flow_sigma(body);
    variance.x_px += sigma.x_px * sigma.x_px;
    variance.y_px += sigma.y_px * sigma.y_px;
  }
  return {std::sqrt(variance.x_px), std::sqrt(variance.y_px)};
}

MeasurementNoise Noise::declared(const StereoCamera& camera, int body) const {
  constexpr double unit_m = 1;  // every depth model is quadratic in depth
  const FlowSigma flow = flow_sigma(body);
  MeasurementNoise noise{flow.x_px, flow.y_px};
  double depth_variance = std::pow(depth_sigma_m(camera, unit_m), 2);
  bool rounded = false;
  for (const NamedModel& named : models_) {
    const double rounding = named.model->depth_rounding_sigma_m(camera, unit_m);
    depth_variance += rounding * rounding;
    rounded = rounded || rounding > 0;
    noise.flow_outlier_share = 1 - (1 - noise.flow_outlier_share) * (1 - named.model->outlier_share());
  }
  noise.inverse_depth_per_m = std::sqrt(depth_variance);
  noise.correlation = correlation_.spatial();
  noise.independent_gaussian = !rounded && noise.flow_outlier_share == 0 && correlation_.independent();
  return noise;
}

std::vector<OptionHelp> describe_noise_options() {
  std::vector<OptionHelp> lines;
  for (const NoiseModelEntry& entry : noise_models()) {
    for (OptionHelp& line : entry.options()) lines.push_back(std::move(line));
  }
  lines.push_back(
      {"noise.correlation", "\"independent\"", "",
       "independent, shared_per_frame or spatial: {\"model\": \"spatial\", \"lengths_px\": [...], "
       "\"shares\": [...]}"});
  lines.push_back({"noise.profile", "", "",
                   fmt::format("noise as measured, instead of the options above: {}; or a file that "
                               "`sextant noise fit` wrote",
                               fmt::join(noise_profile_names(), ", "))});
  lines.push_back({"noise.scale", "1", "1", "factor on every size of the profile"});
  return lines;
}

}  // namespace sextant
