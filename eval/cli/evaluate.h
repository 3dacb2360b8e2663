#pragma once

// `sextant evaluate` and its subcommands. Two programs hold them (main.cc, full_main.cc): the light one
// starts in a few milliseconds because it links no image library, and hands over where a SOURCE is given, for
// which adapters are needed. So these commands get the reader of sources as a function.

#include <functional>
#include <string>
#include <vector>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/evaluation/ego_evaluation.h"

namespace sextant {

/// Opens a SOURCE and gives its true camera trajectory.
using ReferenceLoader = std::function<EgoReference(const std::string& source, const CommonFlags& flags)>;

/// Writes the report of `evaluate ego --out`.
using EgoReportWriter = std::function<void(const std::vector<EgoResult>&, const EgoReference&,
                                           const EgoOptions&, const std::string& out)>;

/// What the full program adds to `evaluate ego`; where it is empty, SOURCEs and --out are Errors.
struct EgoExtras {
  ReferenceLoader load;
  EgoReportWriter write_report;
};

/// ego, flow and depth: what needs no images of data sets.
CLI::App* add_light_evaluate_commands(CLI::App& app, const EgoExtras& extras);
void add_evaluate_ego_command(CLI::App& evaluate, const EgoExtras& extras);
void add_evaluate_flow_command(CLI::App& evaluate);
void add_evaluate_depth_command(CLI::App& evaluate);
/// Needs the definitions of velocity, and with them the estimators.
void add_evaluate_objects_command(CLI::App& evaluate);

/// "NAME=PATH": a run of the system NAME. A plain path has none.
struct EstimateArgument {
  std::string system;
  std::string path;
};
EstimateArgument parse_estimate(const std::string& text);

/// Whether `text` has the form "adapter:path" and is not the name of a file.
bool looks_like_source(const std::string& text);

}  // namespace sextant
