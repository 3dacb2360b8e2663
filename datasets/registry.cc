#include "sextant/base/names.h"

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/kitti_tracking.h"
#include "sextant/datasets/rendered_sequence.h"
#include "sextant/datasets/sceneflow2015.h"
#include "sextant/datasets/tartanair.h"
#include "sextant/datasets/vdo_folder.h"
#include "sextant/datasets/vkitti1.h"
#include "sextant/datasets/vkitti2.h"

namespace sextant {

std::span<const Adapter> adapters() {
  static const std::vector<Adapter> table = {
      {"vdo", "multimot / VDO-SLAM folder: images, disparity, flow and masks in files",
       "vdo:/data/kitti_03_demo@0-19", open_vdo_folder, [] { return describe_options(VdoFolderOptions{}); }},
      {"sceneflow", "KITTI scene flow 2015: stereo pairs at two times with true flow and disparity",
       "sceneflow:/data/kitti_sceneflow_2015#000002", open_sceneflow2015,
       [] { return describe_options(SceneFlow2015Options{}); }},
      {"synthetic",
       "rendered street scenes, exact depth, flow, masks and truth: "
       "s18, s01-turn, s01-crossing, city, highway, stereo-drive",
       "synthetic:s18", open_synthetic, [] { return describe_options(SyntheticOptions{}); }},
      {"kitti",
       "KITTI tracking as downloaded: stereo images, MOTS masks, oxts, labels; flow and depth computed",
       "kitti:/data/kitti_tracking#0005@0-15", open_kitti_tracking,
       [] { return describe_options(KittiTrackingOptions{}); }},
      {"vkitti1", "Virtual KITTI 1.3.1: exact depth, flow, masks and truth, or its text alone",
       "vkitti1:/data/vkitti#0018/clone", open_vkitti1, [] { return describe_options(Vkitti1Options{}); }},
      {"vkitti2", "Virtual KITTI 2.0.3: as vkitti1, with a right camera and backward flow",
       "vkitti2:/data/vkitti2#Scene18/clone", open_vkitti2,
       [] { return describe_options(Vkitti2Options{}); }},
      {"tartanair", "TartanAir V2, front cameras: exact depth, flow and camera poses of static scenes",
       "tartanair:/data/tartanair#ArchVizTinyHouseDay/Data_easy/P000", open_tartanair,
       [] { return describe_options(TartanairOptions{}); }},
      {"replay-vkitti1", "true motions of Virtual KITTI 1.3.1, from its text files, as a rendered scene",
       "replay-vkitti1:/data/vkitti_1.3.1_text#0018@124-134", open_replay_vkitti1,
       [] { return describe_options(ReplayVkitti1Options{}); }},
      {"replay-kitti", "true motions of KITTI tracking, from its text files, as a rendered scene",
       "replay-kitti:/data/kitti_tracking#0003@0-30", open_replay_kitti,
       [] { return describe_options(ReplayKittiOptions{}); }},
  };
  return table;
}

std::unique_ptr<Sequence> open_source(const SourceSpec& source) {
  return find_entry(adapters(), source.adapter, "adapter").open(source);
}

}  // namespace sextant
