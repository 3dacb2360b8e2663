#pragma once

// The noise parameter that a sweep varies, inferred from the noise levels in its run.json, which state the
// options of every level but not the plan's grid.

#include <compare>
#include <map>
#include <string>
#include <vector>

#include "sextant/base/json.h"

namespace sextant {

/// Parameter of a grid over the `scale` of a noise profile. The options in run.json hold the profile's
/// numbers times the level in place of `profile` and `scale`.
inline constexpr const char* profile_scale = "scale";

/// A sweep of one parameter under the same other noise.
struct SweptGrid {
  std::string parameter;  ///< dotted key; "" if nothing is swept
  std::string others;     ///< options of the noise, in one line, with null in place of the parameter
  std::string label;      ///< text of the other noise; "" if this version cannot read the options
  auto operator<=>(const SweptGrid&) const = default;
};

/// A noise level of the configuration in run.json.
struct ConfiguredLevel {
  double level = 0;
  Json noise;                             ///< Noise::options()
  std::string name;                       ///< text in records; "" if this version cannot read the options
  std::map<std::string, double> numbers;  ///< numbers of `noise`, by dotted key
  SweptGrid grid;
};

/// Returns the noise levels of a run.json's configuration, in their order; none where it lists no levels.
std::vector<ConfiguredLevel> configured_levels(const Json& configuration);

/// Returns the name in records of a noise with these options; "" if this version cannot read them.
std::string noise_name(const Json& options);

/// Options by dotted key; a list is one value.
std::map<std::string, Json> leaves_of(const Json& options);

}  // namespace sextant
