// `sextant help [COMMAND]`: the text of `sextant COMMAND --help`.

#include <memory>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"

namespace sextant {
namespace {

/// The command below `app` called `words`; throws Error that names the nearest command where there is none.
const CLI::App& find_command(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  for (const std::string& word : words) {
    std::vector<std::string> known;
    const CLI::App* found = nullptr;
    for (const CLI::App* below : command->get_subcommands([](const CLI::App*) { return true; })) {
      known.push_back(below->get_name());
      if (below->get_name() == word) found = below;
    }
    if (found == nullptr) {
      const std::string name = words_of(*command);
      if (known.empty()) fail("'{}' has no commands below it, got '{}'", name, word);
      fail("unknown command '{} {}': {}", name, word, suggest(word, known));
    }
    command = found;
  }
  return *command;
}

}  // namespace

void add_help_command(CLI::App& app) {
  const auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* command = app.add_subcommand("help", "Print the help of a command");
  add_value(*command, "command", *words, "COMMAND", "Which command, e.g. evaluate ego; none: the list of commands");
  command->footer("Examples:\n  sextant help\n  sextant help evaluate ego");
  command->callback([words, &app] {
    const CLI::App& asked = find_command(app, *words);
    // CLI::App::help() would print the help of the command that was given, which is `help`.
    fmt::print("{}", asked.get_formatter()->make_help(&asked, words_of(asked), CLI::AppFormatMode::Normal));
  });
}

}  // namespace sextant
