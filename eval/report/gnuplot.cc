#include "sextant/eval/report/gnuplot.h"

#include <gnuplot-iostream.h>

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"

namespace sextant {
namespace {

std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace

void run_gnuplot(const std::string& script, const std::filesystem::path& folder) {
  // The shell reads the whole script first, so that a gnuplot that stops early does not break the pipe.
  const std::string command = "cd " + shell_quoted(folder.string()) +
                              " && cat > script.gp && "
                              "{ gnuplot script.gp > gnuplot.log 2>&1 && echo ok > gnuplot.done; } || true";
  {
    gnuplotio::Gnuplot gnuplot(command);
    gnuplot << script;
  }
  if (std::filesystem::exists(folder / "gnuplot.done")) return;
  std::string words;
  if (std::filesystem::exists(folder / "gnuplot.log")) words = read_file(folder / "gnuplot.log");
  if (words.find("not found") != std::string::npos) {
    fail("gnuplot is not installed: figures need it (Debian package gnuplot-nox; scripts/setup installs it)");
  }
  while (!words.empty() && words.back() == '\n') words.pop_back();
  std::replace(words.begin(), words.end(), '\n', ' ');
  fail("gnuplot refused a figure: {}", words);
}

}  // namespace sextant
