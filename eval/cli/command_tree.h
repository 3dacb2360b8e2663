#pragma once

// The commands as data, read from the program's own parser: what man pages and completions are made of.
//
// A flag whose type reads `this|that` is a choice between these words; completions offer them. FORMAT, NAME
// and the like are filled in by the flag's name (command_tree.cc).

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace sextant {

/// What completions offer where a value stands.
enum class Takes {
  nothing,  ///< a switch
  words,    ///< one of `words`
  keys,     ///< KEY=VALUE, with `words` as keys
  source,   ///< one of `words`, or an adapter's name, a colon and a path
  path,
  text,  ///< a number or a text of the user's: nothing to offer
};

/// A flag, or an argument without one.
struct FlagHelp {
  std::vector<std::string> names;  ///< "--out", "-h"; of an argument its one name
  std::string type;                ///< "DIR"; empty: takes nothing
  std::string range;               ///< "INT in [1 - 1024]", or empty
  std::string meaning;
  std::string default_value;
  std::string environment;  ///< variable that stands for it
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

CommandHelp command_tree(const CLI::App& app);

/// `tree` and all commands below it, a command before its own.
std::vector<const CommandHelp*> all_commands(const CommandHelp& tree);

}  // namespace sextant
