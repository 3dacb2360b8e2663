// Starts compare, baseline and trend as a user does, and checks exit codes and written files.

#include <sys/wait.h>

#include <cstdlib>

#include "sextant/base/files.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/gate/testing.h"

namespace sextant {
namespace {

class GateProgram : public ::testing::Test {
 protected:
  GateProgram() {
    write_run(temp_.path() / "base", sweep_records(3));
    write("new", 1);
  }

  void write(const std::string& name, double factor) const {
    std::vector<Record> records = sweep_records(3);
    for (Record& r : records) r.errors["Et_m"] *= factor;
    write_run(temp_.path() / name, records);
  }

  int run(const std::string& arguments) const {
    const std::string command =
        fmt::format("cd {} && {} {} > out.txt 2> err.txt", temp_.path().string(), SEXTANT_PROGRAM, arguments);
    return WEXITSTATUS(std::system(command.c_str()));
  }

  std::string text(const std::string& name) const { return read_file(temp_.path() / name); }

  TempFolder temp_;
};

TEST_F(GateProgram, ExitCodesAreTheVerdict) {
  EXPECT_EQ(run("compare base new"), 0);
  EXPECT_TRUE(
      text("out.txt").ends_with("ok: nothing changed (16 errors over 108 records, 8 times compared)\n"))
      << text("out.txt");
  write("new", 0.9);
  EXPECT_EQ(run("compare base new --quiet"), 0);
  EXPECT_EQ(text("out.txt"), "");
  write("new", 1.05);
  EXPECT_EQ(run("compare base new --json"), 1);
  EXPECT_EQ(Json::parse(text("out.txt"))["verdict"], "regressed");
  fs::remove(temp_.path() / "new" / "records.jsonl");
  EXPECT_EQ(run("compare base new --out cmp"), 2);
  EXPECT_TRUE(text("err.txt").starts_with("sextant: error: not comparable: "));
  for (const char* name :
       {"report.html", "comparison.md", "comparison.json", "junit.xml", "bmf.json", "github.json"})
    EXPECT_TRUE(fs::exists(temp_.path() / "cmp" / name)) << name;
  write_file(temp_.path() / "a.json", benchmark_json(1, 1).dump());
  write_file(temp_.path() / "b.json", benchmark_json(1, 1, 3).dump());
  EXPECT_EQ(run("compare a.json b.json"), 3);
}

TEST_F(GateProgram, ThePageLeadsFromEveryRegressionToItsFrame) {
  std::vector<Record> records = sweep_records(3);
  for (Record& r : records) {
    r.errors["Et_m"] *= 1.1;
    if (r.sequence == "city" && r.body == "object:2" && r.seed == 1 && r.frame == 4) r.errors["Et_m"] += 0.5;
  }
  write_run(temp_.path() / "new", records);
  EXPECT_EQ(run("compare base new --out cmp"), 1);
  const std::string html = text("cmp/report.html");
  EXPECT_THAT(html, HasSubstr("/index.html#frame=4&amp;body=object:2"));
  EXPECT_THAT(html,
              HasSubstr("sextant view base new --estimator joint_flow --level 0.1 --seed 1 --out cmp/view_"));
  EXPECT_THAT(html, HasSubstr("href=\"../new/records.jsonl\""));
  const auto at = std::ranges::find_if(records, [](const Record& r) {
    return r.sequence == "city" && r.body == "object:2" && r.seed == 1 && r.frame == 4;
  });
  EXPECT_THAT(html,
              HasSubstr(fmt::format("<a href=\"../base/records.jsonl\">{}</a>", at - records.begin() + 1)));
}

TEST_F(GateProgram, TextsOfStrangersDoNotTalkToTheTerminal) {
  const fs::path records = temp_.path() / "new" / "records.jsonl";
  std::string damaged = read_file(records);
  const std::string body = R"("body":"ego)";
  damaged.insert(damaged.find(body) + body.size(), R"(\r\u001b[2J\nsextant: done)");
  write_file(records, damaged);
  EXPECT_EQ(run("compare base new"), 2);
  const std::string reported = text("err.txt");
  EXPECT_THAT(reported, HasSubstr("got 'ego  [2J sextant: done'"));
  EXPECT_TRUE(std::none_of(reported.begin(), reported.end() - 1, [](char c) { return c >= 0 && c < ' '; }))
      << reported;
}

TEST_F(GateProgram, UsageIsBadInput) {
  EXPECT_EQ(run("compare base"), 2);
  EXPECT_EQ(run("compare base new --only fun"), 2);
  EXPECT_EQ(run("compare base new --allow everything"), 2);
  EXPECT_EQ(run("compare base new --policy none.json"), 2);
  EXPECT_EQ(run("compare --show-policy --json"), 0);
  EXPECT_TRUE(Json::parse(text("out.txt"))["accuracy"].contains("default"));
}

TEST_F(GateProgram, ABaselineIsReplacedOnPurposeOnly) {
  EXPECT_EQ(run("baseline update base --baseline kept --yes"), 0);
  EXPECT_EQ(text("kept/records.jsonl").find("refine"), std::string::npos);  // no times
  EXPECT_EQ(run("compare kept new"), 0);
  write("new", 1.0001);
  EXPECT_EQ(run("baseline update new --baseline kept"), 0);
  EXPECT_THAT(text("out.txt"), HasSubstr("errors regressed"));  // any change is shown
  write("new", 1.05);
  const std::string before = text("kept/records.jsonl");
  EXPECT_EQ(run("baseline update new --baseline kept"), 0);
  EXPECT_THAT(text("out.txt"), HasSubstr("regressed: "));
  EXPECT_EQ(text("kept/records.jsonl"), before);
  EXPECT_EQ(run("baseline update new --baseline kept --yes"), 0);
  EXPECT_NE(text("kept/records.jsonl"), before);
  EXPECT_EQ(run("compare kept new"), 0);
  write_file(temp_.path() / "new" / "records.jsonl", "{\n");
  EXPECT_EQ(run("baseline update new --baseline kept --yes"), 2);
  EXPECT_EQ(run("compare kept kept"), 0);  // still whole
}

TEST_F(GateProgram, TrendWritesOnePage) {
  fs::create_directories(temp_.path() / "past");
  for (int i = 0; i < 6; ++i) write(fmt::format("past/{}", i), i < 3 ? 1 : 1.2);
  EXPECT_EQ(run("trend past --out trend.html --json"), 0) << text("err.txt");
  const Json json = Json::parse(text("out.txt"));
  EXPECT_EQ(json["points"].size(), 6U);
  EXPECT_TRUE(text("trend.html").starts_with("<!"));
  EXPECT_EQ(run("trend past/0 --out one.html"), 2);
  EXPECT_FALSE(fs::exists(temp_.path() / "one.html"));
}

}  // namespace
}  // namespace sextant
