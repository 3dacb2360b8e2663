#include "sextant/base/options.h"

namespace sextant::internal {

void wrong_type(const std::string& where, const char* expected, const Json& value) {
  fail("option {}: expected {}, got {}", where, expected, json_excerpt(value));
}

}  // namespace sextant::internal
