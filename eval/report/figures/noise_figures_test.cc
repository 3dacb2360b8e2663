#include "sextant/eval/report/figures/record_figures.h"

#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

std::vector<NoiseLevelRow> rows() {
  std::vector<NoiseLevelRow> rows;
  for (const std::string body : {"ego", "object:2"}) {
    for (const std::string estimator : {"motion_only", "joint_flow"}) {
      for (const double level : {0.1, 0.2, 0.4}) {
        NoiseLevelRow row{"depth.delta_d_px", "vkitti1", "0018/clone", body, estimator, "depth", level, 20};
        SampleSummary error;
        error.mean = {0.01 * level, Interval{0.009 * level, 0.012 * level}};
        row.errors = {{"Et_m", error}, {"ER_deg", error}};
        rows.push_back(row);
      }
    }
  }
  return rows;
}

TEST(NoiseFigures, OneAnEstimatorAndOneABody) {
  const std::vector<Figure> figures = noise_level_figures(rows());
  ASSERT_EQ(figures.size(), 4U);
  EXPECT_EQ(figures[0].name, "error_depth.delta_d_px_vkitti1_0018-clone_joint_flow");
  EXPECT_EQ(figures[2].name, "estimators_depth.delta_d_px_vkitti1_0018-clone_ego");
  EXPECT_EQ(figures[0].data.rows.size(), 3U);
  EXPECT_THAT(figures[0].script, HasSubstr("[deg]"));
  EXPECT_THAT(figures[0].script, HasSubstr("'object 2'"));
}

/// Returns the script of the first figure for one line of these levels.
std::string script_at(const std::vector<double>& levels) {
  std::vector<NoiseLevelRow> at;
  for (const double level : levels) {
    at.push_back(rows().front());
    at.back().level = level;
  }
  return noise_level_figures(at).front().script;
}

TEST(NoiseFigures, TheAxisSaysHowTheLevelOfTheFlowIsRead) {
  std::vector<NoiseLevelRow> flow = rows();
  for (NoiseLevelRow& row : flow) {
    row.parameter = "flow.epe_px";
    row.noise = row.level == 0.1 ? "none" : "flow 1 px";
  }
  EXPECT_THAT(noise_level_figures(flow).front().script, HasSubstr("standard deviation of x and y"));
  for (NoiseLevelRow& row : flow) row.noise = row.level == 0.1 ? "none" : "flow 1 px, mean error";
  EXPECT_THAT(noise_level_figures(flow).front().script, HasSubstr("mean end-point error"));
}

TEST(NoiseFigures, LabelsAreTheLevels) {
  EXPECT_THAT(script_at({0.1, 0.2, 0.3}), HasSubstr("set xtics (\"0.1\" 0.1, \"0.2\" 0.2, \"0.3\" 0.3)"));
  EXPECT_THAT(script_at({0.125, 0.175}), HasSubstr("(\"0.125\" 0.125, \"0.175\" 0.175)"));
  EXPECT_THAT(script_at({100, 125, 150}), HasSubstr("(\"100\" 100, \"125\" 125, \"150\" 150)"));
  EXPECT_THAT(script_at({0.05, 0.1, 0.4, 1.6}), HasSubstr("(\"0.1\" 0.1, \"0.4\" 0.4, \"1.6\" 1.6)"))
      << "0.05 would overlap 0.1";
  EXPECT_THAT(script_at({1e-6, 1e-4, 1e-3, 0.01, 0.05}),
              HasSubstr("set xtics (\"0.01\" 0.01, \"0.05\" 0.05)"));
  EXPECT_THAT(script_at({0.05, 0.1, 0.15, 0.2, 0.25, 0.3}),
              HasSubstr("set xtics (\"0.05\" 0.05, \"0.1\" 0.1, "));
}

TEST(NoiseFigures, BarsOfCloseLevelsDoNotNarrowTheOthers) {
  const std::string even = script_at({0.1, 0.2, 0.3});
  EXPECT_THAT(even, HasSubstr(":(0.067")) << "0.9 times 1.5 times half of the step";
  EXPECT_THAT(even, Not(HasSubstr("width(level)")));
  const std::string geometric = script_at({0.05, 0.1, 0.4, 1.6});
  EXPECT_THAT(geometric, HasSubstr("width(level) = level < 0.075"));
  EXPECT_THAT(geometric, HasSubstr(":(0.9*width(column(\"level\"))) axes x1y2 with boxes"));
  EXPECT_THAT(geometric, HasSubstr(" : 0.3875")) << "1.5 times half of the mean step at the last level";
}

TEST(NoiseFigures, ALegendOfManyLinesHasColumns) {
  std::vector<NoiseLevelRow> of_bodies;
  for (int id = 1; id <= 8; ++id) {
    for (NoiseLevelRow row : rows()) {
      row.body = "object:" + std::to_string(id);
      if (row.estimator == "joint_flow" && row.level < 0.3) of_bodies.push_back(row);
    }
  }
  const Figure figure = noise_level_figures(of_bodies).front();
  EXPECT_THAT(figure.script, HasSubstr("maxcols 4"));
  EXPECT_GT(figure.width_cm, 11);
  EXPECT_THAT(draw(figure).at(figure.name + ".svg"), HasSubstr("object 8"));
  of_bodies.resize(6);
  EXPECT_LT(noise_level_figures(of_bodies).front().width_cm, 9);
}

TEST(NoiseFigures, LabelsHaveFourDigitsUnlessTheyWouldBeTheSame) {
  EXPECT_THAT(script_at({0, 1.0 / 3, 2.0 / 3}), HasSubstr("\"0.3333\" 0.3333333333333333,"));
  EXPECT_THAT(script_at({100.01, 100.02}), HasSubstr("(\"100.01\" 100.01, \"100.02\" 100.02)"));
}

TEST(NoiseFigures, BoundsOfEstimatorsWithOtherPointsAreSeveralLines) {
  std::vector<NoiseLevelRow> all = rows();
  for (NoiseLevelRow& row : all) row.limit.efficiency["Et_m"] = Efficiency{0.01 * row.level, 0.8, {}};
  EXPECT_THAT(noise_level_figures(all).back().script, HasSubstr("'bound (RMS)'"));
  EXPECT_THAT(noise_level_figures(all).back().script, Not(HasSubstr("bound of")));
  for (NoiseLevelRow& row : all) {
    if (row.estimator == "joint_flow" && row.level > 0.3) row.limit.efficiency["Et_m"].bound *= 1.001;
  }
  const Figure figure = noise_level_figures(all).back();
  EXPECT_THAT(figure.script, Not(HasSubstr("bound (RMS)")));
  EXPECT_THAT(figure.script, HasSubstr("'bound of motion_only'"));
  EXPECT_THAT(draw(figure).at(figure.name + ".svg"), HasSubstr("bound of joint_flow"));
}

TEST(NoiseFigures, DrawnTwiceTheBytesAreTheSameAndFollowTheData) {
  std::vector<NoiseLevelRow> data = rows();
  const Figure figure = noise_level_figures(data).front();
  const OutputFiles files = draw(figure);
  ASSERT_EQ(files.size(), 5U);
  EXPECT_TRUE(files.at(figure.name + ".pdf").starts_with("%PDF"));
  EXPECT_TRUE(files.at(figure.name + ".png").starts_with("\x89PNG"));
  EXPECT_THAT(files.at(figure.name + ".svg"), HasSubstr("object 2"));
  EXPECT_TRUE(draw(figure) == files);
  EXPECT_EQ(draw(noise_level_figures(data), 2).size(), 20U);
  data.erase(data.begin() + 3);  // the camera of joint_flow at the lowest level
  EXPECT_TRUE(draw(noise_level_figures(data).front()).at(figure.name + ".svg") !=
              files.at(figure.name + ".svg"));
}

TEST(NoiseFigures, GnuplotsWordsReachTheUser) {
  Figure figure;
  figure.name = "broken";
  figure.data.columns = {{"x", "x"}};
  figure.script = "plot nonsense nonsense\n";
  expect_error([&] { draw(figure); }, "gnuplot refused broken.gp");
}

TEST(NoiseFigures, AchievedNoiseIsDrawnByChannel) {
  AchievedNoiseRow row{.parameter = "depth.delta_d_px",
                       .source = "synthetic:s18",
                       .channel = "depth",
                       .requested_px = 0.2,
                       .achieved_px = 0.201};
  const std::vector<Figure> figures = achieved_noise_figures({row});
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_EQ(figures[0].name, "achieved_depth.delta_d_px_synthetic-s18");
  EXPECT_THAT(figures[0].script, HasSubstr("column(\"depth\")"));
}

TEST(NoiseFigures, NamesOfStrangersStayNames) {
  const TempFolder folder;
  const std::filesystem::path planted = folder.path() / "planted";
  std::vector<NoiseLevelRow> all;
  for (const std::string& text : hostile_texts(planted)) {
    for (NoiseLevelRow row : rows()) {
      row.estimator = text;
      all.push_back(row);
    }
  }
  std::vector<Figure> figures = noise_level_figures(all);
  EXPECT_GT(figures.size(), 10U);
  expect_drawn(figures, planted);
  for (NoiseLevelRow& row : all) row.dataset = row.sequence = row.parameter = row.estimator;
  figures = noise_level_figures(all);
  figures.resize(8);
  expect_drawn(figures, planted);
}

TEST(NoiseFigures, NamesThatAreAlikeAsColumnsStayTwoLines) {
  std::vector<NoiseLevelRow> all = rows();
  for (NoiseLevelRow& row : all) row.estimator = row.estimator == "joint_flow" ? "a b" : "a-b";
  const std::vector<Figure> figures = noise_level_figures(all);
  EXPECT_EQ(figures.back().data.columns.size(), 15U);  // level, and seven of each estimator
}

}  // namespace
}  // namespace sextant
