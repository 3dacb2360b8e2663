#pragma once

// Test helpers: common matchers, error messages, child processes, real data, and temporary folders.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <sys/wait.h>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <string_view>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/new_file.h"
#include "sextant/base/philox.h"

namespace sextant {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

/// Returns the message of the Error that `action` throws; "no error" if it throws none.
template <typename Action>
std::string error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// Expects that `action` throws Error with a one-line message that contains `part`.
template <typename Action>
void expect_error(const Action& action, const std::string& part) {
  const std::string message = error_of(action);
  EXPECT_THAT(message, AllOf(HasSubstr(part), Not(HasSubstr("\n"))));
}

/// Returns the status, in the format of waitpid(), of a child process that exits with the code returned by
/// `action`.
template <typename Action>
int status_of_child(const Action& action) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(static_cast<int>(action()));
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

inline double standard_normal(PhiloxStream& random) {
  return std::sqrt(-2 * std::log(random.uniform())) * std::cos(2 * std::numbers::pi * random.uniform());
}

/// Returns the content of all files below a folder by relative path.
inline std::map<std::string, std::string> files_below(const std::filesystem::path& root) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(root).string()] = read_file(entry.path());
  }
  return files;
}

/// Returns the path of `name` below SEXTANT_DATA; empty if it does not exist or SEXTANT_DATA is not set.
inline std::filesystem::path real_data(const std::string& name) {
  const char* root = std::getenv("SEXTANT_DATA");
  const std::filesystem::path path = std::filesystem::path(root == nullptr ? "" : root) / name;
  return root != nullptr && std::filesystem::exists(path) ? path : std::filesystem::path();
}

/// Skips the test unless `name` exists in the real data.
#define SEXTANT_NEEDS_DATA(name)                                                                         \
  do {                                                                                                   \
    if (::sextant::real_data(name).empty()) GTEST_SKIP() << "needs " << (name) << " below SEXTANT_DATA"; \
  } while (false)

/// A temporary folder of one test.
class TempFolder {
 public:
  const std::filesystem::path& path() const { return folder_.path(); }
  std::string operator/(const std::string& name) const { return (path() / name).string(); }
  /// Writes a file, creates its parent folders, and returns its path.
  std::string write(const std::string& name, std::string_view bytes) const {
    std::filesystem::create_directories((path() / name).parent_path());
    write_file(path() / name, bytes);
    return *this / name;
  }

 private:
  ScratchFolder folder_{"sextant_test_"};
};

}  // namespace sextant
