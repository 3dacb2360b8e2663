#include "sextant/eval/report/paper.h"

#include <regex>

#include "sextant/base/testing.h"

namespace sextant {
namespace {

/// Files of this layer that are neither tests nor their helpers.
std::vector<fs::path> report_sources() {
  std::vector<fs::path> sources;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(SEXTANT_SOURCE) / "eval" / "report")) {
    const std::string name = entry.path().filename().string();
    if ((name.ends_with(".cc") || name.ends_with(".h")) && !name.ends_with("_test.cc") &&
        !name.ends_with("testing.h"))
      sources.push_back(entry.path());
  }
  return sources;
}

TEST(ReportSources, NameNoDataSetAndNoEstimator) {
  std::set<std::string> names;
  for (const PaperEstimator& estimator : paper().estimators) names.insert(estimator.name);
  for (const SetData& data : paper().sets)
    names.merge(std::set<std::string>{'"' + data.filter.dataset + '"', data.filter.sequence, data.set});
  names.insert('"' + paper().recorded_dataset + '"');
  for (const auto& [own, recorded] : paper().parts_of_recorded) names.insert(own);
  ASSERT_GT(report_sources().size(), 30U);
  for (const fs::path& source : report_sources()) {
    const std::string text = read_file(source);
    for (const std::string& name : names) {
      if (name.size() > 3) {
        EXPECT_EQ(text.find(name), std::string::npos) << source << " names " << name;
      }
    }
    static const std::regex cell_of_text("[=!]= Cell\\(|\\brow\\[[0-9]");
    EXPECT_FALSE(std::regex_search(text, cell_of_text)) << source << " reads a rendered cell";
  }
}

TEST(Paper, NamesSequencesObjectsAndColumns) {
  const Paper& p = paper();
  EXPECT_EQ(p.sequence_of("replay-vkitti1", "0018/clone"), "18");
  EXPECT_EQ(p.sequence_of("kitti", "0003"), "03");
  EXPECT_EQ(p.sequence_of("kitti", "0019"), "");
  EXPECT_EQ(p.ids_of("00", "cyclist"), std::set<int>{2});  // track 1 of KITTI
  EXPECT_TRUE(p.ids_of("00", "all").empty());
  EXPECT_EQ(p.column_of("joint_flow, release"), "joint");
  EXPECT_FALSE(p.column_of("joint_flow_depth"));
  EXPECT_EQ(data_title("kitti", "0004"), "KITTI tracking 0004");
  EXPECT_EQ(data_title("vdo", "kitti_03_demo"), "authors' sample of KITTI tracking 0003");
  EXPECT_EQ(data_title("own", "a"), "own a");
  EXPECT_THROW(p.table("XX"), InternalError);
  EXPECT_THROW(p.fetch("nothing"), InternalError);
}

}  // namespace
}  // namespace sextant
