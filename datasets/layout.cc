#include "sextant/datasets/layout.h"

#include <algorithm>

#include "sextant/base/registry.h"
#include "sextant/datasets/kitti_layout.h"
#include "sextant/datasets/vkitti_layout.h"

namespace sextant {

std::span<const Layout> layouts() {
  static const std::vector<Layout> table = {
      {"kitti", "KITTI tracking: image_02, image_03, calib, oxts, label_02, MOTS; and depth_02, flow_02",
       write_kitti_layout, [] { return describe_options(KittiLayoutOptions{}); }},
      {"vkitti1", "Virtual KITTI 1.3.1: camera f = 725, 1242x375 only", write_vkitti1_layout,
       [] { return describe_options(VkittiLayoutOptions{}); }},
      {"vkitti2",
       "Virtual KITTI 2.0.3: any camera, right image, backward flow; images as JPEG, which is lossy",
       write_vkitti2_layout, [] { return describe_options(VkittiLayoutOptions{}); }},
  };
  return table;
}

const Layout& find_layout(const std::string& name) { return find_entry(layouts(), name, "layout"); }

int default_number(const std::string& sequence) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto first = std::ranges::find_if(sequence, is_digit);
  int number = 0;
  for (auto it = first; it != sequence.end() && is_digit(*it) && number < 1'000'000; ++it) {
    number = 10 * number + (*it - '0');
  }
  return number;
}

}  // namespace sextant
