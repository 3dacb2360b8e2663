#include "sextant/datasets/vkitti_names.h"

#include <fmt/format.h>

#include <algorithm>

namespace sextant {

VkittiName parse_vkitti1_name(const std::string& sequence) {
  const size_t slash = sequence.find('/');
  if (slash == std::string::npos) return {sequence, "clone"};
  return {sequence.substr(0, slash), sequence.substr(slash + 1)};
}

VkittiName parse_vkitti2_name(const std::string& sequence) {
  VkittiName name = parse_vkitti1_name(sequence);
  const bool digits =
      !name.group.empty() && std::ranges::all_of(name.group, [](char c) { return c >= '0' && c <= '9'; });
  if (digits && name.group.size() < 6) name.group = fmt::format("Scene{:02}", std::stoi(name.group));
  return name;
}

}  // namespace sextant
