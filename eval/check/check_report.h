#pragma once

// Reports of check_source() for people and for programs.

#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/check/check_source.h"

namespace sextant {

/// Returns two tables, content and conventions, each followed by the likely causes and messages of its
/// checks.
std::string check_page(const std::string& source, const SequenceInfo& info,
                       const std::vector<SourceCheck>& checks);
/// Returns {"source","failed","suspect","checks":[{"check","outcome",..,"cause","message"}]}.
Json check_json(const std::string& source, const std::vector<SourceCheck>& checks);
/// Returns one line for each different cause of the failed checks, with the names of these checks, "SOURCE:
/// CAUSE (failed: static flow, heading); `sextant data check SOURCE` shows the numbers", then the same for
/// other causes of checks that are SUSPECT over five samples or more.
std::vector<std::string> failures(const std::string& source, const std::vector<SourceCheck>& checks);
/// Returns failures() of the quick checks of a source; empty if it cannot be checked.
std::vector<std::string> failures_of(const SourceSpec& source, int jobs);
/// Throws Error with the number of failed checks and the first one of them, if a check failed.
void refuse_failed(const std::string& source, const std::vector<SourceCheck>& checks);

}  // namespace sextant
