// The script holds three tables (commands, flags and values of a command) and one function that reads them.

#include <map>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command_tree.h"

namespace sextant {
namespace {

constexpr const char* script_head = R"(# bash completion of sextant, made by `sextant completion bash`.

)";

/// The word under the cursor is taken from the line itself: readline parts words at ':' and '='.
constexpr const char* script_function = R"sh(
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

/// `case $1 in 'KEY' | 'KEY') echo 'TEXT' ;; ...`, keys of one text in one line.
std::string table(const char* function, const std::map<std::string, std::vector<std::string>>& keys_of) {
  std::string text = fmt::format("{}() {{\n  case $1 in\n", function);
  for (const auto& [value, keys] : keys_of)
    text += fmt::format("    '{}') echo '{}' ;;\n", fmt::join(keys, "' | '"), value);
  return text + "  esac\n}\n";
}

}  // namespace

std::string bash_completion(const CommandHelp& tree) {
  constexpr const char* kinds[] = {"", "@words", "@keys", "@source", "@path", "@text"};  // by Takes
  std::map<std::string, std::vector<std::string>> commands, flags, values;
  for (const CommandHelp* command : all_commands(tree)) {
    std::vector<std::string> below, names;
    for (const CommandHelp& c : command->commands) below.push_back(c.name.substr(c.name.rfind(' ') + 1));
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
  return script_head + table("_sextant_commands", commands) + table("_sextant_flags", flags) +
         table("_sextant_values", values) + script_function;
}

}  // namespace sextant
