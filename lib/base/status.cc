#include "sextant/base/status.h"

#include <array>

#include "sextant/base/error.h"

namespace sextant {
namespace {
constexpr std::array<std::string_view, 10> status_names = {
    "ok",    "no_truth",  "not_detected", "lost",       "diverged", "too_few_points",
    "gated", "collinear", "at_infinity",  "no_parallax"};
constexpr std::array<std::string_view, 4> gate_names = {"none", "distance", "area", "static"};
}  // namespace

std::string_view to_string(Status status) { return status_names.at(static_cast<size_t>(status)); }

Status status_from_string(std::string_view name) {
  for (size_t i = 0; i < status_names.size(); ++i) {
    if (status_names[i] == name) return static_cast<Status>(i);
  }
  fail("unknown status '{}'", name);
}

std::string_view to_string(Gate gate) { return gate_names.at(static_cast<size_t>(gate)); }

}  // namespace sextant
