#pragma once

// Test helper of what throws Error.

#include <string>

#include "sextant/base/error.h"

namespace sextant {

/// Its message; "no error" when there is none.
template <typename Action>
std::string error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace sextant
