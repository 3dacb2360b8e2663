#pragma once

// Names of sequences of Virtual KITTI.

#include <string>

namespace sextant {

struct VkittiName {
  std::string group;      ///< "0018" (1.3.1), "Scene18" (2.0.3)
  std::string variation;  ///< "clone" when not given

  std::string text() const { return group + "/" + variation; }
};

/// "0018/clone" or "0018".
VkittiName parse_vkitti1_name(const std::string& sequence);
/// "Scene18/clone", "0018/clone", "Scene18" or "0018".
VkittiName parse_vkitti2_name(const std::string& sequence);

}  // namespace sextant
