#pragma once

// The commands as data, read from the program's own parser. Man pages and shell completions are generated
// from them.
//
// A flag whose type reads `this|that` is a choice between these words, which completions offer. For types
// such as FORMAT and NAME the words are looked up by the flag's name (command_tree.cc).

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace sextant {

/// Kind of value that a flag or argument takes; it decides which words completions offer.
enum class Takes {
  nothing,  ///< a switch
  words,    ///< one of `words`
  keys,     ///< KEY=VALUE, with `words` as keys
  source,   ///< one of `words`, or an adapter's name, a colon and a path
  path,
  text,  ///< a number or free text: nothing to offer
};

/// A flag, or a positional argument.
struct FlagHelp {
  std::vector<std::string> names;  ///< "--out", "-h"; an argument has one name
  std::string type;                ///< "DIR"; empty: takes nothing
  std::string range;               ///< "INT in [1 - 1024]", or empty
  std::string meaning;
  std::string default_value;
  std::string environment;  ///< environment variable that gives the value when the flag is absent
  std::vector<std::string> words;
  Takes takes = Takes::nothing;
  bool required = false;
  bool repeats = false;
};

struct CommandHelp {
  std::string name;  ///< "sextant evaluate ego"
  std::string description;
  std::string footer;
  std::vector<FlagHelp> arguments;
  std::vector<FlagHelp> flags;
  std::vector<CommandHelp> commands;
};

/// Reads the commands, flags and arguments of `app` and of all its subcommands.
CommandHelp command_tree(const CLI::App& app);

/// Returns `tree` and all commands below it; each command comes before its subcommands.
std::vector<const CommandHelp*> all_commands(const CommandHelp& tree);

}  // namespace sextant
