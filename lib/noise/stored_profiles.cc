#include "sextant/noise/stored_profiles.h"

#include <cmath>

#include "sextant/base/files.h"
#include "sextant/base/options.h"
#include "sextant/noise/noise.h"

namespace sextant {

std::span<const EmbeddedFile> noise_profile_files();

namespace {

Json read_profile(const std::string& name) {
  if (name.ends_with(".json")) return parse_json(read_file(name), name);
  for (const EmbeddedFile& file : noise_profile_files())
    if (file.name == name) return parse_json(file.text, name);
  fail("option noise.profile = {}: {}; or give a file, NAME.json", name,
       suggest(name, noise_profile_names()));
}

void scale_number(Json& options, const char* key, double scale) {
  if (options.contains(key)) options[key] = options[key].get<double>() * scale;
}

/// Scales the sizes of the errors in the options of a profile, which have been checked.
void scale_errors(Json& options, double scale) {
  constexpr const char* end_point_errors[] = {"epe_px", "epe_x_px", "epe_y_px"};
  if (options.contains("flow")) {
    Json& flow = options["flow"];
    for (const char* key : end_point_errors) scale_number(flow, key, scale);
    if (flow.contains("bodies")) {
      for (Json& body : flow["bodies"])
        for (const char* key : end_point_errors) scale_number(body, key, scale);
    }
  }
  for (const auto& [model, key] :
       {std::pair{"depth", "delta_d_px"}, {"quantisation", "step_px"}, {"outliers", "radius_px"}})
    if (options.contains(model)) scale_number(options[model], key, scale);
  if (scale == 0) options.erase("outliers");  // without offsets there are no outliers
}

}  // namespace

std::vector<std::string> noise_profile_names() {
  std::vector<std::string> names;
  for (const EmbeddedFile& file : noise_profile_files()) names.emplace_back(file.name);
  return names;
}

Json without_profile(const Json& noise_options) {
  if (!noise_options.contains("profile")) {
    if (noise_options.contains("scale"))
      fail("option noise.scale requires option noise.profile, which is not given");
    return noise_options;
  }
  const Json& name = noise_options.at("profile");
  if (!name.is_string()) fail("option noise.profile: expected a name or a file, got {}", json_excerpt(name));
  const Json profile = read_profile(name.get<std::string>());
  if (!profile.is_object() || !profile.contains("noise") || !profile.at("noise").is_object() ||
      profile.at("noise").contains("profile"))
    fail(
        "{}: not a noise profile: expected an object with the noise options under \"noise\", as `sextant "
        "noise fit` writes it",
        name.get<std::string>());
  try {
    Noise(profile.at("noise"));
  } catch (const Error& error) {
    fail("{}: {}", name.get<std::string>(), error.what());
  }
  Json scale = noise_options.value("scale", Json(1));
  if (!scale.is_number() || !std::isfinite(scale.get<double>()) || scale.get<double>() < 0)
    fail("option noise.scale: expected a number >= 0, got {}", json_excerpt(scale));
  Json options = profile.at("noise");
  scale_errors(options, scale.get<double>());
  for (const auto& item : noise_options.items())
    if (item.key() != "profile" && item.key() != "scale") options[item.key()] = item.value();
  return options;
}

}  // namespace sextant
