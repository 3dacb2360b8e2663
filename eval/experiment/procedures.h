#pragma once

// Procedures: how somebody else estimates, as options of ours. A procedure is a plan without sources and
// seeds (plan.h): estimators with their front ends, options, and the noise it was run under. They come with
// the program, eval/procedures/NAME.json, each with a "description" that says what it follows. To add one,
// add a file.

#include <string>

#include "sextant/base/options.h"

namespace sextant {

/// Names in alphabetical order.
std::vector<std::string> procedure_names();

/// The file as JSON. Throws Error on an unknown name, naming the nearest.
Json find_procedure(const std::string& name);

/// `plan` with the procedure's keys where it has none of its own: objects key by key, lists as a whole.
Json on_procedure(const std::string& name, const Json& plan);

/// "extraction", "pipeline" and "estimator" of one of its estimators, as options of `sextant run`. Throws
/// Error when the procedure has no estimator of that name.
Json procedure_options(const std::string& name, const std::string& estimator);

}  // namespace sextant
