#include "sextant/base/registry.h"

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/vdo_folder.h"

namespace sextant {

std::span<const Adapter> adapters() {
  static const std::vector<Adapter> table = {
      {"vdo", "multimot / VDO-SLAM folder: images, disparity, flow and masks in files",
       "vdo:/data/kitti_03_demo@0-19", open_vdo_folder, [] { return describe_options(VdoFolderOptions{}); }},
  };
  return table;
}

std::unique_ptr<Sequence> open_source(const SourceSpec& source) {
  return find_entry(adapters(), source.adapter, "adapter").open(source);
}

}  // namespace sextant
