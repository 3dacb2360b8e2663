// The program `sextant`. Commands that read text files alone run here: this program links no image or solver
// library, whose loading takes longer than evaluating a trajectory. Everything else is done by `sextant-full`
// in the same folder, which takes over this process.

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "sextant/base/error.h"
#include "sextant/eval/cli/evaluate.h"

namespace {

/// `evaluate ego`, `flow` and `depth` of files; a SOURCE needs the adapters of data sets, --out figures.
bool is_light(int argc, char** argv) {
  if (argc < 3 || std::string_view(argv[1]) != "evaluate") return false;
  const std::string_view what = argv[2];
  if (what != "ego" && what != "flow" && what != "depth") return false;
  for (int i = 3; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (sextant::looks_like_source(argv[i]) || word == "--out" || word.starts_with("--out=")) return false;
  }
  return true;
}

void add_light_evaluate_command(CLI::App& app) { sextant::add_light_evaluate_commands(app, {}); }

int hand_over(char** argv) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path full = self.parent_path() / "sextant-full";
  ::execv(full.c_str(), argv);
  fmt::print(stderr, "sextant: error: cannot start {}: {}; it belongs beside `sextant`\n", full.string(),
             std::strerror(errno));
  return sextant::exit_internal;
}

}  // namespace

int main(int argc, char** argv) {
  if (!is_light(argc, argv)) return hand_over(argv);
  constexpr sextant::AddCommand commands[] = {add_light_evaluate_command};
  return sextant::program(argc, argv, commands);
}
