#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/command_tree.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/records/output.h"

namespace sextant {
namespace {

struct Shell {
  const char* name;
  std::string (*script)(const CommandHelp& tree);
};
constexpr Shell shells[] = {{"bash", bash_completion}, {"zsh", zsh_completion}, {"fish", fish_completion}};

struct ManFlags {
  std::vector<std::string> words;
  std::string out;
};

/// Shows a man page in the reader's pager. False where there is no program `man`, whose shell exit code is 127.
bool show_page(const std::string& page) {
  FILE* pager = popen("command -v man >/dev/null || exit 127; exec man -l -", "w");
  if (pager == nullptr) return false;
  std::fwrite(page.data(), 1, page.size(), pager);
  const int status = pclose(pager);
  return !(WIFEXITED(status) && WEXITSTATUS(status) == 127);
}

/// Prints a man page: formatted on a terminal that has `man`, else its source, which `man -l -` reads.
void print_page(const std::string& page) {
  if (isatty(STDOUT_FILENO) == 0 || !show_page(page)) fmt::print("{}", page);
}

void print_page(const CommandHelp& tree, const std::vector<std::string>& words) {
  const std::string name = fmt::format("sextant{}{}", words.empty() ? "" : " ", fmt::join(words, " "));
  std::vector<std::string> known;
  for (const CommandHelp* command : all_commands(tree)) {
    if (command->name == name) return print_page(man_page(*command));
    known.push_back(command->name);
  }
  fail("unknown command '{}': {}", name, suggest(name, known));
}

void write_pages(const CommandHelp& tree, const std::string& folder) {
  OutputFiles pages;
  for (const CommandHelp* command : all_commands(tree)) pages[man_page_name(*command)] = man_page(*command);
  write_output_folder(folder, pages);
  fmt::print("Man pages: {}\n", folder);
}

}  // namespace

void add_completion_command(CLI::App& app) {
  const auto name = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("completion", "Print what a shell needs to complete commands, flags and options");
  std::string names;
  for (const Shell& shell : shells) names += fmt::format("{}{}", names.empty() ? "" : "|", shell.name);
  add_value(*command, "shell", *name, names, "Which shell")->required();
  command->footer(
      "A package of Sextant installs all three. By hand:\n"
      "Examples:\n"
      "  sextant completion bash > ~/.local/share/bash-completion/completions/sextant\n"
      "  sextant completion zsh > _sextant        (in a folder of $fpath)\n"
      "  sextant completion fish > ~/.config/fish/completions/sextant.fish");
  command->callback([name, &app] {
    std::vector<std::string> known;
    for (const Shell& shell : shells) {
      if (shell.name == *name) return fmt::print("{}", shell.script(command_tree(app)));
      known.emplace_back(shell.name);
    }
    fail("unknown shell '{}': {}", *name, suggest(*name, known));
  });
}

void add_man_command(CLI::App& app) {
  const auto flags = std::make_shared<ManFlags>();
  CLI::App* command = app.add_subcommand("man", "Show the man page of a command, or write all of them");
  add_value(*command, "command", flags->words, "COMMAND", "Whose page, e.g. evaluate ego; none: of sextant");
  add_value(*command, "--out", flags->out, "DIR", "Folder for all pages");
  command->footer("Examples:\n  sextant man run\n  sextant man run > sextant-run.1\n  sextant man --out man1");
  command->callback([flags, &app] {
    const CommandHelp tree = command_tree(app);
    if (!flags->words.empty() && !flags->out.empty()) fail("--out writes all pages: leave out the command");
    flags->out.empty() ? print_page(tree, flags->words) : write_pages(tree, flags->out);
  });
}

}  // namespace sextant
