// Shell completions. zsh: one function per command, in the specification language of _arguments.

#include <algorithm>
#include <map>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/command_tree.h"
#include "sextant/eval/cli/flags.h"

namespace sextant {
namespace {

/// Quotes `text` for use as a message of _arguments within single quotes.
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

std::string last_word(const CommandHelp& command) { return command.name.substr(command.name.rfind(' ') + 1); }

/// Shell functions that offer words, one for each distinct list.
class Offers {
 public:
  std::string action(const FlagHelp& flag) {
    switch (flag.takes) {
      case Takes::path:
        return "_files";
      case Takes::text:
        return " ";
      case Takes::words:
        return add(flag.words, "compadd --");
      case Takes::keys:
        return add(flag.words, "compset -P '*=' || compadd -S = --");
      case Takes::source:
        return add(
            flag.words,
            "if [[ $PREFIX == *:* && $PREFIX != synthetic:* ]]; then compset -P '*:'; _files; return; fi; "
            "compadd -S '' --");
      case Takes::nothing:
        break;
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
      if (flag.takes != Takes::nothing)
        text += fmt::format(":{}:{}", message(flag.type), offers.action(flag));
      text += "'\n";
    }
  }
  return text;
}

std::string argument_specs(const CommandHelp& command, Offers& offers) {
  std::string text;
  for (const FlagHelp& argument : command.arguments) {
    text += fmt::format("    '{}:{}:{}'\n",
                        argument.repeats    ? "*"
                        : argument.required ? ""
                                            : ":",
                        message(argument.names.front()), offers.action(argument));
  }
  return text;
}

/// Function of a command that has subcommands; it may also take an argument of its own.
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

std::string zsh_completion(const CommandHelp& tree) {
  Offers offers;
  std::string functions;
  for (const CommandHelp* command : all_commands(tree)) {
    functions +=
        command->commands.empty() ? leaf_function(*command, offers) : group_function(*command, offers);
  }
  return "#compdef sextant\n# zsh completion of sextant, made by `sextant completion zsh`.\n\n" +
         offers.text() + functions +
         "\nif [[ $funcstack[1] == _sextant ]]; then _sextant \"$@\"; else compdef _sextant sextant; fi\n";
}

// bash: the script holds three tables (commands; flags of a command; values of a flag) and one function
// that reads them.

constexpr const char* bash_head = R"(# bash completion of sextant, made by `sextant completion bash`.

)";

/// Takes the word under the cursor from the line itself, because readline splits words at ':' and '='.
constexpr const char* bash_function = R"sh(
_sextant_reply() {  # VALUES CURRENT: adds to COMPREPLY
  local kind=${1%% *} words=${1#* } current=$2
  [[ $kind != "$1" ]] || words=
  case $kind in
    @words) COMPREPLY+=($(compgen -W "$words" -- "$current")) ;;
    @keys)
      compopt -o nospace 2>/dev/null
      [[ $current == *=* ]] || COMPREPLY+=($(compgen -W "$words" -S = -- "$current"))
      ;;
    @source)
      compopt -o nospace 2>/dev/null
      if [[ $current == *:* && $current != synthetic:* ]]; then
        local path
        while IFS= read -r path; do
          [[ ! -d $path ]] || path+=/
          COMPREPLY+=("${current%%:*}:$path")
        done < <(compgen -f -- "${current#*:}")
      else
        COMPREPLY+=($(compgen -W "$words" -- "$current"))
      fi
      ;;
    @path)
      local path
      compopt -o filenames 2>/dev/null
      while IFS= read -r path; do COMPREPLY+=("$path"); done < <(compgen -f -- "$current")
      ;;
  esac
}

_sextant() {
  local line=${COMP_LINE:0:COMP_POINT} command=sextant flag= prefix= current= word
  local -a words
  read -ra words <<<"$line"
  if [[ $line != *[[:space:]] ]]; then
    current=${words[-1]}
    unset 'words[-1]'
  fi
  for word in "${words[@]:1}"; do
    if [[ -n $flag ]]; then
      flag=
    elif [[ $word == -* ]]; then
      [[ $word == *=* || -z $(_sextant_values "$command,$word") ]] || flag=$word
    elif [[ " $(_sextant_commands "$command") " == *" $word "* ]]; then
      command+=" $word"
    fi
  done
  if [[ -z $flag && $current == --*=* ]]; then
    flag=${current%%=*} prefix=${current%%=*}=
    current=${current#*=}
  fi

  COMPREPLY=()
  if [[ -n $flag ]]; then
    _sextant_reply "$(_sextant_values "$command,$flag")" "$current"
  elif [[ $current == -* ]]; then
    _sextant_reply "@words $(_sextant_flags "$command")" "$current"
  else
    _sextant_reply "@words $(_sextant_commands "$command")" "$current"
    _sextant_reply "$(_sextant_values "$command,")" "$current"
  fi

  # What readline takes as a word of its own begins behind the last ':' or '='.
  local typed=$prefix$current breaks=${COMP_WORDBREAKS//[!:=]/}
  COMPREPLY=("${COMPREPLY[@]/#/$prefix}")
  if [[ -n $breaks && $typed == *["$breaks"]* ]]; then
    local cut=${typed%"${typed##*["$breaks"]}"}
    COMPREPLY=("${COMPREPLY[@]#"$cut"}")
  fi
}

complete -F _sextant sextant
)sh";

/// Formats a table as `case $1 in 'KEY' | 'KEY') echo 'TEXT' ;; ...`; keys with the same text share a line.
std::string bash_table(const char* function, const std::map<std::string, std::vector<std::string>>& keys_of) {
  std::string text = fmt::format("{}() {{\n  case $1 in\n", function);
  for (const auto& [value, keys] : keys_of)
    text += fmt::format("    '{}') echo '{}' ;;\n", fmt::join(keys, "' | '"), value);
  return text + "  esac\n}\n";
}

std::string bash_completion(const CommandHelp& tree) {
  constexpr const char* kinds[] = {"", "@words", "@keys", "@source", "@path", "@text"};  // in order of Takes
  std::map<std::string, std::vector<std::string>> commands, flags, values;
  for (const CommandHelp* command : all_commands(tree)) {
    std::vector<std::string> below, names;
    for (const CommandHelp& c : command->commands) below.push_back(last_word(c));
    if (!below.empty()) commands[fmt::format("{}", fmt::join(below, " "))].push_back(command->name);
    const auto add_values = [&](const FlagHelp& flag, const std::string& name) {
      const std::string words = flag.words.empty() ? "" : fmt::format(" {}", fmt::join(flag.words, " "));
      values[kinds[static_cast<size_t>(flag.takes)] + words].push_back(command->name + "," + name);
    };
    for (const FlagHelp& flag : command->flags) {
      for (const std::string& name : flag.names) {
        names.push_back(name);
        if (flag.takes != Takes::nothing) add_values(flag, name);
      }
    }
    flags[fmt::format("{}", fmt::join(names, " "))].push_back(command->name);
    if (!command->arguments.empty()) add_values(command->arguments.back(), "");
  }
  return bash_head + bash_table("_sextant_commands", commands) + bash_table("_sextant_flags", flags) +
         bash_table("_sextant_values", values) + bash_function;
}

std::string in_quotes(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

/// Arguments of fish's `complete` for the values that a flag or an argument takes.
std::string offers(const FlagHelp& flag) {
  std::string words;
  for (const std::string& word : flag.words)
    words += (words.empty() ? "" : " ") + word + (flag.takes == Takes::keys ? "=" : "");
  switch (flag.takes) {
    case Takes::words:
    case Takes::keys:
      return " -x -a " + in_quotes(words);
    case Takes::source:
      return " -r -F -a " + in_quotes(words);
    case Takes::path:
      return " -r -F";
    case Takes::text:
      return " -x";
    case Takes::nothing:
      break;
  }
  return "";
}

constexpr const char* fish_head = R"(# fish completion of sextant, made by `sextant completion fish`.

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

std::string fish_completion(const CommandHelp& tree) {
  std::string names, lines;
  for (const CommandHelp* command : all_commands(tree)) {
    names += " " + in_quotes(command->name);
    const std::string at = fmt::format("complete -c sextant -n '__sextant_at {}'", command->name);
    for (const CommandHelp& below : command->commands) {
      lines += fmt::format("{} -a {} -d {}\n", at, last_word(below), in_quotes(below.description));
    }
    for (const FlagHelp& flag : command->flags) {
      std::string head;
      for (const std::string& name : flag.names)
        head += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      lines += fmt::format("{}{}{} -d {}\n", at, head, offers(flag), in_quotes(flag.meaning));
    }
    if (!command->arguments.empty()) {
      std::string what = offers(command->arguments.back());
      for (const char* needs_value : {" -x", " -r"}) {  // only flags need a value
        if (what.starts_with(needs_value)) what.erase(0, 3);
      }
      if (!what.empty()) lines += fmt::format("{}{}\n", at, what);
    }
  }
  return fish_head + fmt::format("set -g __sextant_commands{}\n", names) + lines;
}

struct Shell {
  const char* name;
  std::string (*script)(const CommandHelp& tree);
};
constexpr Shell shells[] = {{"bash", bash_completion}, {"zsh", zsh_completion}, {"fish", fish_completion}};

void print_completion(const std::string& shell, const CLI::App& command) {
  const Shell& known = find_entry<Shell>(shells, shell, "shell");
  fmt::print("{}", known.script(command_tree(*command.get_parent())));
}

}  // namespace

void add_completion_command(CLI::App& app) {
  auto [command, name] = add_command<std::string>(
      app, "completion", "Print what a shell needs to complete commands, flags and options",
      print_completion);
  std::string names;
  for (const Shell& shell : shells) names += fmt::format("{}{}", names.empty() ? "" : "|", shell.name);
  add_value(command, "shell", name, names, "Which shell")->required();
  command.footer(
      "A package of Sextant installs all three. By hand:\n"
      "Examples:\n"
      "  sextant completion bash > ~/.local/share/bash-completion/completions/sextant\n"
      "  sextant completion zsh > _sextant        (in a folder of $fpath)\n"
      "  sextant completion fish > ~/.config/fish/completions/sextant.fish");
}

}  // namespace sextant
