#include "sextant/eval/cli/evaluate.h"
#include "sextant/eval/external/source_reference.h"

namespace sextant {

void add_evaluate_command(CLI::App& app) {
  CLI::App* evaluate =
      add_light_evaluate_commands(app, [](const std::string& source, const CommonFlags& flags) {
        return source_reference(source, flags.data_root, options_tree(flags.options, flags.sets));
      });
  add_evaluate_objects_command(*evaluate);
}

}  // namespace sextant
