#include "sextant/base/options.h"

#include <cmath>
#include <limits>

namespace sextant::internal {

void wrong_type(const std::string& where, const char* expected, const Json& value) {
  fail("option {}: expected {}, got {}", where, expected, value.dump());
}

void read_leaf(const std::string& where, const Json& value, bool& field) {
  if (!value.is_boolean()) wrong_type(where, "true or false", value);
  field = value.get<bool>();
}

void read_leaf(const std::string& where, const Json& value, int& field) {
  if (!value.is_number_integer()) wrong_type(where, "an integer", value);
  // An unsigned value above INT64_MAX would wrap in get<int64_t>().
  const bool too_large =
      value.is_number_unsigned() && value.get<uint64_t>() > std::numeric_limits<int>::max();
  const auto wide = value.get<int64_t>();
  if (too_large || wide < std::numeric_limits<int>::min() || wide > std::numeric_limits<int>::max()) {
    wrong_type(where, "a 32-bit integer", value);
  }
  field = static_cast<int>(wide);
}

void read_leaf(const std::string& where, const Json& value, uint64_t& field) {
  if (!value.is_number_integer() || (!value.is_number_unsigned() && value.get<int64_t>() < 0)) {
    wrong_type(where, "a non-negative integer", value);
  }
  field = value.get<uint64_t>();
}

void read_leaf(const std::string& where, const Json& value, double& field) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) wrong_type(where, "a finite number", value);
  field = value.get<double>();
}

void read_leaf(const std::string& where, const Json& value, std::string& field) {
  if (!value.is_string()) wrong_type(where, "a text", value);
  field = value.get<std::string>();
}

}  // namespace sextant::internal
