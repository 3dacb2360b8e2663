#pragma once

// What the adapters of both releases of Virtual KITTI share.

#include <string>

#include "sextant/datasets/folder_sequence.h"
#include "sextant/datasets/vkitti_names.h"

namespace sextant {

inline constexpr int vkitti_width = 1242;  ///< px, of both releases
inline constexpr int vkitti_height = 375;

/// Without any file, the frames of the truth and the releases' size.
FolderFiles vkitti_files(const SequenceTruth& truth);

/// Throws Error when a chosen frame has no true pose although others have.
void check_vkitti_frames(const Sequence& sequence, const std::string& root);

}  // namespace sextant
