#include "sextant/eval/records/record_fields.h"

#include <charconv>
#include <optional>

#include "sextant/base/names.h"
#include "sextant/base/text.h"

namespace sextant::internal {

bool is_body(std::string_view text) {
  constexpr std::string_view prefix = "object:";
  if (text == "ego") return true;
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  int id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  return is_digits(text) && error == std::errc() && end == text.data() + text.size();
}

bool is_flow_truth(std::string_view text) { return text == "given" || text == "induced"; }

bool is_count(int n) { return n >= 0; }

bool is_number_of(std::string_view map, Interned name, double value) {
  const bool is_negative_error =
      value < 0 && map == to_string(NumberMap::errors) && find_metric(NumberMap::errors, name.str()) != nullptr;
  return is_number(value) && !is_negative_error;
}

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
