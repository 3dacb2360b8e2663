#include "sextant/eval/evaluation/trajectory_series.h"

#include <cmath>

#include "sextant/base/testing.h"

namespace sextant {
namespace {

/// A camera with y down that moves by `step_m` along z in each 0.1 s and turns about y by `turn_deg`.
PoseSeries turning_drive(int n, double step_m, double turn_deg = 0, double begin_s = 1000) {
  PoseSeries series;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int i = 0; i < n; ++i) {
    const double yaw = i * turn_deg * M_PI / 180;
    const Eigen::Matrix3d R = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    series.add(R, p);
    series.stamps_s.push_back(begin_s + 0.1 * i);
    p += R * Eigen::Vector3d(0, 0, step_m);
  }
  return series;
}

EgoCurves ego_curves_of(const PoseSeries& reference, const PoseSeries& estimate,
                        const EgoOptions& options = {}) {
  EgoReference given;
  given.poses = reference;
  given.side.name = "gt.txt";
  TrajectoryFile file;
  file.poses = estimate;
  const EgoResult run = evaluate_ego(given, std::move(file), "est.txt", options);
  return ego_curves({run}, given, options, ViewPlane::extent);
}

TEST(TrajectorySeries, TimeBeginsAtTheReferencesFirstPoseAndSpeedIsDistanceByTime) {
  const EgoCurves curves = ego_curves_of(turning_drive(50, 0.5), turning_drive(50, 0.6));
  EXPECT_EQ(curves.reference.time.front(), 0);
  EXPECT_NEAR(curves.runs[0].time.back(), 4.9, 1e-9);
  EXPECT_TRUE(std::isnan(curves.runs[0].speed[0]));
  EXPECT_NEAR(curves.reference.speed[7], 5, 1e-6);
  EXPECT_NEAR(curves.runs[0].speed[7], 6, 1e-6);
  EXPECT_NEAR(curves.runs[0].path_m.back(), 24.5, 1e-9);
  EXPECT_NEAR(curves.runs[0].error[10], 1, 1e-9);
  EXPECT_NEAR(curves.runs[0].position_error_m[10].z(), 1, 1e-9);
}

TEST(TrajectorySeries, YawOfACameraWithYDownAccumulatesOverWholeTurns) {
  const EgoCurves curves = ego_curves_of(turning_drive(100, 0.5, 9), turning_drive(100, 0.5, 9.01));
  EXPECT_EQ(curves.axes.out, 1);
  EXPECT_NEAR(curves.reference.angles_deg.back()[2], 99 * 9, 1e-6);
  EXPECT_NEAR(curves.runs[0].angles_deg.back()[2], 99 * 9.01, 1e-6);
  EXPECT_NEAR(curves.runs[0].angle_error_deg.back()[2], 0.99, 1e-6);
  EXPECT_NEAR(curves.runs[0].angles_deg.back().head<2>().norm(), 0, 1e-6);
}

TEST(TrajectorySeries, AnglesComposeToTheRotation) {
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  PoseSeries series;
  for (int i = 0; i < 5; ++i) {
    series.add(R, Eigen::Vector3d(i, 0.5 * i * i, 0));
    series.stamps_s.push_back(i);
  }
  const EgoCurves curves = ego_curves_of(series, series);
  EXPECT_EQ(curves.axes.out, 2);
  EXPECT_NEAR((curves.runs[0].angles_deg[2] * M_PI / 180 - Eigen::Vector3d(0.1, -0.2, 0.4)).norm(), 0, 1e-9);
}

TEST(TrajectorySeries, AGapInterruptsTheCurveAndItsSpeed) {
  PoseSeries estimate = turning_drive(100, 0.5);
  std::vector<int> kept;
  for (int i = 0; i < 100; ++i) {
    if (i < 40 || i >= 70) kept.push_back(i);
  }
  estimate.keep(kept);
  const EgoCurves curves = ego_curves_of(turning_drive(100, 0.5), estimate);
  const TrajectoryCurve& run = curves.runs[0];
  EXPECT_EQ(std::ranges::count(run.begins, true), 2);
  EXPECT_TRUE(run.begins[40]);
  EXPECT_TRUE(std::isnan(run.speed[40]));
  EXPECT_FALSE(std::isnan(run.speed[41]));
}

TEST(TrajectorySeries, ThinningKeepsEndsGapsAndTheLargestError) {
  TrajectoryCurve curve;
  for (int i = 0; i < 1000; ++i) {
    curve.time.push_back(i);
    curve.position_m.emplace_back(std::sin(0.01 * i), 0, i);
    curve.error.push_back(i == 567 ? 9 : 1 + 0.001 * (i % 7));
    curve.begins.push_back(i == 0 || i == 333);
  }
  const std::vector<size_t> kept = thinned(curve, 90);
  EXPECT_LE(kept.size(), 100U);
  for (const size_t i : {0U, 332U, 333U, 567U, 999U}) EXPECT_THAT(kept, Contains(i));
  EXPECT_TRUE(std::ranges::is_sorted(kept));
  EXPECT_EQ(thinned(curve, 1000).size(), 1000U);
}

TEST(TrajectorySeries, ASimplifiedLineIsNowhereFartherThanTheToleranceFromTheWhole) {
  std::vector<Eigen::Vector3d> spiral;
  std::vector<bool> begins;
  for (int i = 0; i < 20000; ++i) {
    spiral.emplace_back(0.001 * i * std::cos(0.002 * i), 0.001 * i * std::sin(0.002 * i), 0);
    begins.push_back(i == 0 || i == 7001);
  }
  constexpr double tolerance = 0.05;
  const std::vector<size_t> kept = simplified(spiral, begins, tolerance);
  EXPECT_LT(kept.size(), 1000U);
  for (const size_t i : {0U, 7000U, 7001U, 19999U}) EXPECT_THAT(kept, Contains(i));
  ASSERT_TRUE(std::ranges::is_sorted(kept));
  for (size_t k = 1; k < kept.size(); ++k) {
    const Eigen::Vector3d &a = spiral[kept[k - 1]], b = spiral[kept[k]];
    for (size_t i = kept[k - 1] + 1; i < kept[k]; ++i)
      EXPECT_LE((spiral[i] - a).cross(b - a).norm(), tolerance * (b - a).norm() * (1 + 1e-9)) << i;
  }
  const std::vector<Eigen::Vector3d> standing(10, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(simplified(standing, std::vector<bool>(10, false), tolerance), testing::ElementsAre(0, 9));
  EXPECT_THAT(simplified({{1, 2, 3}}, {true}, tolerance), testing::ElementsAre(0));
}

TEST(TrajectorySeries, TheViewLeavesOutTheAxisOfTheLeastExtent) {
  EXPECT_EQ(view_axes(ViewPlane::extent, {{0, 0, 0}, {10, 1, 20}}).out, 1);
  EXPECT_EQ(view_axes(ViewPlane::extent, {{0, 0, 0}, {10, 20, 1}}).out, 2);
  EXPECT_EQ(view_axes(ViewPlane::extent, {{0, 0, 0}, {0.1, 0.2, 20}}).out, 1);  // a straight road
  EXPECT_EQ(view_axes(ViewPlane::extent, {{3, 4, 5}}).out, 1);                  // a single pose
  EXPECT_EQ(view_axes(ViewPlane::extent, {{0, 0, 0}, {10, 1, 20}}, Eigen::Vector3d(0, 0, 1)).out, 2);
  EXPECT_EQ(view_axes(ViewPlane::yz, {}).out, 0);
}

TEST(TrajectorySeries, FiguresOfAStandingCameraAndOfALongPathAreDrawnWithNumbers) {
  for (const double step_m : {0.0, 20'000.0}) {
    EgoOptions options;
    options.max_speed_m_s = 1e9;
    PoseSeries estimate = turning_drive(6, step_m);
    for (size_t i = 0; i < estimate.size(); ++i)
      estimate.positions_m[i].x() += 0.001 * static_cast<double>(i % 2);
    const EgoCurves curves = ego_curves_of(turning_drive(6, step_m), estimate, options);
    std::vector<Figure> figures = path_figures(curves);
    std::ranges::move(along_figures(curves), std::back_inserter(figures));
    EXPECT_EQ(figures.size(), 6U);
    for (const Figure& figure : figures) {
      EXPECT_THAT(figure.script, Not(HasSubstr("nan"))) << figure.name;
      EXPECT_THAT(figure.script, Not(HasSubstr("inf"))) << figure.name;
      EXPECT_EQ(figure.data.rows.size(), 12U) << figure.name;
      EXPECT_THAT(draw(figure).at(figure.name + ".svg"), HasSubstr("</svg>"));
    }
  }
}

TEST(TrajectorySeries, LongNumbersAtTicsHaveSpace) {
  const auto figures_of = [](double error_m, double roll_deg, double change_deg) {
    PoseSeries estimate = turning_drive(6, 1);
    for (size_t i = 0; i < estimate.size(); ++i) {
      const double part = static_cast<double>(i % 3) / 2;
      estimate.positions_m[i].x() += error_m * part;
      estimate.rotations[i] *=
          Eigen::AngleAxisd((roll_deg + change_deg * part) * M_PI / 180, Eigen::Vector3d::UnitZ())
              .toRotationMatrix();
    }
    const EgoCurves curves = ego_curves_of(turning_drive(6, 1), estimate);
    return std::pair(path_figures(curves)[1].script, along_figures(curves)[2].script);
  };
  const auto [path_of_m, rotation] = figures_of(1, 0.5, 1);
  const auto [path_of_mm, rotation_far] = figures_of(0.001, -7.75, 0.001);
  EXPECT_THAT(path_of_m, HasSubstr("set cbtics scale 0.5 autofreq"));
  EXPECT_THAT(path_of_mm, HasSubstr("set cbtics scale 0.5 0.0002"));
  EXPECT_THAT(path_of_m, HasSubstr("set rmargin at screen 0.86429"));
  EXPECT_THAT(path_of_mm, HasSubstr("set rmargin at screen 0.85214")) << "one character more";
  EXPECT_THAT(rotation, HasSubstr("set lmargin at screen 0.09722"));
  EXPECT_THAT(rotation_far, Not(HasSubstr("set lmargin at screen 0.09722")));
  EXPECT_THAT(rotation_far, HasSubstr("set ytics 0.0002\n"));
}

TEST(TrajectorySeries, PosesBetweenGapsAreDrawnAsPoints) {
  EgoCurves curves = ego_curves_of(turning_drive(6, 1), turning_drive(6, 1));
  const auto has_points = [&] {
    return path_figures(curves)[0].script.find("with linespoints") != std::string::npos;
  };
  EXPECT_FALSE(has_points());
  curves.runs[0].begins[2] = curves.runs[0].begins[3] = true;
  EXPECT_TRUE(has_points());
}

TEST(TrajectorySeries, StartAndEndOfAReferenceThatStandsAreOneMark) {
  EXPECT_THAT(path_figures(ego_curves_of(turning_drive(6, 0), turning_drive(6, 0)))[0].script,
              HasSubstr("\"start, end\""));
  EXPECT_THAT(path_figures(ego_curves_of(turning_drive(6, 1), turning_drive(6, 1)))[0].script,
              Not(HasSubstr("\"start, end\"")));
}

TEST(TrajectorySeries, CurveFilesHoldEveryPose) {
  const EgoCurves curves = ego_curves_of(turning_drive(4000, 0.1), turning_drive(4000, 0.1));
  const OutputFiles files = curve_files(curves);
  for (const char* name : {"curves/reference.csv", "curves/est.txt.csv"})
    EXPECT_EQ(std::ranges::count(files.at(name), '\n'), 4001) << name;
  EXPECT_THAT(path_figures(curves)[0].caption, HasSubstr("of 8000 poses"));
  const Explorer explorer = ego_explorer(curves);
  EXPECT_EQ(explorer.paths[1].time.size(), 4000U);
  EXPECT_TRUE(explorer.note.empty());
}

TEST(TrajectorySeries, AWarningNamesItsEstimateOnce) {
  EgoResult run{.name = "V1", .file = "V102.txt"};
  EXPECT_EQ(run.text_of({"scale", "the estimate fits"}), "V1: the estimate fits");
  EXPECT_EQ(run.text_of({"repaired", "V102.txt: 3 quaternions"}), "V102.txt: 3 quaternions");
}

}  // namespace
}  // namespace sextant
