#include "sextant/base/options.h"

namespace sextant::internal {

void wrong_type(const std::string& where, const char* expected, const Json& value) {
  fail("option {}: expected {}, got {}", where, expected, json_excerpt(value));
}

std::string either_of(std::span<const std::string_view> names) {
  std::string text(names.front());
  for (size_t i = 1; i < names.size(); ++i)
    text += (i + 1 < names.size() ? ", " : " or ") + std::string(names[i]);
  return text;
}

}  // namespace sextant::internal
