#pragma once

// Runs the program in tests as users start it.

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/cli/command.h"

namespace sextant {

struct Outcome {
  int code = -1;
  std::string out, err;
};

/// Starts the program with `arguments`, which a shell splits. `err` is without the line "Time: ...", which a
/// run of more than ten seconds prints, because tests do not depend on the speed of the machine.
inline Outcome sextant_program(const std::string& arguments) {
  const TempFolder temp;
  const std::string out = (temp.path() / "out").string(), err = (temp.path() / "err").string();
  const int status =
      std::system(fmt::format("{} {} > {} 2> {}", SEXTANT_PROGRAM, arguments, out, err).c_str());
  static const std::regex time_line("(^|\n)Time: [^\n]*\n");
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out),
          std::regex_replace(read_file(err), time_line, "$1")};
}

/// Runs `sextant evaluate ego` within this process.
inline Outcome evaluate_ego_command(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"sextant", "evaluate", "ego"});
  std::vector<const char*> pointers;
  for (const std::string& a : arguments) pointers.push_back(a.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const int code = program(static_cast<int>(pointers.size()), pointers.data());
  return {code, testing::internal::GetCapturedStdout(), testing::internal::GetCapturedStderr()};
}

/// Expects exit code 2 and exactly one line on stderr that contains `named`.
inline void expect_bad_input(const Outcome& outcome, const std::string& named) {
  EXPECT_EQ(outcome.code, 2) << named << ": " << outcome.out << outcome.err;
  EXPECT_TRUE(outcome.err.starts_with("sextant: error: ")) << outcome.err;
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(named));
}

}  // namespace sextant
