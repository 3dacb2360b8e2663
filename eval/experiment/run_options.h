#pragma once

// The options of a run as one tree: "extraction", "pipeline", "estimator", "source" and, on the command line,
// "noise".

#include <span>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"

namespace sextant {

/// The tree that `options`, which is JSON or @FILE, gives, with each "dotted.key=value" of `sets` on top of
/// it.
Json options_tree(const std::string& options, std::span<const std::string> sets);

/// The options tree, read and completed with defaults.
struct ResolvedOptions {
  ExtractionOptions extraction;
  PipelineOptions pipeline;
  Json estimator = Json::object();
  Json source = Json::object();
};

/// Throws Error on an unknown key anywhere above "estimator" and "source", which are read by their owners.
ResolvedOptions resolve_options(const Json& tree);

/// All keys that the tree may have with an estimator, apart from those of the data set's adapter
/// (`source.*`).
std::vector<OptionHelp> run_options(const std::string& estimator);
/// Keys of a plan that are options.
std::vector<OptionHelp> plan_options();

}  // namespace sextant
