// Man pages in the macros of man(7). The lines of a footer stay as they are.

#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/command_tree.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {
namespace {

/// `text` with what troff would take as its own made plain.
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

/// Name and type, then meaning, default and what else is known of it.
std::string entry(const FlagHelp& flag) {
  std::string head;
  for (const std::string& name : flag.names) head += (head.empty() ? "" : ", ") + bold(name);
  if (!flag.type.empty() && flag.type != flag.names.front()) head += " " + italic(flag.type);
  std::string text = plain(flag.meaning);
  const auto say = [&](const std::string& more) { text += (text.empty() || text.back() == '.' ? " " : ". ") + more; };
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

std::string option_entries(const std::vector<OptionHelp>& options, std::set<std::string>& told) {
  std::string text;
  for (const OptionHelp& option : options) {
    if (!told.insert(option.key).second) continue;
    const std::string unit = option.unit.empty() ? "" : fmt::format(" [{}]", plain(option.unit));
    text += fmt::format(".TP\n{} = {}{}\n{}.\n", bold(option.key), plain(option.default_value), unit,
                        plain(option.meaning));
  }
  return text;
}

/// What `sextant options` prints, for every estimator; an option stands with the first that has it.
std::string option_sections() {
  std::set<std::string> told;
  std::string text;
  for (const EstimatorEntry& estimator : all_estimators()) {
    const std::string list = option_entries(run_options(estimator.name), told);
    if (list.empty()) continue;
    text += fmt::format(".SS {}\n{}.\n{}", plain(estimator.name), plain(estimator.description), list);
  }
  for (const Adapter& adapter : adapters()) {
    std::vector<OptionHelp> options = adapter.options();
    for (OptionHelp& option : options) option.key = "source." + option.key;
    std::set<std::string> told_here;
    text += fmt::format(".SS Sources of {}\n{}.\n{}", plain(adapter.name), plain(adapter.description),
                        option_entries(options, told_here));
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
    ".TP\n\\fIshare/sextant/published\\fR\nNumbers of the paper that \\fBsextant reproduce\\fR compares with.\n"
    ".TP\n\\fIshare/sextant/scripts\\fR\nScripts that fetch the public data sets.\n"
    ".TP\n\\fIshare/doc/sextant\\fR\nUser guide and definitions.\n";

}  // namespace

std::string man_page_name(const CommandHelp& command) { return page_of(command.name) + ".1"; }

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
    std::set<std::string> told;
    text += section("OPTIONS OF A PLAN", option_entries(plan_options(), told));
  }
  if (!command.footer.empty()) text += section("NOTES", fmt::format(".nf\n{}\n.fi\n", plain(command.footer)));
  if (command.footer.find("Exit codes:") == std::string::npos) text += section("EXIT STATUS", exit_codes);
  if (command.name == "sextant") text += section("FILES", files_of_an_installation);
  text += section("SEE ALSO", see_also(command));
  return text;
}

}  // namespace sextant
