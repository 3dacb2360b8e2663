#include "sextant/eval/report/figures/record_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

using testing::HasSubstr;

/// Four objects in two frames: 1 and 2 move, 3 and 4 stand. The threshold is wrong about 4, likelihood about
/// 2.
std::vector<Record> classified_records() {
  std::vector<Record> records;
  for (const std::string estimator : {"joint_flow", "joint_flow_depth, likelihood"}) {
    for (int frame = 1; frame <= 2; ++frame) {
      for (int id = 1; id <= 4; ++id) {
        Record r =
            RecordOf{"synthetic", "s18", estimator, fmt::format("object:{}", id), "none", 0.2, 0, frame};
        const bool moves = id <= 2;
        r.values = {{"dynamic_gt", moves ? 1 : 0}, {"v_gt_origin_kmh", moves ? 10 : 0}};
        if (estimator == "joint_flow") {
          r.values["dynamic"] = id != 3 ? 1 : 0;
          r.values["moving_share"] = id != 3 ? 0.8 : 0.1;
        } else {
          r.values["dynamic"] = id == 1 ? 1 : 0;
          r.values["moving_share"] = 0.8;
          r.values["motion_sigmas"] = id == 1 ? 9.0 : id == 2 ? 3.0 : 0.5;
          r.values["detectable_kmh"] = frame == 1 ? 8.0 : 12.0;
        }
        records.push_back(r);
      }
    }
  }
  // Beyond the gates, and without a decision: they do not count.
  records.push_back(records.front());
  records.back().status = Status::gated;
  records.back().gate = Gate::distance;
  records.push_back(records.front());
  records.back().values.erase("dynamic");
  return records;
}

TEST(ClassificationFigures, TheTableCountsDecisionsAndWhatWasMissedInSight) {
  const Table table = classification_test_table(classified_records());
  ASSERT_EQ(table.rows.size(), 2U);
  const auto number = [&](size_t row, const char* key) {
    return *table.rows[row][table.place(key)].number();
  };
  EXPECT_EQ(number(0, "n_static"), 4);
  EXPECT_EQ(number(0, "n_false"), 2);
  EXPECT_EQ(number(0, "false_percent"), 50);
  EXPECT_EQ(number(0, "n_missed"), 0);
  EXPECT_EQ(number(0, "area"), 0.75);  // object 4 ties with both that move
  EXPECT_TRUE(table.rows[0][table.place("n_missed_in_sight")].is_empty());
  EXPECT_EQ(number(1, "n_false"), 0);
  EXPECT_EQ(number(1, "n_missed"), 2);
  EXPECT_EQ(number(1, "n_missed_in_sight"), 1);  // 10 km/h where 8 can be found, not where 12 can
  EXPECT_EQ(number(1, "area"), 1);
}

TEST(ClassificationFigures, CurvesFollowTheirRecords) {
  std::vector<Record> all = classified_records();
  const std::vector<Figure> figures = classification_figures(all);
  ASSERT_EQ(figures.size(), 1U);
  const auto whole = [](const std::vector<Figure>& some) { return draw(some[0]).at(some[0].name + ".svg"); };
  const std::string before = whole(figures);
  EXPECT_THAT(before, HasSubstr("static called dynamic"));
  EXPECT_THAT(before, HasSubstr("likelihood"));
  for (Record& record : all) {
    if (record.values.contains("motion_sigmas") && record.body == "object:3")
      record.values["motion_sigmas"] = 10;
  }
  EXPECT_NE(whole(classification_figures(all)), before);
}

TEST(ClassificationFigures, NoneWithoutBothKinds) {
  std::vector<Record> all = classified_records();
  std::erase_if(all, [](const Record& record) { return record.values.at("dynamic_gt") == 0; });
  EXPECT_TRUE(classification_figures(all).empty());
  EXPECT_TRUE(classification_figures({}).empty());
}

}  // namespace
}  // namespace sextant
