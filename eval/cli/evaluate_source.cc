#include "sextant/eval/cli/evaluate.h"
#include "sextant/eval/evaluation/ego_report.h"
#include "sextant/eval/evaluation/source_reference.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/html/report_folder.h"

namespace sextant {

void add_evaluate_command(CLI::App& app) {
  const EgoExtras extras = {
      [](const std::string& source, const CommonFlags& flags) {
        return source_reference(source, flags.data_root, options_tree(flags.options, flags.sets));
      },
      [](const std::vector<EgoResult>& runs, const EgoReference& reference, const EgoOptions& options,
         const std::string& out) {
        write_output_folder(out, report_folder(ego_document(runs, reference, options), {}));
      }};
  CLI::App* evaluate = add_light_evaluate_commands(app, extras);
  add_evaluate_objects_command(*evaluate);
}

}  // namespace sextant
