// Figures of errors, efficiency, speed and tracks: drawn by gnuplot, and functions of their rows.

#include <set>

#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

std::vector<Record> records() {
  std::vector<Record> records;
  for (const std::string estimator : {"motion_only", "joint_flow"}) {
    for (uint64_t seed = 0; seed < 2; ++seed) {
      for (int frame = 1; frame <= 6; ++frame) {
        for (const std::string body : {"ego", "object:2"}) {
          Record r = RecordOf{"synthetic", "s18", estimator, body, "none", 0, seed, frame};
          r.flow_truth = "given";
          const double e = 0.01 * frame + 0.001 * static_cast<double>(seed);
          r.errors = {{"Et_m", e}, {"ER_deg", 2 * e}, {"epe_initial_px", 0.5}, {"epe_refined_px", 0.5}};
          if (estimator == "joint_flow") r.errors["epe_refined_px"] = 0.2 + e;
          if (body == "ego") r.values = {{"step_gt_m", 1.0}};
          if (body != "ego") r.values = {{"distance_gt_m", 9.0}, {"v_kmh", 40 + e}, {"v_gt_kmh", 40.0}};
          records.push_back(r);
        }
      }
    }
  }
  return records;
}

std::vector<BodyTrack> tracks() {
  std::vector<BodyTrack> tracks = {{"ego", {}}, {"object:2", {}}};
  for (int k = 0; k < 5; ++k) {
    tracks[0].points.push_back({k, Eigen::Vector3d(0, 0, k), Eigen::Vector3d(0.1, 0, k)});
    tracks[1].points.push_back({k, Eigen::Vector3d(3, 0, 2 * k), Eigen::Vector3d(3, 0, 2 * k + 0.1)});
  }
  return tracks;
}

std::vector<NoiseLevelRow> level_rows() {
  std::vector<NoiseLevelRow> rows;
  for (const double level : {0.1, 0.2}) {
    NoiseLevelRow row{"depth.delta_d_px", "synthetic", "s18", "ego", "joint_flow", "depth", level, 20};
    row.limit.efficiency["Et_m"] = Efficiency{0.01, 0.8, Interval{0.7, 0.9}};
    rows.push_back(row);
  }
  return rows;
}

std::string svg(const std::vector<Figure>& figures) {
  EXPECT_FALSE(figures.empty());
  std::string all;
  for (const Figure& figure : figures) all += draw(figure).at(figure.name + ".svg");
  return all;
}

TEST(ReportFigures, EpeBeforeAndAfterFollowsItsRecords) {
  std::vector<Record> all = records();
  const std::vector<Figure> figures = epe_figures(record_sets(all));
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_EQ(figures[0].data.rows.size(),
            4U);  // two bodies, before and after joint; motion_only refines nothing
  const std::string whole = svg(figures);
  EXPECT_THAT(whole, HasSubstr("before optimisation"));
  EXPECT_EQ(svg(epe_figures(record_sets(all))), whole);
  all.pop_back();
  EXPECT_NE(svg(epe_figures(record_sets(all))), whole);
}

TEST(ReportFigures, InducedFlowIsNoTruthOfAnEpe) {
  std::vector<Record> all = records();
  for (Record& record : all) record.flow_truth = "induced";
  EXPECT_TRUE(epe_figures(record_sets(all)).empty());
}

TEST(ReportFigures, DistributionsFollowTheirRecords) {
  std::vector<Record> all = records();
  const std::vector<Figure> figures = distribution_figures(record_sets(all));
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_EQ(figures[0].data.rows.size(), 8U);
  const std::string whole = svg(figures);
  all.pop_back();
  EXPECT_NE(svg(distribution_figures(record_sets(all))), whole);
}

TEST(ReportFigures, ErrorsThatAreOnlyRoundingAreBoxesAtTheLowerEnd) {
  std::vector<Record> all = records();
  const std::string usual = distribution_figures(record_sets(all)).front().caption;
  EXPECT_THAT(usual, Not(HasSubstr("rounding")));
  for (Record& record : all) record.errors = {{"Et_m", 1e-14}, {"ER_deg", 0}};
  const std::vector<Figure> figures = distribution_figures(record_sets(all));
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_EQ(figures[0].data.rows.size(), 8U) << "two errors, bodies and estimators";
  EXPECT_THAT(figures[0].caption, HasSubstr("at most 1e-09, in the unit of the axis, are rounding"));
  EXPECT_THAT(figures[0].script, HasSubstr("set yrange [1e-09:1e-08]"));
  EXPECT_THAT(svg(figures), HasSubstr("</svg>"));
}

TEST(ReportFigures, ABoxStaysIfSomeOfItsErrorsAreZero) {
  std::vector<Record> all = records();
  for (Record& record : all) {
    if (record.frame <= 2) record.errors["Et_m"] = 0;
  }
  const Figure figure = distribution_figures(record_sets(all)).front();
  EXPECT_EQ(figure.data.rows.size(), 8U);
  EXPECT_THAT(figure.caption, HasSubstr("drawn at its lower end"));
  EXPECT_THAT(figure.script, HasSubstr("(column(\"q05\") < "));
}

TEST(ReportFigures, ErrorsThatAreOnlyRoundingAreNoGapsOverTime) {
  std::vector<Record> all = records();
  const MetricPreset& preset = find_preset("paper");
  for (Record& record : all) {
    if (record.body == "object:2") record.errors["Et_m"] = 0;
    if (record.frame == 3) record.errors["ER_deg"] = 1e-12;
  }
  const std::vector<Figure> figures = timeline_figures(all, preset);
  EXPECT_THAT(figures.front().caption, HasSubstr("drawn at its lower end"));
  EXPECT_THAT(figures.front().script, HasSubstr("set yrange [0.001:*]"));
  for (const std::vector<Cell>& row : figures.front().data.rows) {
    const bool is_shown = row[0] == Cell("Et_m") || row[0] == Cell("ER_deg");
    EXPECT_TRUE(!is_shown || row[3].number() != nullptr);
  }
  for (Record& record : all) {
    record.errors = {{"Et_m", 0}, {"ER_deg", 0}};
  }
  EXPECT_THAT(svg(timeline_figures(all, preset)), HasSubstr("object 2"));
}

TEST(ReportFigures, EfficiencyFollowsItsRows) {
  std::vector<NoiseLevelRow> rows = level_rows();
  const std::vector<Figure> figures = efficiency_figures(rows);
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_DOUBLE_EQ(*figures[0].data.rows[0][4].number(), 1 / 0.8);
  const std::string whole = svg(figures);
  rows.pop_back();
  EXPECT_NE(svg(efficiency_figures(rows)), whole);
  rows.front().limit = {};
  EXPECT_TRUE(efficiency_figures(rows).empty());
}

TEST(ReportFigures, SpeedsHaveABandWhereTheFloorIsKnown) {
  std::vector<Record> all = records();
  EXPECT_EQ(svg(speed_figures(all, {})).find("floor"), std::string::npos);
  const std::string whole = svg(speed_figures(all, {{"s18", 2.0}}));
  EXPECT_THAT(whole, HasSubstr("floor"));
  std::erase_if(all, [](const Record& r) { return r.body == "object:2" && r.frame == 6; });
  EXPECT_NE(svg(speed_figures(all, {{"s18", 2.0}})), whole);
  std::erase_if(all, [](const Record& r) { return r.body == "object:2" && r.frame > 4; });
  EXPECT_TRUE(speed_figures(all, {}).empty());  // too few to be a curve
}

TEST(ReportFigures, CaptionsOverTimeNameTheSeedOfSeveral) {
  std::vector<Record> all = records();
  const MetricPreset& preset = find_preset("paper");
  EXPECT_THAT(timeline_figures(all, preset).front().caption, HasSubstr("joint_flow, seed 0 of 2. "));
  EXPECT_THAT(speed_figures(all, {}).front().caption, HasSubstr("s18, seed 0 of 2."));
  std::erase_if(all, [](const Record& r) { return r.seed > 0; });
  EXPECT_THAT(timeline_figures(all, preset).front().caption, Not(HasSubstr("seed")));
  EXPECT_THAT(speed_figures(all, {}).front().caption, Not(HasSubstr("seed")));
}

TEST(ReportFigures, SpeedsAreInterruptedOverFramesWithoutAnEstimate) {
  std::vector<Record> all = records();
  std::erase_if(all, [](const Record& r) { return r.frame == 3 && r.estimator == "joint_flow"; });
  const Figure figure = speed_figures(all, {}).front();
  const auto n_gaps = [&](const std::string& series) {
    return std::ranges::count_if(figure.data.rows, [&](const std::vector<Cell>& row) {
      return *row[1].text() == series && row[3].text() != nullptr && *row[2].number() == 3;
    });
  };
  EXPECT_EQ(n_gaps("joint_flow"), 1);
  EXPECT_EQ(n_gaps("motion_only"), 0);
  EXPECT_EQ(n_gaps("truth"), 0);
  EXPECT_THAT(svg({figure}), HasSubstr("</svg>"));
}

TEST(ReportFigures, CaptionsOverTimeSayWhichBodiesAreDrawn) {
  std::vector<Record> all;
  for (int id = 1; id <= 9; ++id) {
    for (Record record : records()) {
      if (!record.is_ego()) record.body = object_body(id);
      if (!record.is_ego() || id == 1) all.push_back(record);
    }
  }
  EXPECT_THAT(timeline_figures(all, find_preset("paper")).front().caption,
              HasSubstr(" Drawn are 6 of 10 bodies: the camera and the objects with the most estimates."));
  EXPECT_THAT(
      speed_figures(all, {}).front().caption,
      HasSubstr(" Drawn are 6 of 9 objects with at least 5 estimates: those with the most estimates."));
  EXPECT_THAT(speed_figures(records(), {}).front().caption, Not(HasSubstr("Drawn")));
}

TEST(ReportFigures, TheFloorOfASpeedIsThatOfAStep) {
  Record record;
  record.sequence = "0003";
  record.values = {{"step_floor_m", 0.05}};
  EXPECT_DOUBLE_EQ(recorded_speed_floor_kmh({record}).at("0003"), 1.8);
}

TEST(ReportFigures, ShowcaseFollowsItsTracksAndRecords) {
  std::vector<BodyTrack> shown = tracks();
  const std::vector<Record> all = records();
  const RecordRefs drawn = records_of_tracks(all, "synthetic", "s18");
  const std::string whole = svg(showcase_figures("s18", shown, drawn));
  EXPECT_THAT(whole, HasSubstr("40.0 km/h"));
  EXPECT_THAT(whole, HasSubstr("ahead [m]"));
  shown.back().points.pop_back();
  EXPECT_NE(svg(showcase_figures("s18", shown, drawn)), whole);
  EXPECT_TRUE(showcase_figures("s18", {}, {}).empty());
}

// The tracks show the first estimator of the source in its lowest seed, so only this speed belongs to them.
TEST(ReportFigures, SpeedsBesideTracksAreOfTheSystemSeedAndSourceThatAreDrawn) {
  std::vector<Record> all = records();
  for (Record& record : all) {
    if (record.is_ego()) continue;
    record.values["v_kmh"] = record.estimator != "motion_only" ? 500 : record.seed > 0 ? 300 : 20;
  }
  std::vector<Record> others = all;
  for (Record& record : others) record.sequence = "s01";
  for (Record& record : others) record.values["v_kmh"] = 900;
  all.insert(all.begin(), others.begin(), others.end());
  const RecordRefs drawn = records_of_tracks(all, "synthetic", "s18");
  EXPECT_EQ(drawn.size(), 12U);
  EXPECT_THAT(showcase_figures("s18", tracks(), drawn).front().script, HasSubstr("\"20.0 km/h\""));
  EXPECT_TRUE(records_of_tracks(all, "synthetic", "s02").empty());
}

TEST(ReportFigures, TopViewsFollowTheirPaths) {
  TopView view{"0003", {{truth_path, {{0, 0, 0}, {0, 0, 10}}}, {"ORB-SLAM3", {{0, 0, 0}, {1, 0, 10}}}}};
  const std::string whole = svg(top_view_figures({view, view}));
  EXPECT_THAT(whole, HasSubstr("ORB-SLAM3"));
  view.paths.back().positions_m.push_back({1, 0, 11});
  EXPECT_NE(svg(top_view_figures({view, view})), whole);
  EXPECT_TRUE(top_view_figures({}).empty());
}

TEST(ReportFigures, EstimatorsHaveTheirColours) {
  EXPECT_NE(estimator_colour("joint_flow"), estimator_colour("motion_only"));
  EXPECT_EQ(in_order({"mine", "joint_flow_depth", "motion_only"}),
            (std::vector<std::string>{"motion_only", "joint_flow_depth", "mine"}));
}

TEST(ReportFigures, SystemsOfAPageAreDistinct) {
  std::vector<std::string> names = {"joint_flow", "motion_only"};
  for (int i = 0; i < 40; ++i) names.push_back(fmt::format("system {}", i));
  const SystemStyles styles(names);
  std::set<std::string> colours, looks;
  for (const std::string& name : names) {
    const bool is_new_colour = colours.insert(styles.colour(name)).second;
    EXPECT_TRUE(is_new_colour || colours.size() == 9) << name;
    EXPECT_TRUE(looks.insert(styles.line(name)).second) << name;
  }
  EXPECT_EQ(styles.colour("joint_flow"), estimator_colour("joint_flow"));
  EXPECT_EQ(styles.point("motion_only"), estimator_point("motion_only"));
  EXPECT_EQ(SystemStyles({"system 7"}).colour("system 7"), estimator_colour("system 7"));
  EXPECT_EQ(sorted_systems({"b", "a", "b"}), (std::vector<std::string>{"a", "b"}));
}

TEST(ReportFigures, DifferentNamesStayDifferentWhenTheyAreShortened) {
  const std::string head = "estimators/of/the/project/", tail = "/configuration/of/the/release.json";
  const std::vector<std::string> paths = {head + "alpha" + tail, head + "beta" + tail, "short"};
  EXPECT_EQ(shortened({"a", "a", "b"}, 20), (std::vector<std::string>{"a", "a", "b"}));
  for (const std::vector<std::string>& names :
       {paths,
        {paths[0], paths[1]},
        {std::string(50, 'x') + "1" + std::string(50, 'x'), std::string(101, 'x')}}) {
    const std::vector<std::string> shown = shortened(names, 24);
    EXPECT_EQ(std::set<std::string>(shown.begin(), shown.end()).size(), names.size()) << shown[0];
    for (const std::string& name : shown) EXPECT_LE(width_of(name), 24U) << name;
  }
  EXPECT_THAT(shortened(std::vector<std::string>{paths[0], paths[1]}, 24)[0], HasSubstr("alpha"));
}

TEST(ReportFigures, NamesOfStrangersStayNames) {
  const TempFolder folder;
  const std::filesystem::path planted = folder.path() / "planted";
  const std::vector<std::string> texts = hostile_texts(planted);
  std::vector<Record> all;
  std::vector<NoiseLevelRow> levels;
  TopView view{texts[0], {{truth_path, {{0, 0, 0}, {0, 0, 10}}}}};
  const std::vector<Record> of_tracks = records();
  for (size_t i = 0; i < texts.size(); ++i) {
    for (Record record : records()) {
      if (record.estimator != "joint_flow" || record.seed > 0) continue;
      record.estimator = texts[i];
      record.sequence = texts[i / 8];
      record.dataset = texts[i / 12];
      all.push_back(record);
    }
    for (NoiseLevelRow row : level_rows()) {
      row.estimator = texts[i];
      row.parameter = row.sequence = texts[i / 8];
      levels.push_back(row);
    }
    view.paths.push_back({texts[i], {{0, 0, 0}, {1, 0, 10}}});
  }
  const std::vector<RecordSet> sets = record_sets(all);
  for (const auto& figures : {epe_figures(sets), distribution_figures(sets), speed_figures(all, {}),
                              efficiency_figures(levels), top_view_figures({view}),
                              showcase_figures(texts[0] + texts[5] + texts[14], tracks(),
                                               records_of_tracks(of_tracks, "synthetic", "s18"))})
    expect_drawn(figures, planted);
}

}  // namespace
}  // namespace sextant
