#pragma once

// What the adapters of both releases of Virtual KITTI share.

#include <string>

#include "sextant/datasets/folder_sequence.h"

namespace sextant {

inline constexpr int vkitti_width = 1242;  ///< px, of both releases
inline constexpr int vkitti_height = 375;

/// Without any file, the frames of the truth and the releases' size.
FolderFiles vkitti_files(const SequenceTruth& truth);

/// Throws Error when a chosen frame has no true pose although others have.
void check_vkitti_frames(const Sequence& sequence, const std::string& root);

// ---- names of sequences

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
