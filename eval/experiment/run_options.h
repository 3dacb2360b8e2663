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

/// Returns the tree given by `options` (JSON or @FILE), in which each "dotted.key=value" of `sets` has set
/// one value. Throws Error if the text is not a JSON object or an assignment is malformed.
Json options_tree(const std::string& options, std::span<const std::string> sets);

/// The options of a run, completed with defaults.
struct ResolvedOptions {
  ExtractionOptions extraction;
  PipelineOptions pipeline;
  Json estimator = Json::object();
  Json source = Json::object();
};

/// Reads a tree. Throws Error on an unknown key anywhere except below "estimator" and "source", which are
/// read by the estimator and the adapter.
ResolvedOptions resolve_options(const Json& tree);

/// Returns all keys that the tree may have with an estimator, except those of the data set's adapter
/// (`source.*`). Throws Error on an unknown estimator.
std::vector<OptionHelp> run_options(const std::string& estimator);
/// Returns the keys of a plan that are documented as options.
std::vector<OptionHelp> plan_options();

}  // namespace sextant
