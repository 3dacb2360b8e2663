#include "sextant/base/error.h"
#include "sextant/eval/cli/command_tree.h"

namespace sextant {
namespace {

std::string in_quotes(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

/// What stands after the flag, or as an argument.
std::string offers(const FlagHelp& flag) {
  std::string words;
  for (const std::string& word : flag.words)
    words += (words.empty() ? "" : " ") + word + (flag.takes == Takes::keys ? "=" : "");
  switch (flag.takes) {
    case Takes::words:
    case Takes::keys: return " -x -a " + in_quotes(words);
    case Takes::source: return " -r -F -a " + in_quotes(words);
    case Takes::path: return " -r -F";
    case Takes::text: return " -x";
    case Takes::nothing: break;
  }
  return "";
}

constexpr const char* script_head = R"(# fish completion of sextant, made by `sextant completion fish`.

function __sextant_at  # COMMAND: is this the one that is typed?
    set -l at sextant
    set -l words (commandline -opc)
    for word in $words[2..-1]
        contains -- "$at $word" $__sextant_commands; and set at "$at $word"
    end
    test "$at" = "$argv"
end

complete -c sextant -f
)";

}  // namespace

std::string fish_completion(const CommandHelp& tree) {
  std::string names, lines;
  for (const CommandHelp* command : all_commands(tree)) {
    names += " " + in_quotes(command->name);
    const std::string at = fmt::format("complete -c sextant -n '__sextant_at {}'", command->name);
    for (const CommandHelp& below : command->commands) {
      lines += fmt::format("{} -a {} -d {}\n", at, below.name.substr(below.name.rfind(' ') + 1),
                           in_quotes(below.description));
    }
    for (const FlagHelp& flag : command->flags) {
      std::string head;
      for (const std::string& name : flag.names)
        head += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      lines += fmt::format("{}{}{} -d {}\n", at, head, offers(flag), in_quotes(flag.meaning));
    }
    if (!command->arguments.empty()) {
      std::string what = offers(command->arguments.back());
      for (const char* needs_value : {" -x", " -r"}) {  // of flags alone
        if (what.starts_with(needs_value)) what.erase(0, 3);
      }
      if (!what.empty()) lines += fmt::format("{}{}\n", at, what);
    }
  }
  return script_head + fmt::format("set -g __sextant_commands{}\n", names) + lines;
}

}  // namespace sextant
