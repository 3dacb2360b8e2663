// main() of every GoogleTest program. Each test process runs in a temporary folder that contains the working
// folder, the home folder and the system's temporary folder and is removed at the end: no test reads files
// left by another test, an earlier build or the user, and tests can run in parallel.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "sextant/base/new_file.h"

namespace {

namespace fs = std::filesystem;

void set_folder(const char* variable, const fs::path& folder) {
  fs::create_directory(folder);
  ::setenv(variable, folder.c_str(), 1);
}

int run_in(const fs::path& own) {
  // Tests that switch to another user must still be able to reach the temporary folder.
  fs::permissions(own, fs::perms::owner_all | fs::perms::group_exec | fs::perms::others_exec);
  set_folder("HOME", own / "home");
  set_folder("TMPDIR", own / "tmp");
  fs::permissions(own / "tmp", fs::perms::all | fs::perms::sticky_bit);
  if (const char* data = std::getenv("SEXTANT_DATA"); data != nullptr && *data != '\0')
    ::setenv("SEXTANT_DATA", fs::absolute(data).c_str(), 1);
  ::setenv("SEXTANT_CACHE", "", 1);
  for (const char* variable :
       {"XDG_CACHE_HOME", "XDG_CONFIG_HOME", "SLURM_CPUS_PER_TASK", "SOURCE_DATE_EPOCH"})
    ::unsetenv(variable);
  fs::create_directory(own / "work");
  fs::current_path(own / "work");
  const int code = RUN_ALL_TESTS();
  fs::current_path("/");
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  if (testing::GTEST_FLAG(list_tests)) return RUN_ALL_TESTS();
  // Tests write paths into lines for the shell without quotes.
  const std::string temporary = sextant::temporary_folder().string();
  if (temporary.find_first_of(" \t'\"$&;()<>|*?[]#~`\\!{}") != std::string::npos)
    ::setenv("TMPDIR", "/tmp", 1);
  const sextant::ScratchFolder own("sextant_test_");
  return run_in(own.path());
}
