#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "sextant/base/options.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/testing.h"

namespace sextant {
namespace {

using testing::HasSubstr;

class EvaluateEgo : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    return folder.write(name, text);
  }
  TempFolder folder;
  std::string gt = write("gt.tum", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 2 1 0 0 0 0 1\n4 3 1 1 0 0 0 1\n");
  std::string est =
      write("est.tum", "1 0 0 0 0 0 0 1\n2 1 0 0.5 0 0 0 1\n3 2 1 0 0 0 0 1\n4 3 1 1 0 0 0 1\n");
};

TEST_F(EvaluateEgo, PrintsItsJson) {
  const Outcome r = evaluate_ego_command({"--format", "tum", gt, est, "--json"});
  ASSERT_EQ(r.code, 0) << r.err;
  const Json json = Json::parse(r.out);
  EXPECT_EQ(json["metric"], "ape");
  EXPECT_EQ(json["relation"], "trans_part");
  EXPECT_EQ(json["align"], "none");
  EXPECT_EQ(json["n"], 4);
  EXPECT_EQ(json["stats"]["max"], 0.5);
  EXPECT_EQ(json["stats"]["sse"], 0.25);
  EXPECT_FALSE(json["kitti_odometry"].contains("translation_percent")) << "too short: left out, never 0";
  EXPECT_THAT(r.out, Not(HasSubstr("null")));
}

TEST_F(EvaluateEgo, RelativeErrorsAndText) {
  const Outcome json = evaluate_ego_command({gt, est, "--rpe", "1f", "--json"});
  EXPECT_EQ(Json::parse(json.out)["metric"], "rpe");
  EXPECT_EQ(Json::parse(json.out)["n"], 3);
  const Outcome text = evaluate_ego_command({gt, est, "--columns", "all"});
  EXPECT_EQ(text.code, 0);
  EXPECT_THAT(text.out, HasSubstr("APE trans_part [m]"));
  EXPECT_THAT(text.out, HasSubstr("need 100 m of path"));
  EXPECT_EQ(evaluate_ego_command({gt, est, "--quiet"}).out, "");
}

TEST_F(EvaluateEgo, SeveralSystems) {
  const std::string orb = "orb=" + est, vdo = "vdo=" + gt;
  const Json json = Json::parse(evaluate_ego_command({gt, orb, orb, vdo, "--json"}).out);
  EXPECT_EQ(json["systems"].size(), 2);
  EXPECT_EQ(json["systems"][0]["n"], 4);  // equal runs count once
  EXPECT_EQ(json["runs"].size(), 3);
}

TEST_F(EvaluateEgo, BadInputIsCode2AndOneLine) {
  const std::string nan = write("nan.tum", "1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n");
  const std::string topic_of_no_recording = est + ":/topic";
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{gt, nan},
                                             {gt},
                                             {gt, "/nowhere.txt"},
                                             {gt, est, "--align", "sim4"},
                                             {gt, est, "--relation", "x"},
                                             {gt, est, "--rpe", "1x"},
                                             {gt, est, "--all-pairs"},
                                             {gt, est, "--t-start", "3", "--t-end", "2"},
                                             {gt, est, "--format", "kitti"},
                                             {gt, est, "--save-zip", "/nowhere/x.zip"},
                                             {gt, est, "--align", "yaw"},
                                             {gt, est, "--up", "z"},
                                             {gt, est, "--align", "yaw", "--up", "q"},
                                             {gt, est, "--axes", "enu"},
                                             {gt, est, "--ref-axes", "x"},
                                             {gt, est, "--body-from-camera", "1 2"},
                                             {gt, est, "--ref-body-from-camera", "/nowhere"},
                                             {gt, est, "--interpolate", "0"},
                                             {gt, est, "--interpolate", "inf"},
                                             {gt, est, "--estimate-offset"},
                                             {gt, topic_of_no_recording}}) {
    const Outcome r = evaluate_ego_command(arguments);
    EXPECT_EQ(r.code, 2) << r.out;
    EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    EXPECT_EQ(r.out, "");
  }
}

TEST_F(EvaluateEgo, FlagsWithoutEffectAreRefused) {
  const std::string rows =
      write("kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n1 0 0 0 0 1 0 0 0 0 1 3\n");
  const auto refuse = [](const std::vector<std::string>& arguments, const std::string& flag) {
    expect_bad_input(evaluate_ego_command(arguments), flag);
  };
  refuse({rows, rows, "--offset", "0.1"}, "--offset needs time stamps");
  refuse({rows, rows, "--max-difference", "0.1"}, "--max-difference needs time stamps");
  EXPECT_EQ(evaluate_ego_command({rows, rows, "--rate", "10", "--max-difference", "0.1"}).code, 0);
  refuse({gt, est, "--n-to-align", "3"}, "--n-to-align: --align none");
  refuse({gt, est, "--n-to-align", "3", "--align", "origin"}, "--n-to-align: --align origin");
  EXPECT_EQ(evaluate_ego_command({gt, est, "--n-to-align", "4", "--align", "se3"}).code, 0);
  refuse({gt, est, "--delta-tolerance", "0.2"}, "--delta-tolerance");
  refuse({gt, est, "--delta-tolerance", "0.2", "--rpe", "1m"}, "--delta-tolerance");
  refuse({gt, est, "--delta-tolerance", "0.2", "--rpe", "1f", "--all-pairs"}, "--delta-tolerance");
  EXPECT_EQ(evaluate_ego_command({gt, est, "--delta-tolerance", "0.2", "--rpe", "1f,1m", "--all-pairs"}).code,
            0);
}

TEST_F(EvaluateEgo, FramesUpAndInterpolationAreInTheJson) {
  const std::string ned =
      write("ned.tum", "1 0 0 0 0 0 0 1\n1.5 0 0.5 0 0 0 0 1\n3 0 2 -1 0 0 0 1\n4 1 3 -1 0 0 0 1\n");
  const Json json =
      Json::parse(evaluate_ego_command({gt, ned, "--axes", "ned", "--body-from-camera", "0 0 -0.5", "--align",
                                        "yaw", "--up", "-y", "--interpolate", "1.5", "--json"})
                      .out);
  EXPECT_EQ(json["align"], "yaw");
  EXPECT_EQ(json["up"], Json::array({0, -1, 0}));
  EXPECT_EQ(json["frames"]["axes"], "ned");
  EXPECT_EQ(json["frames"]["body_from_camera"][2], Json::array({0, 1, 0, -0.5}));
  EXPECT_FALSE(json["frames"].contains("ref_axes")) << "what was not given is left out";
  EXPECT_EQ(json["interpolation"]["largest_gap_s"], 1);
  EXPECT_EQ(json["n"], 4);
  EXPECT_FALSE(Json::parse(evaluate_ego_command({gt, est, "--json"}).out).contains("frames"));
}

TEST_F(EvaluateEgo, WritesAReport) {
  const std::filesystem::path out = folder.path() / "report";
  const std::string a = "one=" + est, b = "two=" + gt;
  const Outcome r = evaluate_ego_command({gt, a, b, "--out", out, "--quiet"});
  ASSERT_EQ(r.code, 0) << r.err;
  for (const char* file : {"report.html", "report.md", "tables/errors.csv", "tables/steps.tex",
                           "figures/error_cdf.svg", "figures/error_boxes.pdf", "figures/step_Et_cdf.png"}) {
    EXPECT_TRUE(std::filesystem::exists(out / file)) << file;
  }
  std::ifstream in(out / "figures" / "error_cdf.csv");
  std::string header, line, last;
  std::getline(in, header);
  while (std::getline(in, line)) last = line;
  EXPECT_EQ(header, "share,quantile_1,quantile_2");
  EXPECT_EQ(last, "1,0.5,0");
}

}  // namespace
}  // namespace sextant
