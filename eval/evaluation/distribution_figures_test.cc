#include "sextant/eval/evaluation/run_statistics.h"

#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

std::vector<Distribution> samples() {
  Distribution many{"many \"quoted\"", {}};
  for (int i = 100; i >= 0; --i) many.values.push_back(i);
  return {many, {"one", {7}}};
}

double at(const Figure& figure, size_t row, size_t column) {
  return *figure.data.rows.at(row).at(column).number();
}

TEST(ErrorFigures, CumulativeFiguresHoldQuantiles) {
  const Figure figure = cumulative_figure("cdf", "E [m]", samples());
  ASSERT_EQ(figure.data.rows.size(), 101U);
  for (const size_t k : {0U, 25U, 50U, 100U}) {
    EXPECT_NEAR(at(figure, k, 0), static_cast<double>(k) / 100, 1e-15);
    EXPECT_NEAR(at(figure, k, 1), static_cast<double>(k), 1e-12);
    EXPECT_EQ(at(figure, k, 2), 7);
  }
}

TEST(ErrorFigures, BoxesHoldFiveQuantiles) {
  const Figure figure = box_figure("boxes", "E [m]", samples());
  ASSERT_EQ(figure.data.rows.size(), 2U);
  EXPECT_EQ(at(figure, 0, 2), 5);
  EXPECT_EQ(at(figure, 0, 4), 50);
  EXPECT_EQ(at(figure, 0, 6), 95);
  EXPECT_EQ(at(figure, 1, 4), 7);
}

TEST(ErrorFigures, BothAreDrawnByGnuplot) {
  const OutputFiles files =
      draw({cumulative_figure("cdf", "E [m]", samples()), box_figure("boxes", "E [m]", samples())}, 1);
  for (const char* name : {"cdf.svg", "boxes.svg"}) {
    ASSERT_TRUE(files.contains(name));
    EXPECT_THAT(files.at(name), HasSubstr("many"));
  }
}

TEST(ErrorFigures, LongNamesAreShortenedInTheLegend) {
  const std::string name(80, 'n');
  for (const Figure& figure : {cumulative_figure("cdf", "E [m]", {{name, {1, 2}}}),
                               box_figure("boxes", "E [m]", {{name, {1, 2}}})}) {
    EXPECT_THAT(figure.script, HasSubstr("nnn…nnn")) << figure.name;
    EXPECT_THAT(figure.script, Not(HasSubstr(std::string(45, 'n')))) << figure.name;
  }
}

TEST(ErrorFigures, NamesOfStrangersStayNames) {
  const TempFolder folder;
  const std::filesystem::path planted = folder.path() / "planted";
  std::vector<Distribution> all;
  for (const std::string& text : hostile_texts(planted)) all.push_back({text, {1, 2, 3}});
  expect_drawn({cumulative_figure("cdf", all[0].title, all), box_figure("boxes", all[5].title, all)},
               planted);
}

}  // namespace
}  // namespace sextant
