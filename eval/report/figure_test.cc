// Figures with untrusted texts: gnuplot draws the texts and executes none of them.

#include "sextant/eval/report/figure.h"

#include <cstdlib>

#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

/// A figure that has the text as title, label, tic, series, axis and cell. Its only point is drawn from the
/// row in which strcol() equals the text.
Figure figure_of(const std::string& text, const std::string& name) {
  Figure figure;
  figure.name = name;
  figure.data.columns = {Column::text("text"), {"x", "x"}, {"y", "y"}};
  figure.data.add_row({text, 1.0, 2.0});
  figure.data.add_row({"other", 2.0, 3.0});
  figure.script = fmt::format(
      "set xrange [0:3]\nset yrange [0:3]\nset title {0} noenhanced\nset xlabel {0} noenhanced\nset label "
      "{0} at 1,1 "
      "noenhanced\nset xtics ({1} 1) noenhanced\n"
      "plot data using (strcol(\"text\") eq {2} ? column(\"x\") : NaN):(column(\"y\")) with points pt 7 "
      "title {0}\n",
      gp_text(text), gp_tic(text), gp_text(gp_cell(text)));
  return figure;
}

TEST(FigureTexts, AreNoCommandsAndNoMarkup) {
  const TempFolder folder;
  const std::filesystem::path planted = folder.path() / "planted";
  size_t i = 0;
  for (const std::string& text : hostile_texts(planted)) {
    const Figure figure = figure_of(text, fmt::format("f{}", i++));
    expect_drawn({figure}, planted);  // gnuplot refuses when no point is drawn
    EXPECT_FALSE(std::filesystem::exists(planted)) << text;
  }
}

TEST(FigureTexts, AreShownAsTheyAre) {
  const std::string text = "100 % `a` {b}_c^d \\e";
  const std::string svg = draw(figure_of(text, "shown")).at("shown.svg");
  size_t n = 0;
  for (size_t at = svg.find(">" + text + "<"); at != std::string::npos;
       at = svg.find(">" + text + "<", at + 1))
    ++n;
  EXPECT_GE(n, 4U);  // title, axis, label, tic
}

TEST(FigureTexts, NamesOfFilesAreNoPipes) {
  for (const char* name : {"| touch x", "<touch x", "a/b", "", "-a", ".a", "a'b", "a\nb"}) {
    Figure figure = figure_of("text", "f");
    figure.name = name;
    EXPECT_THROW(draw(figure), InternalError) << name;
  }
}

TEST(FigureFiles, TimeZoneAndLanguageChangeNothing) {
  const Figure figure = figure_of("text", "zone");
  ASSERT_EQ(::setenv("TZ", "America/New_York", 1), 0);
  const OutputFiles there = draw(figure);
  ASSERT_EQ(::setenv("TZ", "Asia/Kolkata", 1), 0);
  ASSERT_EQ(::setenv("LC_ALL", "de_DE.UTF-8", 1), 0);
  const OutputFiles here = draw(figure);
  ::unsetenv("TZ");
  ::unsetenv("LC_ALL");
  if (here.at("zone.pdf").find("/ObjStm") != std::string::npos)
    GTEST_SKIP() << "this version of Cairo compresses the date of a PDF, which therefore stays in it";
  EXPECT_TRUE(there == here);
  EXPECT_THAT(here.at("zone.pdf"), HasSubstr("/CreationDate"));
}

// gnuplot reports success even if it could not write all of a picture; the test cuts the files off.
TEST(FigureFiles, APictureThatIsNotWholeIsAnError) {
  for (const char* extension : {"svg", "pdf", "png"}) {
    Figure figure = figure_of("text", "full");
    // As on a full disk, the file ends after 100 bytes.
    figure.script +=
        fmt::format("if (GPVAL_TERM[1:3] eq '{0}') {{ set output; system('truncate -s 100 full.{0}') }}\n",
                    std::string(extension).substr(0, 3));
    expect_error([&] { draw(figure); }, fmt::format("gnuplot wrote only a part of full.{}", extension));
  }
  Figure figure = figure_of("text", "full");
  figure.script = "set output\n";
  expect_error([&] { draw(figure); }, "gnuplot wrote only a part of full.");
}

}  // namespace
}  // namespace sextant
