// A function for each command, in the specifications of zsh's _arguments.

#include <algorithm>
#include <map>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command_tree.h"

namespace sextant {
namespace {

/// Within single quotes, as a message of _arguments.
std::string message(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
      out += c;
    }
  }
  return out;
}

std::string function_of(const CommandHelp& command) {
  std::string name = "_" + command.name;
  std::ranges::replace(name, ' ', '-');
  return name;
}

std::string last_word(const CommandHelp& command) {
  return command.name.substr(command.name.rfind(' ') + 1);
}

/// Functions that offer words, one for each list.
class Offers {
 public:
  std::string action(const FlagHelp& flag) {
    switch (flag.takes) {
      case Takes::path: return "_files";
      case Takes::text: return " ";
      case Takes::words: return add(flag.words, "compadd --");
      case Takes::keys: return add(flag.words, "compset -P '*=' || compadd -S = --");
      case Takes::source:
        return add(flag.words,
                   "if [[ $PREFIX == *:* && $PREFIX != synthetic:* ]]; then compset -P '*:'; _files; return; fi; "
                   "compadd -S '' --");
      case Takes::nothing: break;
    }
    return "";
  }
  std::string text() const {
    std::string all;
    for (const auto& [body, name] : names_) all += fmt::format("{}() {{ {} }}\n", name, body);
    return all;
  }

 private:
  std::string add(const std::vector<std::string>& words, const char* how) {
    const std::string body = fmt::format("{} '{}'", how, fmt::join(words, "' '"));
    return names_.emplace(body, fmt::format("_sextant_offer_{}", names_.size() + 1)).first->second;
  }
  std::map<std::string, std::string> names_;
};

std::string flag_specs(const CommandHelp& command, Offers& offers) {
  std::string text;
  for (const FlagHelp& flag : command.flags) {
    for (const std::string& name : flag.names) {
      const std::string head = fmt::format("{}{}{}", flag.repeats ? "*" : "", name,
                                           flag.takes != Takes::nothing && name.starts_with("--") ? "=" : "");
      text += fmt::format("    '{}[{}]", head, message(flag.meaning));
      if (flag.takes != Takes::nothing) text += fmt::format(":{}:{}", message(flag.type), offers.action(flag));
      text += "'\n";
    }
  }
  return text;
}

std::string argument_specs(const CommandHelp& command, Offers& offers) {
  std::string text;
  for (const FlagHelp& argument : command.arguments) {
    text += fmt::format("    '{}:{}:{}'\n", argument.repeats ? "*" : argument.required ? "" : ":",
                        message(argument.names.front()), offers.action(argument));
  }
  return text;
}

/// A command that others stand below; it may also take an argument itself.
std::string group_function(const CommandHelp& command, Offers& offers) {
  std::string described, branches;
  for (const CommandHelp& below : command.commands) {
    std::string what = message(below.description);
    described += fmt::format("        '{}:{}'\n", last_word(below), what);
    branches += fmt::format("        {}) {} ;;\n", last_word(below), function_of(below));
  }
  std::string own;
  for (const FlagHelp& argument : command.arguments) own += "      " + offers.action(argument) + "\n";
  return fmt::format(R"({}() {{
  local context state state_descr line
  typeset -A opt_args
  local -a flags=(
{}  )
  _arguments -C $flags '1: :->command' '*:: :->rest'
  case $state in
    command)
      local -a commands=(
{}      )
      _describe command commands
{}      ;;
    rest)
      case $line[1] in
{}        *) _arguments $flags ;;
      esac
      ;;
  esac
}}
)",
                     function_of(command), flag_specs(command, offers), described, own, branches);
}

std::string leaf_function(const CommandHelp& command, Offers& offers) {
  return fmt::format("{}() {{\n  local -a specs=(\n{}{}  )\n  _arguments $specs\n}}\n", function_of(command),
                     flag_specs(command, offers), argument_specs(command, offers));
}

}  // namespace

std::string zsh_completion(const CommandHelp& tree) {
  Offers offers;
  std::string functions;
  for (const CommandHelp* command : all_commands(tree)) {
    functions += command->commands.empty() ? leaf_function(*command, offers) : group_function(*command, offers);
  }
  return "#compdef sextant\n# zsh completion of sextant, made by `sextant completion zsh`.\n\n" + offers.text() + functions +
         "\nif [[ $funcstack[1] == _sextant ]]; then _sextant \"$@\"; else compdef _sextant sextant; fi\n";
}

}  // namespace sextant
