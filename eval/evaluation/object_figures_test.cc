#include "sextant/eval/evaluation/object_report.h"

#include "sextant/base/testing.h"
#include "sextant/eval/logs/object_association.h"

namespace sextant {
namespace {

Record step_record(int object, int frame, Status status) {
  Record record;
  record.estimator = "dyno";
  record.body = object_body(object);
  record.frame = frame;
  record.status = status;
  return record;
}

/// Object 4 in frames 1 to 9: missed, estimated, a gap, estimated, missed; object 7 is gated.
std::vector<Record> some_records() {
  std::vector<Record> records;
  for (const auto& [frame, status] :
       {std::pair(1, Status::not_detected), std::pair(2, Status::ok), std::pair(3, Status::ok),
        std::pair(4, Status::lost), std::pair(5, Status::no_truth), std::pair(6, Status::ok),
        std::pair(7, Status::ok), std::pair(8, Status::not_detected)})
    records.push_back(step_record(4, frame, status));
  records.push_back(step_record(7, 3, Status::gated));
  return records;
}

TEST(ObjectFigures, StatesReportAGapFromMissedSteps) {
  const std::vector<Record> records = some_records();
  std::vector<const Record*> refs;
  for (const Record& record : records) refs.push_back(&record);
  std::vector<std::tuple<int, int, int, StepState>> spans;
  for (const StateSpan& span : state_spans(refs))
    spans.emplace_back(span.object, span.first, span.last, span.state);
  EXPECT_THAT(spans,
              ElementsAre(std::tuple(4, 1, 1, StepState::missed), std::tuple(4, 2, 3, StepState::estimated),
                          std::tuple(4, 4, 4, StepState::gap), std::tuple(4, 5, 5, StepState::without_truth),
                          std::tuple(4, 6, 7, StepState::estimated), std::tuple(4, 8, 8, StepState::missed),
                          std::tuple(7, 3, 3, StepState::gated)));
}

TEST(ObjectFigures, TrackletsAreStretchesOfSuccessiveEstimates) {
  const Figure figure = tracklet_figure(some_records());
  std::vector<std::pair<double, double>> steps;
  for (const auto& row : figure.data.rows)
    steps.emplace_back(*row[figure.data.place("steps")].number(), *row[figure.data.place("n")].number());
  EXPECT_THAT(
      steps, ElementsAre(std::pair(0.0, 2.0), std::pair(2.0, 2.0), std::pair(3.0, 1.0), std::pair(3.0, 0.0)));
  EXPECT_TRUE(tracklet_figure({}).data.rows.empty());
}

TEST(ObjectFigures, PathsOfASingleObjectPoseAreDrawn) {
  ObjectTracks tracks{"dyno", 0, {{"object:3", {{12, Eigen::Vector3d(1, 0, 2), std::nullopt}}}}};
  const std::vector<Figure> figures = object_path_figures({tracks});
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_THAT(draw(figures[0]).at("paths_dyno.svg"), HasSubstr("</svg>"));
}

TEST(ObjectFigures, CaptionsNameTheAxesAsTheyAreDrawn) {
  const auto caption = [](const Eigen::Vector3d& end) {
    return object_path_figures({{"dyno", 0, {{"ego", {{1, Eigen::Vector3d::Zero(), {}}, {2, end, {}}}}}}})
        .at(0)
        .caption;
  };
  EXPECT_THAT(caption({1, 0, 30}), HasSubstr("(z to the right, x down)"));
  EXPECT_THAT(caption({30, 0, 1}), HasSubstr("(x to the right, z up)"));
}

TEST(ObjectFigures, BodiesHaveOneColourAndSystemsOneLineType) {
  const std::vector<TrackPoint> points = {{12, Eigen::Vector3d(1, 0, 2), Eigen::Vector3d(1, 0, 2)}};
  const std::vector<ObjectTracks> tracks = {
      {"a", 0, {{"ego", points}, {"object:1", points}, {"object:2", points}}},
      {"b", 0, {{"object:2", points}}}};
  const Explorer explorer = object_explorer(tracks, {}, "Et_m", "ER_deg");
  std::map<std::string, std::pair<int, int>> lines;
  for (const ExploredPath& path : explorer.paths) lines[path.label] = {path.colour, path.dash};
  EXPECT_EQ(lines.at("a, camera"), std::pair(7, 0));
  EXPECT_EQ(lines.at("a, object 1"), std::pair(1, 0));
  EXPECT_EQ(lines.at("a, object 2"), std::pair(2, 0));
  EXPECT_EQ(lines.at("b, object 2"), std::pair(2, 1));
  const std::vector<Figure> figures = object_path_figures(tracks);
  EXPECT_THAT(figures.at(0).script, HasSubstr(line_colour(0)));
  EXPECT_THAT(figures.at(1).script, HasSubstr(line_colour(2)));
  EXPECT_THAT(figures.at(1).script, testing::Not(HasSubstr(line_colour(0) + "\" lw 1.8")));
}

TEST(ObjectFigures, AnObjectWithoutAPartnerHasItsOwnId) {
  const int id = unmatched_object + 3;
  const Record record = step_record(id, 12, Status::no_truth);
  const ObjectTracks tracks{"dyno", 0, {{object_body(id), {{12, Eigen::Vector3d(1, 0, 2), std::nullopt}}}}};
  EXPECT_EQ(object_explorer({tracks}, {record}, "Et_m", "ER_deg").paths.at(0).label, "object 3 of the log");
  EXPECT_THAT(object_path_figures({tracks}).at(0).script, HasSubstr("object 3 of the log"));
  const Figure states = object_state_figures({record}).at(0);
  EXPECT_THAT(states.script, HasSubstr("\"3 of the log\""));
  EXPECT_THAT(to_csv(states.data), HasSubstr("3 of the log"));
}

TEST(ObjectFigures, TheExplorerHasErrorsOfEstimatesAndSpeedsOfBoth) {
  std::vector<Record> records = {step_record(3, 12, Status::ok)};
  records[0].errors["Et_m"] = 0.5;
  records[0].values["v_kmh"] = 30;
  records[0].values["v_gt_kmh"] = 31;
  const Eigen::Vector3d p(1, 0, 2);
  const ObjectTracks tracks{"dyno", 0, {{"object:3", {{12, p, p}, {14, p, std::nullopt}}}}};
  const Explorer explorer = object_explorer({tracks}, records, "Et_m", "ER_deg");
  ASSERT_EQ(explorer.paths.size(), 2U);
  const ExploredPath &truth = explorer.paths[0], &estimate = explorer.paths[1];
  EXPECT_TRUE(truth.is_reference);
  EXPECT_EQ(truth.values[2][0], 31);
  EXPECT_EQ(estimate.values[2][0], 30);
  EXPECT_EQ(estimate.values[0][0], 0.5);
  EXPECT_TRUE(truth.values[0].empty());
  EXPECT_EQ(estimate.begins, (std::vector<bool>{true, true}));
}

}  // namespace
}  // namespace sextant
