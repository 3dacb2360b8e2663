#pragma once

// Evaluates flow and depth images of any system against the truth, from two files or from two folders of
// files with the same names.
//
//   flow   flo | kitti | vkitti          auto recognises .flo by the name; PNG files may be kitti or vkitti,
//          so their format must be given, and so it must if a folder contains an image as .png and as .flo
//   depth  disparity256 | depth256 | cm  16-bit PNG; disparity needs bf (px m)
//
// Subsets: every label of a mask image (8 or 16-bit PNG, 0 is background). With KITTI's flow_noc or disp_noc
// as second truth also the pixels visible in both images (noc) and all others (occ).
//
// Warnings name the likely cause of large errors (dense_warnings.h), and PNG flow in the order B, G, R.

#include <string>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/eval/report/table.h"

namespace sextant {

enum class FlowFormat { by_name, flo, kitti, vkitti };
constexpr Names<4> names_of(FlowFormat) { return {"auto", "flo", "kitti", "vkitti"}; }
enum class DepthFormat { disparity256, depth256, cm };
constexpr Names<3> names_of(DepthFormat) { return {"disparity256", "depth256", "cm"}; }

template <Named Format>
struct DenseFiles {
  std::string estimate, truth;  ///< two files, or two folders
  Format estimate_format{}, truth_format{};
  std::string mask;           ///< file or folder; may be empty
  std::string visible_truth;  ///< truth of the pixels visible in both images (noc); may be empty
};

/// Returns one row per subset ("all", "noc", "occ", "mask 3") over all images. Throws Error on files that are
/// missing, damaged or of another size, and if no pixel has both an estimate and truth. Appends the warnings
/// to `warnings` unless it is null.
Table evaluate_flow(const DenseFiles<FlowFormat>& files, std::vector<std::string>* warnings = nullptr);
/// As evaluate_flow(), for depth. `bf` is focal length times baseline (px m), needed for disparities; 0:
/// unknown.
Table evaluate_depth(const DenseFiles<DepthFormat>& files, double bf,
                     std::vector<std::string>* warnings = nullptr);

}  // namespace sextant
