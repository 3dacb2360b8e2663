#include "sextant/eval/experiment/evaluate_pair.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sextant/estimator/consistency.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

constexpr double pi = std::numbers::pi;

SE3 shift(double x, double y, double z) { return {Eigen::Quaterniond::Identity(), {x, y, z}}; }

SE3 yaw(double deg) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(deg * pi / 180, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d::Zero()};
}

const PinholeCamera camera{100, 100, 50, 50};

MotionEstimate estimate_of(const SE3& T_curr_prev, size_t n) {
  MotionEstimate estimate{.status = Status::ok, .T_curr_prev = T_curr_prev};
  estimate.inliers.assign(n, 1);
  estimate.refined_flow_u.assign(n, 0);
  estimate.refined_flow_v.assign(n, 0);
  return estimate;
}

/// The camera drives 1 m ahead; object 2 at 10 m drives 2 m ahead: it recedes from the camera by 1 m, at 72
/// km/h with 10 Hz. The estimate is 0.1 m too short for the camera and 0.3 m too short for the object's
/// relative motion.
class EvaluatePair : public testing::Test {
 protected:
  EvaluatePair() {
    truth_.camera.set(4, shift(5, 0, 100));
    truth_.camera.set(5, shift(5, 0, 101));
    truth_.objects[4] = {object(2, 10)};
    truth_.objects[5] = {object(2, 11)};
    estimated_.set(4, shift(5, 0, 100));
    estimated_.set(5, shift(5, 0, 100.9));
    result_.prev = 4;
    result_.curr = 5;
    result_.dt_s = 0.1;
    result_.ego.status = Status::ok;
    result_.ego.n_points = result_.ego.n_inliers = 2;
    result_.ego.points.push_back(50, 50, 10, 1, 0);    // on the axis: true flow 0
    result_.ego.points.push_back(60, 50, 10, 10, 50);  // outlier
    result_.ego.estimate = estimate_of(shift(0, 0, -0.9), 2);
    result_.ego.estimate.inliers = {1, 0};
    result_.ego.estimate.refined_flow_u = {0.25, 9};
    result_.ego.times = {1, 2, 0.5};
    result_.objects = {body(2)};
  }

  static ObjectTruth object(int id, double z_m) {
    ObjectTruth truth{.id = id, .T_camera_object = shift(1, 0, z_m) * yaw(90)};
    return truth;
  }

  static BodyResult body(int id) {
    BodyResult body;
    body.instance = id;
    body.track = 1;
    body.n_points = body.n_inliers = 50;
    body.distance_m = 9.5;
    body.area_fraction = 0.1;
    body.moving_share = 0.9;
    body.is_dynamic = true;
    body.centroid_m = {1, 0, 9};
    body.estimate = estimate_of(shift(0, 0, 0.7), 0);
    body.speed_mps = speed_mps(object_motion_prev(shift(0, 0, -0.9), shift(0, 0, 0.7)), body.centroid_m, 0.1);
    return body;
  }

  std::vector<Record> evaluate(const FlowSamples* flow = nullptr) const {
    return evaluate_pair(
        result_,
        {{.dataset = "vdo", .sequence = "s", .estimator = "joint_flow"}, camera, truth_, estimated_, flow});
  }

  SequenceTruth truth_;
  Trajectory estimated_;
  FrameResult result_;
};

void expect_near(const Record::Numbers& numbers, const std::map<std::string, double>& expected,
                 double tolerance) {
  for (const auto& [key, value] : expected) EXPECT_NEAR(numbers.at(key), value, tolerance) << key;
}

TEST_F(EvaluatePair, EgoErrorsOfAPureTranslation) {
  const Record ego = evaluate().at(0);
  EXPECT_EQ(ego.body, "ego");
  EXPECT_EQ(ego.frame, 5);
  EXPECT_EQ(ego.status, Status::ok);
  expect_near(ego.errors, {{"Et_m", 0.1}, {"ER_deg", 0}}, 1e-12);
  expect_near(ego.values,
              {{"step_gt_m", 1},
               {"step_m", 0.9},
               {"step_error_x_m", 0},
               {"step_error_y_m", 0},
               {"step_error_z_m", -0.1},
               {"rotation_gt_deg", 0}},
              1e-12);
  EXPECT_EQ(ego.values.at("start_propagated"), 0);
  EXPECT_EQ(ego.time_ms.at("total"), 3.5);
}

TEST_F(EvaluatePair, AnEstimateBeyondEveryNumberOfARecordHasDiverged) {
  for (const double z_m : {1e99, 1e120, 1e200}) {
    estimated_.set(5, shift(5, 0, z_m));
    result_.ego.estimate = estimate_of(shift(0, 0, -z_m), 2);
    result_.objects[0].estimate = estimate_of(shift(0, 0, z_m), 0);
    for (const Record& record : evaluate()) {
      const bool is_readable =
          std::ranges::all_of(record.errors, [](auto& e) { return internal::is_number(e.second); });
      EXPECT_TRUE(is_readable && (record.status == Status::diverged) == record.errors.empty()) << z_m;
      EXPECT_NO_THROW(record_from_json(to_json(record), "record"));
    }
    EXPECT_EQ(evaluate().front().status, z_m > 1e100 ? Status::diverged : Status::ok) << z_m;
  }
}

// Without these values the record would not count as a missing estimate in the coverage.
TEST_F(EvaluatePair, ADivergedEstimateKeepsTheValuesOfTheTruth) {
  const std::vector<Record> right = evaluate();
  result_.ego.estimate = estimate_of(shift(0, 0, -1e120), 2);
  result_.objects[0].estimate = estimate_of(shift(0, 0, 1e120), 0);
  const std::vector<Record> diverged = evaluate();
  for (size_t i = 0; i < diverged.size(); ++i) {
    EXPECT_EQ(diverged[i].status, Status::diverged);
    EXPECT_TRUE(diverged[i].errors.empty());
    EXPECT_TRUE(has_truth(diverged[i]));
    for (const MetricDefinition* metric : metrics_for(truth_only)) {
      ASSERT_EQ(diverged[i].values.contains(metric->name), right[i].values.contains(metric->name));
      if (!right[i].values.contains(metric->name)) continue;
      EXPECT_EQ(diverged[i].values.at(metric->name), right[i].values.at(metric->name)) << metric->name;
    }
  }
  EXPECT_FALSE(diverged[0].values.contains("step_m"));
  EXPECT_FALSE(diverged[1].values.contains("v_kmh"));
}

TEST_F(EvaluatePair, AnObjectHasNotDivergedBecauseTheCameraHas) {
  estimated_.set(4, shift(0, 0, 1e120));
  estimated_.set(5, shift(0, 0, 2e120));
  Record object = evaluate().at(1);
  EXPECT_EQ(object.status, Status::ok);
  expect_near(object.errors, {{"Et_m", 0.3}, {"Et_body_m", 0.4}, {"Ev_kmh", 14.4}}, 1e-9);
  EXPECT_FALSE(object.errors.contains("Et_world_m"));
  EXPECT_FALSE(object.errors.contains("ER_world_deg"));

  result_.ego.estimate = estimate_of(shift(0, 0, -1e120), 2);
  result_.objects[0].speed_mps = 1e121;
  object = evaluate().at(1);
  EXPECT_EQ(object.status, Status::ok);
  EXPECT_NEAR(object.errors.at("Et_m"), 0.3, 1e-12);
  for (const char* name : {"Et_body_m", "ER_body_deg", "Ev_kmh", "Ev_origin_kmh"})
    EXPECT_FALSE(object.errors.contains(name)) << name;
}

TEST_F(EvaluatePair, ConsistencyIsRecorded) {
  result_.ego.split = {4.0, 9.0};
  result_.objects[0].split.sides = 5.0;
  result_.objects[0].expansion = ExpansionGap{0.5, 7.0};
  const std::vector<Record> records = evaluate();
  EXPECT_EQ(records[0].values.at("split_nees_sides"), 4.0);
  EXPECT_EQ(records[0].values.at("split_nees_cells"), 9.0);
  EXPECT_EQ(records[0].values.at("split_nees"), 6.5);
  EXPECT_EQ(records[1].values.at("split_nees_sides"), 5.0);
  EXPECT_FALSE(records[1].values.contains("split_nees"));
  EXPECT_FALSE(records[0].values.contains("expansion_chi2"));
  EXPECT_EQ(records[1].values.at("expansion_gap_m"), 0.5);
  EXPECT_EQ(records[1].values.at("expansion_chi2"), 7.0);
}

TEST_F(EvaluatePair, TheDefinitionOfExpansionChi2StatesTheErrorsThatItAssumes) {
  const std::string& definition = metric(NumberMap::values, "expansion_chi2").definition;
  EXPECT_NE(definition.find(fmt::format("{} px of the flow", common_flow_px)), std::string::npos);
  EXPECT_NE(definition.find(fmt::format("{} px of the change of the disparity", common_disparity_px)),
            std::string::npos);
}

TEST_F(EvaluatePair, EpeIsOverInliersAgainstInducedFlow) {
  const Record ego = evaluate().at(0);
  EXPECT_EQ(ego.flow_truth, "induced");
  EXPECT_NEAR(ego.errors.at("epe_initial_px"), 1, 1e-12);
  EXPECT_GT(ego.errors.at("epe_measured_px"), ego.errors.at("epe_initial_px"));
  expect_near(ego.errors, {{"epe_initial_x_px", 1}, {"epe_initial_y_px", 0}, {"epe_refined_px", 0.25}},
              1e-12);
}

TEST_F(EvaluatePair, GivenTrueFlowWins) {
  const FlowSamples flow({{50, 50, {0.5F, 2.0F}}});
  const Record ego = evaluate(&flow).at(0);
  EXPECT_EQ(ego.flow_truth, "given");
  expect_near(ego.errors, {{"epe_initial_x_px", 0.5}, {"epe_initial_y_px", 2}}, 1e-12);
}

TEST_F(EvaluatePair, NoEpeWhereTheTrueFlowIsUnknown) {
  const FlowSamples flow({{51, 50, {0.5F, 2.0F}}});
  const Record ego = evaluate(&flow).at(0);
  EXPECT_EQ(ego.flow_truth, "");
  EXPECT_FALSE(ego.errors.contains("epe_initial_px"));
}

TEST_F(EvaluatePair, ObjectErrorsInEveryFrame) {
  const Record object = evaluate().at(1);
  EXPECT_EQ(object.body, "object:2");
  EXPECT_EQ(object.status, Status::ok);
  EXPECT_NEAR(object.errors.at("Et_m"), 0.3, 1e-12);
  EXPECT_NEAR(object.errors.at("Et_world_m"), 0.4, 1e-9);  // H: 1.6 m instead of 2 m
  expect_near(object.errors, {{"Et_body_m", 0.4}, {"ER_world_deg", 0}}, 1e-9);
  expect_near(object.values, {{"v_kmh", 57.6}, {"v_gt_kmh", 72}, {"v_gt_origin_kmh", 72}}, 1e-9);
  expect_near(object.errors, {{"Ev_kmh", 14.4}, {"Ev_origin_kmh", 14.4}}, 1e-9);
  EXPECT_EQ(object.values.at("distance_gt_m"), 10);
  EXPECT_EQ(object.values.at("dynamic_gt"), 1);
  EXPECT_EQ(object.values.at("dynamic"), 1);
  EXPECT_EQ(object.values.at("interpolated_gt"), 0);
}

TEST_F(EvaluatePair, TurningObjectHasTwoTrueVelocities) {
  truth_.objects[5][0].T_camera_object = shift(1, 0, 11) * yaw(100);  // rotates by 10 deg about its origin
  result_.objects[0].centroid_m = {1, 0, 9};                          // 1 m in front of the origin
  const Record object = evaluate().at(1);
  const Eigen::Vector3d lever = yaw(10) * Eigen::Vector3d(0, 0, -1) - Eigen::Vector3d(0, 0, -1);
  const double expected_kmh = (Eigen::Vector3d(0, 0, 2) + lever).norm() / 0.1 * 3.6;
  expect_near(object.values, {{"v_gt_origin_kmh", 72}, {"v_gt_kmh", expected_kmh}}, 1e-9);
  expect_near(object.errors, {{"ER_deg", 10}, {"ER_body_deg", 10}}, 1e-9);
}

TEST_F(EvaluatePair, EveryObjectHasAStatus) {
  truth_.objects[4] = {object(2, 10), object(3, 12), object(9, 30)};
  truth_.objects[5] = {object(2, 11), object(3, 13)};  // 9 has truth in one frame only
  BodyResult undetermined = body(4);
  BodyResult lost = body(5);
  lost.status = Status::lost;
  lost.moving_share = NAN;
  BodyResult gated = body(6);
  gated.status = Status::gated;
  gated.gate = Gate::distance;
  result_.objects = {body(2), undetermined, lost, gated};
  const std::vector<Record> records = evaluate();
  ASSERT_EQ(records.size(), 6U);
  EXPECT_EQ(records[1].body, "object:2");
  EXPECT_EQ(records[2].body, "object:3");
  EXPECT_EQ(records[2].status, Status::not_detected);
  EXPECT_EQ(records[2].values.at("dynamic_gt"), 1);
  EXPECT_TRUE(records[2].time_ms.empty());
  EXPECT_EQ(records[3].status, Status::no_truth);
  EXPECT_TRUE(records[3].errors.empty());
  EXPECT_TRUE(records[3].values.contains("v_kmh"));
  EXPECT_FALSE(records[3].values.contains("dynamic_gt"));
  EXPECT_EQ(records[4].status, Status::lost);
  EXPECT_FALSE(records[4].values.contains("dynamic"));
  EXPECT_EQ(records[5].status, Status::gated);
  EXPECT_EQ(records[5].gate, Gate::distance);
}

TEST_F(EvaluatePair, FlagOfTheDataSetDecidesWhatIsDynamic) {
  truth_.objects[4][0].moving = false;
  EXPECT_EQ(evaluate().at(1).values.at("dynamic_gt"), 0);
  truth_.objects[4][0].moving.reset();
  truth_.objects[5][0].T_camera_object = shift(1, 0, 9.05) * yaw(90);  // 0.05 m in the world: 0.5 m/s
  EXPECT_EQ(evaluate().at(1).values.at("dynamic_gt"), 0);
}

TEST_F(EvaluatePair, WithoutTruePosesEgoHasNoTruth) {
  truth_.camera = {};
  const std::vector<Record> records = evaluate();
  EXPECT_EQ(records[0].status, Status::no_truth);
  EXPECT_TRUE(records[0].errors.empty());
  EXPECT_EQ(records[1].status, Status::ok);
  EXPECT_NEAR(records[1].errors.at("Et_m"), 0.3, 1e-12);
  EXPECT_FALSE(records[1].errors.contains("Et_world_m"));
  EXPECT_FALSE(records[1].errors.contains("Ev_kmh"));
}

TEST_F(EvaluatePair, FailedEgoKeepsItsStatusAndItsTruth) {
  result_.ego.status = Status::too_few_points;
  estimated_ = {};
  result_.objects[0].speed_mps = NAN;
  const std::vector<Record> records = evaluate();
  EXPECT_EQ(records[0].status, Status::too_few_points);
  EXPECT_TRUE(records[0].errors.empty());
  EXPECT_TRUE(records[0].values.contains("step_gt_m"));
  EXPECT_TRUE(records[1].errors.contains("Et_m"));
  EXPECT_FALSE(records[1].errors.contains("Et_world_m"));
  EXPECT_FALSE(records[1].errors.contains("Et_body_m"));
  EXPECT_FALSE(records[1].errors.contains("Ev_kmh"));
}

}  // namespace
}  // namespace sextant
