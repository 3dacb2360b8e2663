#pragma once

// What check_source() has found, for people and for programs.

#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/check/check_source.h"

namespace sextant {

/// Two tables, content and conventions, with the likely causes below.
std::string check_page(const std::string& source, const SequenceInfo& info,
                       const std::vector<SourceCheck>& checks);
/// {"source","failed","suspect","checks":[{"check","outcome",..,"cause","message"}]}
Json check_json(const std::string& source, const std::vector<SourceCheck>& checks);
/// Throws Error that names the first failed check, where there is one.
void refuse_failed(const std::string& source, const std::vector<SourceCheck>& checks);

}  // namespace sextant
