#include "sextant/base/files.h"
#include "sextant/eval/report/fetch_lines.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {

std::span<const EmbeddedFile> published_files();
std::span<const EmbeddedFile> system_description_files();

Json published_values() { return parse_json(published_files().front().text, "published values"); }
Json system_descriptions() {
  return parse_json(system_description_files().front().text, "descriptions of the systems");
}

std::span<const PaperTable> paper_tables() {
  static const std::vector<PaperTable> tables = {
      {"table_1_classification",
       "I",
       "Virtual KITTI 1.3.1, worlds 0001, 0002, 0006, 0018 and 0020, with flow of PWC-Net and masks of Mask "
       "R-CNN",
       fetch_vkitti1,
       classification_table,
       {"data"}},
      {"table_2_flow_error",
       "II",
       "Virtual KITTI 1.3.1, frames 124-134 of 0018, with flow of PWC-Net",
       fetch_vkitti1,
       flow_error_table,
       {"data"}},
      {"table_3_sets",
       "III",
       "Virtual KITTI 1.3.1, frames 225-235 and 410-418 of 0001 and 124-134 of 0018, with flow of PWC-Net and "
       "masks of Mask R-CNN",
       fetch_vkitti1,
       sets_table,
       {"set", "data"}},
      {"table_4_ego_motion", "IV", "KITTI tracking, stereo images of the 12 sequences with a moving camera",
       fetch_kitti, ego_motion_table},
      {"table_5_velocity",
       "V",
       "KITTI tracking, stereo images of 9 sequences with moving objects",
       fetch_kitti,
       velocity_table,
       {"data"}},
      {"table_6_limit", "VI", "", "", limit_table},
      {"table_7_run_time", "VII", "", "", run_time_table},
      {"table_8_attribution", "VIII", "", "", attribution_table, {"set", "data", "body", "path"}},
      {"table_9_systems", "IX", "", "", systems_table, {"data"}},
  };
  return tables;
}

}  // namespace sextant
