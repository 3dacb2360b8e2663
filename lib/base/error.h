#pragma once

// Two kinds of errors. `Error` reports bad input or usage: its one-line message names the file, line or key,
// what was expected and what to do; programs print it and exit with code 2. `SEXTANT_CHECK` reports a
// violated invariant of the program itself: it names the source file and line; programs exit with code 70. An
// estimate that could not be made is neither: it is a Status (base/status.h).

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace sextant {

/// Bad input or usage.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A broken invariant of this program.
class InternalError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Throws Error with a formatted message: fail("{}:{}: expected 16 numbers, got {}", path, line, n).
template <typename... Args>
[[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) {
  throw Error(fmt::format(format, std::forward<Args>(args)...));
}

namespace internal {
[[noreturn]] inline void check_failed(const char* condition, const char* file, int line) {
  throw InternalError(fmt::format("{}:{}: internal check failed: {}", file, line, condition));
}
}  // namespace internal

}  // namespace sextant

#define SEXTANT_CHECK(condition)                                                         \
  do {                                                                                   \
    if (!(condition)) ::sextant::internal::check_failed(#condition, __FILE__, __LINE__); \
  } while (false)
