#include "sextant/eval/records/record_fields.h"

#include <algorithm>

#include "sextant/base/error.h"

namespace sextant::internal {

bool is_body(std::string_view text) {
  constexpr std::string_view prefix = "object:";
  return text == "ego" ||
         (text.starts_with(prefix) && text.size() > prefix.size() &&
          std::ranges::all_of(text.substr(prefix.size()), [](char c) { return c >= '0' && c <= '9'; }));
}

bool is_flow_truth(std::string_view text) { return text == "given" || text == "induced"; }

bool is_count(int n) { return n >= 0; }

const char* from_text(std::string_view text, Status& status) {
  try {
    status = status_from_string(text);
    return nullptr;
  } catch (const Error&) {
    return "a status of docs/metrics.md";
  }
}

const char* from_text(std::string_view text, Gate& gate) {
  for (const Gate known : {Gate::distance, Gate::area, Gate::is_static}) {
    if (to_string(known) != text) continue;
    gate = known;
    return nullptr;
  }
  return "distance, area or static";
}

}  // namespace sextant::internal
