#include "sextant/eval/report/gnuplot.h"

#include <fcntl.h>
#include <gnuplot-iostream.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

constexpr const char* log_name = "gnuplot.log";

/// What decides how a figure looks besides its script.
std::vector<std::string> environment() {
  std::vector<std::string> settings = {"TZ=UTC0", "LC_ALL=C.UTF-8", "SOURCE_DATE_EPOCH=1577836800"};
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const bool decides = text.starts_with("GNUPLOT_") || text.starts_with("GNUTERM=") ||
                         text.starts_with("LANGUAGE=") ||
                         std::ranges::any_of(settings, [&](const std::string& setting) {
                           return text.starts_with(setting.substr(0, setting.find('=') + 1));
                         });
    if (!decides) settings.emplace_back(text);
  }
  return settings;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (std::string& text : texts) out.push_back(text.data());
  out.push_back(nullptr);
  return out;
}

/// The end of a pipe from which gnuplot reads what to load. All of it is written before there is a gnuplot, so
/// one that ends early breaks no pipe. gnuplot-iostream's own start of gnuplot goes through a shell.
int commands(const std::string& script) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) fail("cannot start gnuplot: {}", std::strerror(errno));
  gnuplotio::Gnuplot gnuplot(::fdopen(ends[1], "w"));
  gnuplot << "load '" << script << "'\n";
  return ends[0];
}

pid_t start(const std::string& script, const std::filesystem::path& folder) {
  std::vector<std::string> words = {"gnuplot", "--default-settings", "-"};
  const int input = commands(script);
  std::vector<std::string> settings = environment();
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addchdir_np(&files, folder.c_str());
  posix_spawn_file_actions_adddup2(&files, input, 0);
  posix_spawn_file_actions_addopen(&files, 1, log_name, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  pid_t id = -1;
  const int error =
      posix_spawnp(&id, "gnuplot", &files, nullptr, pointers(words).data(), pointers(settings).data());
  posix_spawn_file_actions_destroy(&files);
  ::close(input);
  if (error == ENOENT)
    fail("gnuplot is not installed: figures need it (Debian package gnuplot-nox; scripts/setup installs it)");
  if (error != 0) fail("cannot start gnuplot in {}: {}", folder.string(), std::strerror(error));
  return id;
}

}  // namespace

void run_gnuplot(const std::string& script, const std::filesystem::path& folder) {
  const pid_t id = start(script, folder);
  int status = 0;
  while (::waitpid(id, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  check_interrupt();  // Ctrl-C reaches gnuplot too
  if (WIFSIGNALED(status)) fail("gnuplot was ended by signal {} while it drew {}", WTERMSIG(status), script);
  std::string words = one_line(read_file(folder / log_name));
  words = words.substr(0, 400);  // with its caret far to the right gnuplot fills pages
  words.erase(words.find_last_not_of(' ') + 1);
  fail("gnuplot refused {}: {}", script, words);
}

}  // namespace sextant
