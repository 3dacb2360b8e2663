#include "sextant/eval/cli/command.h"

#include "sextant/estimator/registry.h"
#include "sextant/eval/experiment/case_estimator.h"

namespace sextant {

// Apart from the other shared parts: whoever links it links every estimator.
std::string estimator_list() {
  std::string text;
  for (const EstimatorEntry& entry : all_estimators())
    text += fmt::format("  {:<20} {}\n", entry.name, entry.description);
  return text;
}

}  // namespace sextant
