#include "sextant/eval/records/record_fields.h"

#include <algorithm>
#include <optional>

#include "sextant/base/names.h"

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
  const std::optional<Status> known = find_name<Status>(text);
  if (known) status = *known;
  return known ? nullptr : "a status of docs/metrics.md";
}

const char* from_text(std::string_view text, Gate& gate) {
  const std::optional<Gate> known = find_name<Gate>(text);
  if (!known || *known == Gate::none) return "distance, area or static";
  gate = *known;
  return nullptr;
}

}  // namespace sextant::internal
