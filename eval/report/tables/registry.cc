#include "sextant/base/files.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {

std::span<const EmbeddedFile> system_description_files();

Json system_descriptions() {
  return parse_json(system_description_files().front().text, "descriptions of the systems");
}

namespace {

/// Returns the rows of a table of the paper with the reasons why values are not comparable.
template <PublishedTable (*rows_of)(const Evidence&)>
PublishedTable judged(const Evidence& evidence) {
  return with_reasons(rows_of(evidence));
}

}  // namespace

std::span<const PaperTable> paper_tables() {
  static const std::vector<PaperTable> tables = {
      {"table_1_classification", "I", PaperPlace::table_1, judged<classification_table>, {}, {"data"}},
      {"table_2_flow_error", "II", PaperPlace::table_2, judged<flow_error_table>, {}, {"data"}},
      {"table_3_sets", "III", PaperPlace::table_3, judged<sets_table>, {}, {"set", "data"}},
      {"table_4_ego_motion", "IV", PaperPlace::table_4, judged<ego_motion_table>},
      {"table_5_velocity", "V", PaperPlace::table_5, judged<velocity_table>, {}, {"data"}},
      {"table_6_limit", "VI", PaperPlace::ours, {}, limit_table},
      {"table_7_run_time", "VII", PaperPlace::ours, {}, run_time_table},
      {"table_8_attribution",
       "VIII",
       PaperPlace::ours,
       {},
       attribution_table,
       {"set", "data", "body", "path"}},
      {"table_9_systems", "IX", PaperPlace::ours, {}, systems_table, {"data"}},
  };
  return tables;
}

}  // namespace sextant
