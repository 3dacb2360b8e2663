#include "sextant/eval/records/output.h"

#include "sextant/base/testing.h"

namespace sextant {
namespace {

TEST(ReplaceReport, RemovesTheFilesOfAnEarlierReport) {
  const TempFolder temp;
  const std::filesystem::path out = temp.path() / "out";
  replace_report(out, {{"report.html", "1"}, {"figures/a.svg", "1"}, {"curves/b.csv", "1"}});
  write_file(out / "figures" / "own.svg", "kept");
  replace_report(out, {{"report.html", "2"}, {"figures/c.svg", "2"}});
  EXPECT_EQ(read_file(out / "report.html"), "2");
  EXPECT_TRUE(std::filesystem::exists(out / "figures" / "c.svg"));
  EXPECT_TRUE(std::filesystem::exists(out / "figures" / "own.svg")) << "no file of the command";
  EXPECT_FALSE(std::filesystem::exists(out / "figures" / "a.svg"));
  EXPECT_FALSE(std::filesystem::exists(out / "curves" / "b.csv"));
}

}  // namespace
}  // namespace sextant
