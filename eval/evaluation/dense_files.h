#pragma once

// Flow and depth images of any system against the truth, from files or folders of files with equal names.
//
//   flow   flo | kitti | vkitti         auto: .flo by its name; the two kinds of PNG must be told apart
//          in a folder an image may stand once: as .png and .flo only where the format decides
//   depth  disparity256 | depth256 | cm   16-bit PNG; disparity needs bf (px m)
//
// Subsets: every label of a mask image (8 or 16-bit PNG, 0 background), and, with KITTI's flow_noc or
// disp_noc as second truth, the pixels that are visible in both images (noc) and those that are not (occ).

#include <string>

#include "sextant/base/names.h"
#include "sextant/eval/report/table.h"

namespace sextant {

enum class FlowFormat { by_name, flo, kitti, vkitti };
constexpr Names<4> names_of(FlowFormat) { return {"auto", "flo", "kitti", "vkitti"}; }
enum class DepthFormat { disparity256, depth256, cm };
constexpr Names<3> names_of(DepthFormat) { return {"disparity256", "depth256", "cm"}; }

template <Named Format>
struct DenseFiles {
  std::string estimate, truth;  ///< files, or folders
  Format estimate_format{}, truth_format{};
  std::string mask;           ///< file or folder; may be empty
  std::string visible_truth;  ///< truth of the pixels visible in both (noc); may be empty
};

/// One row per subset ("all", "noc", "occ", "mask 3"): over all images together. Throws Error on files that
/// are missing, damaged or of another size, and when no pixel has both estimate and truth.
Table evaluate_flow(const DenseFiles<FlowFormat>& files);
/// bf: focal length times baseline, px m, for disparities; 0: not known.
Table evaluate_depth(const DenseFiles<DepthFormat>& files, double bf);

}  // namespace sextant
