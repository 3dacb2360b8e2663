#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>

#include "sextant/base/options.h"
#include "sextant/base/testing.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/testing.h"

namespace sextant {
namespace {

/// A drive of 200 poses at 10 Hz from t0 on, as TUM lines with the time printed as asked for.
std::string drive(double t0, const std::function<std::string(double t)>& time, double noise = 0,
                  double scale = 1, bool rotations = true) {
  std::string text;
  double x = 0, z = 0;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.1 * i, yaw = 0.5 * std::sin(0.4 * t), speed = 8 + 2 * std::sin(0.3 * t);
    x += 0.1 * speed * std::sin(yaw);
    z += 0.1 * speed * std::cos(yaw);
    text += fmt::format("{} {:.6f} {:.6f} {:.6f}", time(t0 + t), scale * (x + noise * std::sin(7.0 * i)), 0.0,
                        scale * z);
    if (rotations) text += fmt::format(" 0 {:.8f} 0 {:.8f}", std::sin(yaw / 2), std::cos(yaw / 2));
    text += "\n";
  }
  return text;
}
std::function<std::string(double)> times(double factor) {
  return [factor](double t) { return fmt::format("{:.6f}", factor * t); };
}

class EvaluateEgoPlants : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) { return folder.write(name, text); }
  TempFolder folder;
  std::string gt = write("gt.tum", drive(0, times(1)));
  std::string est = write("est.tum", drive(0, times(1), 0.02));
};

TEST_F(EvaluateEgoPlants, ACleanEvaluationIsOneTableWithoutWarnings) {
  const Outcome r = evaluate_ego_command({gt, est});
  EXPECT_EQ(r.code, 0);
  EXPECT_EQ(r.err, "");
  const auto rules = [](const std::string& text) {
    std::istringstream in(text);
    std::string line;
    int n = 0;
    while (std::getline(in, line)) n += line.starts_with("---");
    return n;
  };
  EXPECT_EQ(rules(r.out), 1) << r.out;
  EXPECT_THAT(r.out, Not(HasSubstr("in floats")));
  const Outcome all = evaluate_ego_command({gt, est, "--columns", "all"});
  EXPECT_EQ(rules(all.out), 2) << all.out;
  EXPECT_THAT(all.out, AllOf(HasSubstr("in floats"), HasSubstr("the error to the right changes by"),
                             HasSubstr("stretches")));
}

TEST_F(EvaluateEgoPlants, StampsInAnotherUnitAreAnErrorThatNamesIt) {
  struct Plant {
    double t0, factor;
    std::string unit;
  };
  for (const Plant& plant : {Plant{0, 1e3, "ms"}, Plant{0, 1e6, "us"}, Plant{0, 1e9, "ns"},
                             Plant{1.4e9, 1e3, "ms"}, Plant{1.4e9, 1e6, "us"}, Plant{1.4e9, 1e9, "ns"}}) {
    SCOPED_TRACE(plant.unit);
    const std::string seconds = write("s.tum", drive(plant.t0, times(1)));
    const std::string other = write("other.tum", drive(plant.t0, times(plant.factor)));
    for (const bool of_estimate : {true, false}) {
      std::vector<std::string> arguments = {of_estimate ? seconds : other, of_estimate ? other : seconds};
      for (const std::vector<std::string>& more :
           std::vector<std::vector<std::string>>{{}, {"--json"}, {"--rpe", "1m"}, {"--interpolate", "0.3"}}) {
        std::vector<std::string> all = arguments;
        if (plant.t0 > 0 && plant.unit == "ns") all.insert(all.end(), {"--format", "tum"});
        all.insert(all.end(), more.begin(), more.end());
        const Outcome r = evaluate_ego_command(all);
        EXPECT_EQ(r.code, 2) << r.out;
        EXPECT_EQ(r.out, "");
        EXPECT_THAT(r.err, HasSubstr(plant.unit));
        EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
      }
    }
  }
}

TEST_F(EvaluateEgoPlants, AnOffsetAndFewMatchesAreAnError) {
  const std::string late = write("late.tum", drive(1.5e9, times(1)));
  EXPECT_THAT(evaluate_ego_command({gt, late}).err, HasSubstr("--offset -1500000000.0"));
  EXPECT_EQ(evaluate_ego_command({gt, late, "--offset", "-1500000000"}).code, 0);
  const std::string two = write("two.tum", "0 0 0 0 0 0 0 1\n0.1 0 0 0.8 0 0 0 1\n");
  const Outcome r = evaluate_ego_command({gt, two});
  EXPECT_EQ(r.code, 2);
  EXPECT_THAT(r.err, HasSubstr("two.tum: has only 2 poses to evaluate, at least 3 are needed"));
  const std::string overlaps = write("overlap.tum", drive(18.9, times(1)));
  EXPECT_THAT(evaluate_ego_command({gt, overlaps}).err, HasSubstr("only 11 of 200 poses match"));
  const std::string between = write("between.tum", drive(0.05, times(1)));
  EXPECT_THAT(evaluate_ego_command({gt, between}).err,
              testing::AnyOf(HasSubstr("--interpolate"), HasSubstr("--offset")));
}

TEST_F(EvaluateEgoPlants, PrintedPrecisionThatCollapsesStampsIsAnError) {
  for (const double t0 : {1.4e9, 4.0e6}) {
    const std::string text = drive(t0, [](double t) { return fmt::format("{:.6e}", t); });
    const Outcome r = evaluate_ego_command({write("s.tum", drive(t0, times(1))), write("e.tum", text)});
    EXPECT_EQ(r.code, 2);
    EXPECT_THAT(r.err, AllOf(HasSubstr("e.tum:2: "), HasSubstr("%.6e")));
  }
}

TEST_F(EvaluateEgoPlants, OneBadSystemAmongGoodOnesIsAnErrorThatNamesItAlone) {
  const std::string bad = write("bad.tum", drive(0, times(1e3)));
  const Outcome r = evaluate_ego_command({gt, "good=" + est, "bad=" + bad, "worse=/nowhere.tum"});
  EXPECT_EQ(r.code, 2);
  EXPECT_EQ(r.out, "");
  EXPECT_THAT(r.err, AllOf(HasSubstr("bad.tum"), HasSubstr("/nowhere.tum"), Not(HasSubstr("est.tum"))));
}

TEST_F(EvaluateEgoPlants, AnEstimateThatCannotBeAlignedIsNamedAmongSeveral) {
  std::string standing;
  for (int i = 0; i < 20; ++i) standing += fmt::format("{:.1f} 0 0 0 0 0 0 1\n", 0.1 * i);
  const std::string bad = write("standing.tum", standing);
  const Outcome r = evaluate_ego_command({gt, "good=" + est, "bad=" + bad, "--align", "se3"});
  EXPECT_EQ(r.code, 2);
  EXPECT_THAT(r.err, AllOf(HasSubstr("standing.tum: cannot align 20 poses"), Not(HasSubstr("est.tum"))));
}

TEST_F(EvaluateEgoPlants, AbsurdTruthIsAnErrorWithItsLine) {
  const std::string mm = write("mm.tum", "# truth\n" + drive(0, times(1), 0, 100));
  const Outcome r = evaluate_ego_command({mm, est});
  EXPECT_EQ(r.code, 2);
  EXPECT_THAT(r.err, AllOf(HasSubstr("mm.tum:3: the true step is implausible"), HasSubstr("m/s")));
  EXPECT_EQ(evaluate_ego_command({mm, est, "--max-speed", "2000"}).code, 0);
  const std::string kitti =
      write("kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 60\n1 0 0 0 0 1 0 0 0 0 1 61\n");
  EXPECT_THAT(evaluate_ego_command({kitti, kitti}).err,
              HasSubstr("kitti.txt:2: the true step is implausible: 60 m in 1 frame"));
}

TEST_F(EvaluateEgoPlants, TwoFilesAreTwoSystemsAndIntervalsNeedFiveRuns) {
  const std::string other = write("other.tum", drive(0, times(1), 0.05));
  const Outcome r = evaluate_ego_command({gt, est, other});
  EXPECT_EQ(r.code, 0);
  EXPECT_THAT(r.out,
              AllOf(Not(HasSubstr("pooled")), Not(HasSubstr("interval over runs")), HasSubstr("est.tum"),
                    HasSubstr("other.tum"), Not(HasSubstr(folder.path().string() + "/est.tum"))));
  EXPECT_EQ(Json::parse(evaluate_ego_command({gt, est, other, "--json"}).out)["systems"].size(), 2);
  std::vector<std::string> runs = {gt};
  for (int n = 1; n <= 5; ++n) {
    runs.push_back("mine=" + write(fmt::format("run_{}.tum", n), drive(0, times(1), 0.01 * n)));
    const Outcome pooled = evaluate_ego_command(runs);
    EXPECT_EQ(pooled.out.find("interval over runs") != std::string::npos, n >= 5) << n;
  }
  EXPECT_THAT(evaluate_ego_command({gt, "orb=" + est}).out,
              AllOf(HasSubstr("orb "), Not(HasSubstr("est.tum"))));
}

TEST_F(EvaluateEgoPlants, ARunThatIsGivenSeveralTimesCountsOnce) {
  const std::string other = write("other.tum", drive(0, times(1), 0.05));
  std::vector<std::string> args = {gt};
  for (int n = 0; n < 6; ++n) args.push_back("a=" + est), args.push_back("b=" + other);
  const Outcome text = evaluate_ego_command(args);
  EXPECT_EQ(text.code, 0);
  EXPECT_THAT(text.err,
              AllOf(HasSubstr("a 6: has the same poses as a 1"), HasSubstr("Both count as one run")));
  EXPECT_THAT(text.out, AllOf(HasSubstr("No p of a and b"), Not(HasSubstr("interval over runs")),
                              Not(HasSubstr("pooled"))));
  args.push_back("--json");
  const Json same = Json::parse(evaluate_ego_command(args).out);
  EXPECT_EQ(same["systems"][0]["runs"], 1);
  EXPECT_FALSE(same["comparisons"][0].contains("p"));
  EXPECT_EQ(same["runs"].size(), 12);
  args = {gt, "--json"};
  for (int n = 1; n <= 6; ++n) {
    args.push_back("a=" + write(fmt::format("a_{}.tum", n), drive(0, times(1), 0.01 * n)));
    args.push_back("b=" + write(fmt::format("b_{}.tum", n), drive(0, times(1), 0.1 + 0.01 * n)));
  }
  const Json distinct = Json::parse(evaluate_ego_command(args).out);
  EXPECT_EQ(distinct["systems"][0]["runs"], 6);
  EXPECT_TRUE(distinct["comparisons"][0].contains("p"));
  EXPECT_EQ(evaluate_ego_command({gt, "a=" + est, "b=" + est}).err, "") << "two systems that agree";
}

TEST_F(EvaluateEgoPlants, PositionsWithoutRotations) {
  const std::string gnss = write("gnss.txt", drive(0, times(1), 0, 1, false));
  const std::string prism = write("prism.csv", [&] {
    std::string text = drive(0, times(1), 0, 1, false);
    std::ranges::replace(text, ' ', ',');
    return "t [s],x [m],y [m],z [m]\n" + text;
  }());
  const Json whole = Json::parse(evaluate_ego_command({gt, est, "--json", "--align", "se3"}).out);
  for (const std::string& file : {gnss, prism}) {
    for (const char* relation : {"trans_part", "point_distance"}) {
      const Outcome r = evaluate_ego_command({file, est, "--json", "--align", "se3", "--relation", relation});
      ASSERT_EQ(r.code, 0) << r.err;
      EXPECT_NEAR(Json::parse(r.out)["stats"]["rmse"].get<double>(), whole["stats"]["rmse"].get<double>(),
                  1e-9);
      EXPECT_EQ(Json::parse(r.out)["warnings"].size(), 0);
    }
    for (const char* relation : {"angle_deg", "rot_part", "full"}) {
      const Outcome r = evaluate_ego_command({file, est, "--relation", relation});
      EXPECT_EQ(r.code, 2);
      EXPECT_THAT(r.err, HasSubstr("the reference has positions alone"));
    }
    EXPECT_EQ(evaluate_ego_command({file, est, "--rpe", "5m", "--relation", "point_distance"}).code, 0);
    EXPECT_THAT(evaluate_ego_command({file, est, "--rpe", "5m"}).err,
                HasSubstr("use --relation point_distance"));
    EXPECT_EQ(evaluate_ego_command({file, est, "--estimate-offset", "--interpolate", "0.3", "--out",
                                    (folder.path() / "o").string()})
                  .code,
              0);
    EXPECT_THAT(evaluate_ego_command({file, est, "--align", "origin"}).err, HasSubstr("needs rotations"));
  }
}

TEST_F(EvaluateEgoPlants, RelativeErrorsOverSeveralLengths) {
  const std::string out = (folder.path() / "out").string();
  const Outcome r = evaluate_ego_command({gt, est, "--rpe", "1m,5m,10m,500m", "--out", out});
  ASSERT_EQ(r.code, 0) << r.err;
  for (const char* length : {"1m", "5m", "10m", "500m"}) EXPECT_THAT(r.out, HasSubstr(length));
  EXPECT_THAT(r.out, HasSubstr("no pair of poses is that far apart"));
  const Json several = Json::parse(evaluate_ego_command({gt, est, "--rpe", "1m,5m,10m", "--json"}).out);
  ASSERT_EQ(several["rpe"].size(), 3);
  for (int i = 0; i < 3; ++i) {
    const std::string delta = several["rpe"][static_cast<size_t>(i)]["delta"];
    const Json one = Json::parse(evaluate_ego_command({gt, est, "--rpe", delta, "--json"}).out);
    EXPECT_EQ(several["rpe"][static_cast<size_t>(i)]["stats"], one["stats"]) << delta;
  }
  for (const char* file : {"figures/rpe_lengths.svg", "tables/lengths.csv"})
    EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / file)) << file;
}

TEST_F(EvaluateEgoPlants, InverseIsUndoneByItsFlag) {
  std::string inverse;
  std::istringstream in(drive(0, times(1), 0.02));
  double t, x, y, z, qx, qy, qz, qw;
  while (in >> t >> x >> y >> z >> qx >> qy >> qz >> qw) {
    const Eigen::Quaterniond q = Eigen::Quaterniond(qw, qx, qy, qz).conjugate();
    const Eigen::Vector3d p = -(q * Eigen::Vector3d(x, y, z));
    inverse += fmt::format("{:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", t, p[0], p[1], p[2],
                           q.x(), q.y(), q.z(), q.w());
  }
  const std::string file = write("inverse.tum", inverse);
  EXPECT_THAT(evaluate_ego_command({gt, file}).err,
              AllOf(HasSubstr("inverse"), HasSubstr("--inverse"), Not(HasSubstr("opengl"))));
  const Outcome right = evaluate_ego_command({gt, file, "--inverse", "--json"});
  const Json json = Json::parse(right.out);
  EXPECT_NEAR(json["stats"]["rmse"].get<double>(),
              Json::parse(evaluate_ego_command({gt, est, "--json"}).out)["stats"]["rmse"].get<double>(),
              1e-5);
  EXPECT_EQ(json["warnings"].size(), 0);
}

}  // namespace
}  // namespace sextant
