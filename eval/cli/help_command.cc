// Man pages in the macros of man(7). The lines of a command's footer are kept as they are.

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/names.h"
#include "sextant/base/options.h"
#include "sextant/base/text.h"
#include "sextant/estimator/registry.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/command_tree.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/report/table.h"
#include "sextant/eval/report/words.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

/// Escapes characters of `text` that troff would interpret.
std::string plain(std::string_view text) {
  std::string out;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '`') {
      out += "\\(ga";
    } else if (c == '\'') {
      out += "\\(aq";
    } else if (c == '^') {
      out += "\\(ha";
    } else if (c == '~') {
      out += "\\(ti";
    } else {
      out += c;
    }
    line_begins = c == '\n';
  }
  return out;
}

std::string bold(std::string_view text) { return "\\fB" + plain(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + plain(text) + "\\fR"; }

std::string page_of(const std::string& command) {
  std::string page = command;
  std::ranges::replace(page, ' ', '-');
  return page;
}

std::string section(std::string_view name, const std::string& text) {
  return text.empty() ? "" : fmt::format(".SH {}\n{}", name, text);
}

std::string synopsis(const CommandHelp& command) {
  std::string line = bold(command.name);
  if (!command.flags.empty()) line += " [" + italic("OPTION") + "]...";
  for (const FlagHelp& argument : command.arguments) {
    const std::string word = italic(argument.names.front()) + (argument.repeats ? "..." : "");
    line += argument.required ? " " + word : " [" + word + "]";
  }
  if (!command.commands.empty()) line += " " + italic("COMMAND");
  return line + "\n";
}

/// Formats name and type, then the meaning, default value, range and other properties of the flag.
std::string entry(const FlagHelp& flag) {
  std::string head;
  for (const std::string& name : flag.names) head += (head.empty() ? "" : ", ") + bold(name);
  if (!flag.type.empty() && flag.type != flag.names.front()) head += " " + italic(flag.type);
  std::string text = plain(flag.meaning);
  const auto say = [&](const std::string& more) {
    text += (text.empty() || text.back() == '.' ? " " : ". ") + more;
  };
  if (!flag.default_value.empty()) say("Default: " + plain(flag.default_value));
  if (!flag.range.empty()) say("Range: " + plain(flag.range));
  if (!flag.environment.empty()) say("Environment: " + bold(flag.environment));
  if (flag.takes == Takes::words && flag.type.find('|') == std::string::npos)
    say("One of: " + plain(fmt::format("{}", fmt::join(flag.words, ", "))));
  if (flag.required && flag.names.front().starts_with('-')) say("Required");
  if (flag.repeats) say("May be repeated");
  return fmt::format(".TP\n{}\n{}.\n", head, text);
}

std::string entries(const std::vector<FlagHelp>& flags) {
  std::string text;
  for (const FlagHelp& flag : flags) text += entry(flag);
  return text;
}

std::string option_entries(const std::vector<OptionHelp>& options, std::set<std::string>& listed) {
  std::string text;
  for (const OptionHelp& option : options) {
    if (!listed.insert(option.key).second) continue;
    const std::string unit = option.unit.empty() ? "" : fmt::format(" [{}]", plain(option.unit));
    text += fmt::format(".TP\n{} = {}{}\n{}.\n", bold(option.key), plain(option.default_value), unit,
                        plain(option.meaning));
  }
  return text;
}

/// Lists the options that `sextant options` prints, for every estimator and adapter; an option shared by
/// several estimators is listed once, with the first.
std::string option_sections() {
  std::set<std::string> listed;
  std::string text;
  for (const EstimatorEntry& estimator : all_estimators()) {
    const std::string list = option_entries(run_options(estimator.name), listed);
    if (list.empty()) continue;
    text += fmt::format(".SS {}\n{}.\n{}", plain(estimator.name), plain(estimator.description), list);
  }
  for (const Adapter& adapter : adapters()) {
    std::vector<OptionHelp> options = adapter.options();
    for (OptionHelp& option : options) option.key = "source." + option.key;
    std::set<std::string> listed_here;
    text += fmt::format(".SS Sources of {}\n{}.\n{}", plain(adapter.name), plain(adapter.description),
                        option_entries(options, listed_here));
  }
  return text;
}

std::string see_also(const CommandHelp& command) {
  if (command.name == "sextant") return "";
  const std::string parent = command.name.substr(0, command.name.rfind(' '));
  std::string text = fmt::format(".BR {} (1)", plain(page_of(parent)));
  if (parent != "sextant") text += ",\n.BR sextant (1)";
  return text + "\n";
}

constexpr const char* exit_codes =
    ".TP\n0\nDone.\n.TP\n2\nBad input or usage; one line on standard error says what and where.\n"
    ".TP\n70\nInternal error.\n.TP\n130\nInterrupted.\n";

constexpr const char* files_of_an_installation =
    "Below the prefix of the installation:\n"
    ".TP\n\\fIshare/sextant/plans\\fR\nPlans for \\fBsextant sweep\\fR; those of \\fBsextant reproduce\\fR.\n"
    ".TP\n\\fIshare/sextant/published\\fR\nNumbers of the paper that \\fBsextant reproduce\\fR compares "
    "with.\n"
    ".TP\n\\fIshare/sextant/scripts\\fR\nScripts that fetch the public data sets.\n"
    ".TP\n\\fIshare/doc/sextant\\fR\nUser guide and definitions.\n";

std::string man_page(const CommandHelp& command) {
  std::string title = page_of(command.name);
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return std::toupper(c); });
  std::string description = command.description;
  if (!description.empty() && description.back() == '.') description.pop_back();
  std::string text = fmt::format(".TH {} 1 \"\" \"sextant {}\" \"Sextant\"\n", plain(title), version());
  text += section("NAME", fmt::format("{} \\- {}\n", plain(page_of(command.name)), plain(description)));
  text += section("SYNOPSIS", synopsis(command));
  text += section("ARGUMENTS", entries(command.arguments));
  text += section("OPTIONS", entries(command.flags));
  std::string commands;
  for (const CommandHelp& below : command.commands)
    commands += fmt::format(".TP\n.BR {} (1)\n{}.\n", plain(page_of(below.name)), plain(below.description));
  text += section("COMMANDS", commands);
  if (command.name == "sextant options") text += section("OPTIONS OF A RUN", option_sections());
  if (command.name == "sextant sweep") {
    std::set<std::string> listed;
    text += section("OPTIONS OF A PLAN", option_entries(plan_options(), listed));
  }
  if (!command.footer.empty()) text += section("NOTES", fmt::format(".nf\n{}\n.fi\n", plain(command.footer)));
  if (command.footer.find("Exit codes:") == std::string::npos) text += section("EXIT STATUS", exit_codes);
  if (command.name == "sextant") text += section("FILES", files_of_an_installation);
  text += section("SEE ALSO", see_also(command));
  return text;
}

struct ManFlags {
  std::vector<std::string> words;
  std::string out;
};

/// Shows a man page in the user's pager. Returns false if there is no program `man`, which the shell
/// reports with exit code 127.
bool show_page(const std::string& page) {
  FILE* pager = popen("command -v man >/dev/null || exit 127; exec man -l -", "w");
  if (pager == nullptr) return false;
  std::fwrite(page.data(), 1, page.size(), pager);
  const int status = pclose(pager);
  return !(WIFEXITED(status) && WEXITSTATUS(status) == 127);
}

/// Prints a man page: formatted on a terminal with `man`, otherwise its source, which `man -l -` reads.
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
  for (const CommandHelp* command : all_commands(tree))
    pages[page_of(command->name) + ".1"] = man_page(*command);
  write_output_folder(folder, pages);
  fmt::print("Man pages: {}\n", folder);
}

void show_or_write(const ManFlags& flags, const CLI::App& command) {
  const CommandHelp tree = command_tree(*command.get_parent());
  if (!flags.words.empty() && !flags.out.empty()) fail("--out writes all pages: leave out the command");
  flags.out.empty() ? print_page(tree, flags.words) : write_pages(tree, flags.out);
}

/// Finds the command below `app` that `words` name; throws Error that suggests the nearest command if there
/// is none.
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

void print_help(const std::vector<std::string>& words, const CLI::App& command) {
  const CLI::App& asked = find_command(*command.get_parent(), words);
  // CLI::App::help() would print the help of the command being run, which is `help`.
  fmt::print("{}", asked.get_formatter()->make_help(&asked, words_of(asked), CLI::AppFormatMode::Normal));
}

struct ExplainFlags : CommonFlags {
  std::string word;
};

constexpr size_t line_width = 100;

void explain_words(const ExplainFlags& flags) {
  std::vector<const Word*> words;
  if (flags.word.empty()) {
    for (const Word& word : all_words()) words.push_back(&word);
  } else {
    words = explain(flags.word);
  }
  if (flags.json) {
    Json json = Json::array();
    for (const Word* word : words)
      json.push_back(
          {{"word", word->word}, {"kind", word->kind}, {"meaning", word->meaning}, {"others", word->others}});
    print_json(json);
    return;
  }
  for (const Word* word : words)
    fmt::print("{}\n", wrapped(fmt::format("{} ({}): {}.", word->word, word->kind, word->meaning), line_width,
                               "    "));
}

Table options_table(const std::string& estimator) {
  Table table;
  table.columns = {Column::text("key"), Column::text("default"), Column::text("unit"),
                   Column::text("meaning")};
  add_rows(run_options(estimator), table);
  add_rows(plan_options(), table);
  table.title = "Options of a run with " + estimator;
  table.notes = {
      "Also 'source.*': options of the data set's adapter, see `sextant data list --json`.",
      "'noise.*' is also what --noise and plans take as JSON: {\"depth\": {\"delta_d_px\": 0.2}}."};
  return table;
}

struct OptionsFlags : CommonFlags {
  std::string estimator = RunConfig{}.estimator;
};

void list_options(const OptionsFlags& flags) {
  const Table table = options_table(flags.estimator);
  if (flags.json) {
    Json json;
    json["estimators"] = Json::array();
    for (const EstimatorEntry& entry : all_estimators()) {
      json["estimators"].push_back({{"name", entry.name}, {"description", entry.description}});
    }
    json["estimator"] = flags.estimator;
    json["options"] = rows_to_json(table);
    print_json(json);
  } else {
    fmt::print("Estimators\n{}\n{}", estimator_list(), screen_text(table));
  }
}

}  // namespace

void add_rows(const std::vector<OptionHelp>& options, Table& table) {
  for (const OptionHelp& option : options) {
    table.add_row(
        {option.key, option.default_value, option.unit.empty() ? Cell() : Cell(option.unit), option.meaning});
  }
}

void add_man_command(CLI::App& app) {
  auto [command, flags] = add_command<ManFlags>(
      app, "man", "Show the man page of a command, or write all of them", show_or_write);
  add_value(command, "command", flags.words, "COMMAND",
            "The command, e.g. evaluate ego; none: sextant itself");
  add_value(command, "--out", flags.out, "DIR", "Folder for all pages");
  command.footer("Examples:\n  sextant man run\n  sextant man run > sextant-run.1\n  sextant man --out man1");
}

// ---- `sextant help [COMMAND]`: the text of `sextant COMMAND --help`.

void add_help_command(CLI::App& app) {
  auto [command, words] =
      add_command<std::vector<std::string>>(app, "help", "Print the help of a command", print_help);
  add_value(command, "command", words, "COMMAND",
            "Which command, e.g. evaluate ego; none: the list of commands");
  command.footer("Examples:\n  sextant help\n  sextant help evaluate ego");
}

void add_explain_command(CLI::App& app) {
  auto [command, flags] =
      add_command<ExplainFlags>(app, "explain", "Explain a word of a table or report", explain_words);
  add_value(command, "word", flags.word, "WORD",
            "The word: coverage, gated, E_t, split_nees, ..; none: all of them");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer("Example:\n  sextant explain coverage");
}

void add_options_command(CLI::App& app) {
  auto [command, flags] = add_command<OptionsFlags>(
      app, "options", "List estimators, and every option with default, unit and meaning", list_options);
  add_value(command, "--estimator", flags.estimator, "NAME", "Whose options")->capture_default_str();
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer("Example:\n  sextant options --estimator motion_only");
}

}  // namespace sextant
