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

TEST(RemoveStaleFiles, TakesNoNameThatIsNoFileOfTheFolder) {
  const TempFolder temp;
  const std::filesystem::path out = temp.path() / "out";
  std::filesystem::create_directories(out);
  write_file(temp.path() / "a.csv", "kept");
  write_file(out / ".sextant_outputs", "../a.csv\n" + std::string(1'000'000, 'x') + ".csv\n");
  remove_stale_files(out, R"(.*\.csv)", {"b.csv"});
  EXPECT_TRUE(std::filesystem::exists(temp.path() / "a.csv"));
  EXPECT_EQ(read_file(out / ".sextant_outputs").find("xxx"), std::string::npos);
}

}  // namespace
}  // namespace sextant
