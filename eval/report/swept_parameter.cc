#include "sextant/eval/report/swept_parameter.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

/// Returns the numbers in a tree by dotted key.
std::map<std::string, double> numbers_of(const Json& tree) {
  std::map<std::string, double> numbers;
  for (const auto& [key, value] : leaves_of(tree)) {
    if (value.is_number()) numbers[key] = value.get<double>();
  }
  return numbers;
}

/// Sets the number at a dotted key; does nothing for a key that itself contains a dot.
void set_number(const std::string& key, const Json& value, Json& noise) {
  Json* number = &noise;
  for (const std::string& part : split(key, '.')) {
    if (!number->is_object()) return;
    number = &(*number)[part];
  }
  *number = value;
}

/// Returns true if `key` is one of the numbers that the scale of a profile multiplies.
bool is_scaled_by_profile(const std::string& key) {
  static const std::set<std::string> names = {"epe_px",     "epe_x_px", "epe_y_px",
                                              "delta_d_px", "step_px",  "radius_px"};
  return names.contains(key.substr(key.rfind('.') + 1));
}

/// Returns true if the noise of both levels is that of one profile times the level: numbers that differ are
/// in the ratio of the levels, and all else is equal. At level 0 the noise has no size.
bool are_of_profile(const ConfiguredLevel& a, const ConfiguredLevel& b) {
  Json rest_a = a.noise, rest_b = b.noise;
  bool has_size = false, is_empty = true;
  for (const auto& [key, number] : a.numbers) {
    if (!is_scaled_by_profile(key)) continue;
    is_empty = is_empty && number == 0;
    const auto other = b.numbers.find(key);
    if (other == b.numbers.end() || number == other->second) continue;
    const double scaled = number * b.level, expected = other->second * a.level;
    if (std::abs(scaled - expected) > 1e-9 * expected) continue;  // remains in both and makes them differ
    has_size = true;
    set_number(key, nullptr, rest_a);
    set_number(key, nullptr, rest_b);
  }
  if (a.level == 0) return is_empty;
  return b.level == 0 ? are_of_profile(b, a) : has_size && rest_a == rest_b;
}

/// Returns the grid of a level whose noise is that of a profile times the level.
SweptGrid grid_of_profile(const ConfiguredLevel& level) {
  Json profile = level.noise;
  for (const auto& [key, number] : level.numbers) {
    if (is_scaled_by_profile(key))
      set_number(key, std::strtod(fmt::format("{:.6g}", number / level.level).c_str(), nullptr), profile);
  }
  return {profile_scale, json_line(profile), noise_name(profile)};
}

/// Returns the grid of a level whose noise is not none.
SweptGrid grid_of(const ConfiguredLevel& level, const std::string& parameter) {
  if (parameter == profile_scale) return grid_of_profile(level);
  Json others = level.noise, without = level.noise;
  set_number(parameter, nullptr, others);
  set_number(parameter, 0, without);
  std::string label = noise_name(without);
  const size_t correlation = level.name.find(" (");
  if (label == "none" && correlation != std::string::npos) label += level.name.substr(correlation);
  return {parameter, json_line(others), label};
}

/// Returns true if the number `key` is the level at both levels and their noise is otherwise equal. At level
/// 0 the model of the number may be missing, because options list only models that have an effect.
bool is_swept(const std::string& key, const ConfiguredLevel& a, const ConfiguredLevel& b) {
  const std::string model = key.substr(0, key.find('.'));
  const auto is_level = [&](const ConfiguredLevel& level) {
    const auto it = level.numbers.find(key);
    if (it != level.numbers.end()) return it->second == level.level;
    return level.level == 0 && !level.noise.contains(model);
  };
  if (!is_level(a) || !is_level(b)) return false;
  const bool has_model = a.noise.contains(model) && b.noise.contains(model);
  const bool has_correlation = !a.noise.empty() && !b.noise.empty();
  const auto rest = [&](Json noise) {
    if (!has_correlation) noise.erase("correlation");
    if (!has_model) {
      noise.erase(model);
      return noise;
    }
    set_number(key, nullptr, noise);
    return noise;
  };
  return rest(a.noise) == rest(b.noise);
}

/// Determines the grid of each level. A grid consists of successive levels of which one parameter is
/// swept; it ends where no parameter fits the next level too. If a level 0 fits both the grid before it and
/// the grid after it, it is assigned to the grid after it.
void find_grids(std::vector<ConfiguredLevel>& levels) {
  using Keys = std::set<std::string>;
  const auto fits_profile = [&](size_t a, size_t b) {
    // Level 0 does not show the profile: two others must.
    if (levels[a].level > 0)
      return (levels[b].level > 0 || b > a + 1) && are_of_profile(levels[a], levels[b]);
    const size_t i = a + 1, j = std::max(b, a + 2);
    return j < levels.size() && are_of_profile(levels[a], levels[i]) && levels[i].level > 0 &&
           are_of_profile(levels[i], levels[j]);
  };
  const auto fitting = [&](const Keys& keys, size_t a, size_t b) {
    Keys fit;
    for (const std::string& key : keys) {
      if (key == profile_scale ? fits_profile(a, b) : is_swept(key, levels[a], levels[b])) fit.insert(key);
    }
    return fit;
  };
  const auto swept_by_two = [&](size_t a) {
    Keys keys;
    for (const size_t i : {a, a + 1}) {
      for (const auto& [key, value] : levels[i].numbers) keys.insert(key);
    }
    const Keys fit = fitting(keys, a, a + 1);
    return fit.empty() ? fitting({profile_scale}, a, a + 1) : fit;
  };
  size_t first = 0;  // of the grid
  Keys keys;         // parameters that fit the grid so far
  for (size_t i = 1; i <= levels.size(); ++i) {
    Keys longer;
    if (i < levels.size()) longer = i == first + 1 ? swept_by_two(first) : fitting(keys, first, i);
    const bool may_begin_next = i + 1 < levels.size() && levels[i].level == 0;
    if (may_begin_next && fitting(longer, first, i + 1).empty() && !swept_by_two(i).empty()) longer.clear();
    if (longer.empty()) {
      if (!keys.empty()) {
        const ConfiguredLevel& highest =
            *std::max_element(&levels[first], &levels[i - 1] + 1,
                              [](const auto& a, const auto& b) { return a.level < b.level; });
        const SweptGrid grid = grid_of(highest, *keys.begin());
        for (size_t k = first; k < i; ++k) levels[k].grid = grid;
      }
      first = i;
    }
    keys = std::move(longer);
  }
}

}  // namespace

std::vector<ConfiguredLevel> configured_levels(const Json& configuration) {
  const Json list = configuration.value("noise", Json());
  std::vector<ConfiguredLevel> levels;
  for (size_t i = 0; list.is_array() && i < list.size(); ++i) {
    const Json& entry = list[i];
    if (!entry.is_object() || !entry.contains("noise") || !entry["noise"].is_object()) return {};
    ConfiguredLevel level{.level = json_member<double>(entry, "level", "run.json: configuration.noise", 0),
                          .noise = entry["noise"],
                          .name = noise_name(entry["noise"])};
    level.numbers = numbers_of(level.noise);
    levels.push_back(std::move(level));
  }
  find_grids(levels);
  return levels;
}

std::map<std::string, Json> leaves_of(const Json& options) {
  std::map<std::string, Json> leaves;
  for_each_leaf(options, false, [&](const std::string& key, const Json& value) { leaves[key] = value; });
  return leaves;
}

std::string noise_name(const Json& options) {
  if (options.contains("profile")) return "";  // would be read from a file
  try {
    return Noise(options).name();
  } catch (const Error&) {
    return "";
  }
}

}  // namespace sextant
