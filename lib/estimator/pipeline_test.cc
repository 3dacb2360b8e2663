#include "sextant/estimator/pipeline.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "sextant/base/error.h"
#include "sextant/estimator/registry.h"

namespace sextant {
namespace {

constexpr double dt_s = 0.1;
const StereoCamera camera = {{700, 700, 600, 180}, 380};

const SE3 camera_step(so3_exp({0.002, 0.01, -0.001}), Eigen::Vector3d(0.02, 0.01, 1.1));  // T_prev_curr
const SE3 object_step(so3_exp({0, 0.02, 0}), Eigen::Vector3d(0.1, 0, 1.4));  // H, previous camera

/// Exact points, on a grid around (u0, v0), of a body with motion X = T_curr_prev.
Correspondences exact_points(const SE3& X, double u0, double v0, double z0, int n) {
  Correspondences points;
  for (int i = 0; i < n; ++i) {
    const double u = u0 + 9.0 * (i % 20);
    const double v = v0 + 6.0 * (i / 20);
    const double z = z0 + 0.37 * ((i * 7) % 11);
    const Eigen::Vector3d m = X * camera.left.backproject(u, v, z);
    const Eigen::Vector2d uv = camera.left.project(m);
    points.push_back(u, v, z, uv.x() - u, uv.y() - v, m.z());
  }
  return points;
}

ObjectObservation observe(int instance, const SE3& X, int n = 200, double z = 8, double area = 0.02) {
  ObjectObservation object{
      .instance = instance, .area_fraction = area, .points = exact_points(X, 400, 150, z, n)};
  object.instance_prev.assign(n, static_cast<uint16_t>(instance));
  return object;
}

FramePair make_pair(int prev, std::vector<ObjectObservation> objects) {
  FramePair pair{.prev = prev,
                 .curr = prev + 1,
                 .dt_s = dt_s,
                 .width = 1242,
                 .height = 375,
                 .camera = camera,
                 .background = exact_points(camera_step.inverse(), 100, 60, 6, 300),
                 .objects = std::move(objects)};
  return pair;
}

const SE3 moving = camera_step.inverse() * object_step;  // X of the moving object
const SE3 standing = camera_step.inverse();

FrameEstimator make(const PipelineOptions& options = {}) { return {options, make_estimator("joint_flow")}; }

TEST(Pipeline, ExactMeasurementsGiveExactMotions) {
  FrameEstimator estimator = make();
  const FrameResult result = estimator.process(make_pair(0, {observe(4, moving)}));
  ASSERT_EQ(result.ego.status, Status::ok);
  EXPECT_LT((result.ego.estimate.T_curr_prev * camera_step).log().norm(), 1e-9);
  ASSERT_EQ(result.objects.size(), 1U);
  const BodyResult& object = result.objects[0];
  ASSERT_EQ(object.status, Status::ok);
  EXPECT_LT((object.estimate.T_curr_prev * moving.inverse()).log().norm(), 1e-9);
  EXPECT_TRUE(object.is_dynamic);
  EXPECT_EQ(object.n_inliers, 200);
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  const Correspondences points = exact_points(moving, 400, 150, 8, 200);
  for (size_t i = 0; i < points.size(); ++i)
    c += camera.left.backproject(points.u[i], points.v[i], points.depth[i]) / 200;
  EXPECT_NEAR(object.speed_mps, (object_step * c - c).norm() / dt_s, 1e-7);
}

TEST(Pipeline, StaticObjectIsGatedWithLabelZero) {
  FrameEstimator estimator = make();
  const FrameResult result = estimator.process(make_pair(0, {observe(4, standing)}));
  EXPECT_EQ(result.objects[0].status, Status::gated);
  EXPECT_EQ(result.objects[0].gate, Gate::is_static);
  EXPECT_EQ(result.objects[0].track, 0);
  FrameEstimator everything = make({.estimate_static_objects = true});
  const FrameResult estimated = everything.process(make_pair(0, {observe(4, standing)}));
  EXPECT_EQ(estimated.objects[0].status, Status::ok);
  EXPECT_NEAR(estimated.objects[0].speed_mps, 0, 1e-6);
}

// A parked car whose current depths have errors above the threshold; joint_flow does not use these depths.
TEST(Pipeline, LikelihoodClassifiesByTheEstimatedMotion) {
  ObjectObservation parked = observe(4, standing);
  for (size_t i = 0; i < parked.points.size(); ++i) parked.points.depth_curr[i] += i % 2 == 0 ? 0.5 : -0.5;
  const FramePair pair = make_pair(0, {parked, observe(5, moving)});
  const FrameResult by_threshold = make().process(pair);
  EXPECT_TRUE(by_threshold.objects[0].is_dynamic);
  EXPECT_FALSE(by_threshold.objects[0].likelihood);
  PipelineOptions options;
  options.classification.test = MotionTest::likelihood;
  const FrameResult result = make(options).process(pair);
  EXPECT_FALSE(result.objects[0].is_dynamic);
  EXPECT_EQ(result.objects[0].gate, Gate::is_static);
  EXPECT_EQ(result.objects[0].track, 0);
  EXPECT_TRUE(result.objects[0].likelihood);
  ASSERT_EQ(result.objects[1].status, Status::ok);
  EXPECT_TRUE(result.objects[1].is_dynamic);
  EXPECT_GT(result.objects[1].track, 0);
  EXPECT_LT((result.objects[1].estimate.T_curr_prev * moving.inverse()).log().norm(), 1e-9);
}

TEST(Pipeline, Gates) {
  FrameEstimator estimator = make();
  const FrameResult result = estimator.process(
      make_pair(0, {observe(1, moving, 200, 30), observe(2, moving, 200, 8, 0.004), observe(3, moving, 10)}));
  EXPECT_EQ(result.objects[0].gate, Gate::distance);
  EXPECT_EQ(result.objects[1].gate, Gate::area);
  EXPECT_EQ(result.objects[2].status, Status::too_few_points);
}

TEST(Pipeline, LostAndAppearing) {
  FrameEstimator estimator = make();
  ObjectObservation appearing{.instance = 9, .area_fraction = 0.1};
  FramePair pair = make_pair(0, {appearing});
  pair.lost_instances = {5};
  const FrameResult result = estimator.process(pair);
  ASSERT_EQ(result.objects.size(), 2U);
  EXPECT_EQ(result.objects[0].instance, 5);
  EXPECT_EQ(result.objects[0].status, Status::lost);
  EXPECT_EQ(result.objects[1].status, Status::lost);
}

TEST(Pipeline, LabelsFollowTheMajorityNotTheMaskIds) {
  FrameEstimator estimator = make();
  // In the mask of frame 1 the objects have the ids 1 and 2.
  FramePair first = make_pair(0, {observe(1, moving), observe(2, moving)});
  const FrameResult a = estimator.process(first);
  EXPECT_EQ(a.objects[0].track, 1);
  EXPECT_EQ(a.objects[1].track, 2);
  // In the mask of frame 2 they have the ids 7 and 3; a third of the points of 7 come from the wrong object.
  ObjectObservation was_one = observe(7, moving);
  was_one.instance_prev.assign(200, 1);
  std::fill_n(was_one.instance_prev.begin(), 70, 2);
  ObjectObservation was_two = observe(3, moving);
  was_two.instance_prev.assign(200, 2);
  const FrameResult b = estimator.process(make_pair(1, {was_two, was_one}));
  EXPECT_EQ(b.objects[0].instance, 3);
  EXPECT_EQ(b.objects[0].track, 2);
  EXPECT_EQ(b.objects[1].track, 1);
}

TEST(Pipeline, PointsOfAnOccludedBodyAreExcludedFromTheOccluder) {
  FrameEstimator estimator = make();
  // 40 points of instance 9 also land on instance 4; their motion is so similar that they would be inliers.
  ObjectObservation object = observe(4, moving);
  const Correspondences others =
      exact_points(SE3(Eigen::Quaterniond::Identity(), {0.004, 0, 0}) * moving, 400, 150, 8, 40);
  for (size_t i = 0; i < others.size(); ++i) {
    object.points.push_back(others.u[i], others.v[i], others.depth[i], others.flow_u[i], others.flow_v[i]);
    object.instance_prev.push_back(9);
  }
  const BodyResult body = estimator.process(make_pair(0, {object})).objects[0];
  ASSERT_EQ(body.status, Status::ok);
  EXPECT_EQ(body.n_points, 200);
  EXPECT_LT((body.estimate.T_curr_prev * moving.inverse()).log().norm(), 1e-9);
}

/// An estimator that records the problems and estimates nothing.
class Listener : public Estimator {
 public:
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override {
    problems.push_back(problem);
    n_inliers.push_back(static_cast<size_t>(std::ranges::count(start.inliers, 1)));
    MotionEstimate estimate{.status = Status::ok, .T_curr_prev = start.T_curr_prev, .inliers = start.inliers};
    return estimate;
  }
  Json options() const override { return Json::object(); }
  bool chooses_points() const override { return chooses; }

  bool chooses = false;
  mutable std::vector<Problem> problems;
  mutable std::vector<size_t> n_inliers;
};

/// Number of inliers that an estimator gets for the background and for an object, if a third of the flows are
/// wrong by 2 px.
std::vector<size_t> inliers_given(const PipelineOptions& options, bool chooses = false) {
  ObjectObservation object = observe(4, moving);
  FramePair pair = make_pair(0, {object});
  for (Correspondences* points : {&pair.background, &pair.objects[0].points}) {
    for (size_t i = 0; i < points->size(); i += 3) points->flow_v[i] += 2;
  }
  const auto listener = std::make_shared<Listener>();
  listener->chooses = chooses;
  FrameEstimator(options, listener).process(pair);
  return listener->n_inliers;
}

/// An estimator of a user whose estimate `spoil` has changed.
class Spoiled : public Listener {
 public:
  explicit Spoiled(std::function<void(MotionEstimate&)> spoil) : spoil_(std::move(spoil)) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override {
    MotionEstimate estimate = Listener::estimate(problem, start);
    spoil_(estimate);
    return estimate;
  }

 private:
  std::function<void(MotionEstimate&)> spoil_;
};

TEST(Pipeline, AnEstimateThatIsNotFiniteHasDiverged) {
  const auto spoil = [](MotionEstimate& estimate) {
    estimate.T_curr_prev = SE3(estimate.T_curr_prev.rotation(), Eigen::Vector3d(0, NAN, 0));
  };
  const FrameResult result =
      FrameEstimator({}, std::make_shared<Spoiled>(spoil)).process(make_pair(0, {observe(4, moving)}));
  EXPECT_EQ(result.ego.status, Status::diverged);
  ASSERT_EQ(result.objects.size(), 1U);
  EXPECT_NE(result.objects[0].status, Status::ok);
}

TEST(Pipeline, ArraysThatDoNotFitThePointsAreErrors) {
  const auto process = [](const std::function<void(MotionEstimate&)>& spoil) {
    FrameEstimator({}, std::make_shared<Spoiled>(spoil)).process(make_pair(0, {}));
  };
  EXPECT_NO_THROW(process([](MotionEstimate&) {}));
  EXPECT_THAT(
      [&] { process([](MotionEstimate& e) { e.inliers.clear(); }); },
      testing::ThrowsMessage<Error>(testing::HasSubstr("MotionEstimate::inliers with 0 values for 300")));
  EXPECT_THAT([&] { process([](MotionEstimate& e) { e.refined_flow_u.resize(7); }); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("refined_flow_u with 7 values for 300")));
}

TEST(Pipeline, RefinesOnThePointsThatTheOptionsName) {
  const std::vector<size_t> inliers = inliers_given({.refine_on = RefineOn::inliers});
  ASSERT_EQ(inliers.size(), 2U);
  const std::vector<size_t> all = inliers_given({.refine_on = RefineOn::all});
  EXPECT_GT(all[0], inliers[0]);
  EXPECT_GT(all[1], inliers[1]);
  EXPECT_EQ(inliers_given({.refine_on = RefineOn::all, .refine_objects_on = RefineObjectsOn::inliers}),
            (std::vector<size_t>{all[0], inliers[1]}));
  EXPECT_EQ(inliers_given({.refine_on = RefineOn::all}, /*chooses=*/true), inliers);
}

TEST(Pipeline, DeclaredNoiseReachesTheEstimatorByPreviousBody) {
  ObjectObservation object = observe(4, moving);
  object.instance_prev.assign(200, 9);  // ids change between masks
  FramePair pair = make_pair(0, {object});
  const auto listen = [&] {
    const auto listener = std::make_shared<Listener>();
    FrameEstimator(PipelineOptions(), listener).process(pair);
    EXPECT_EQ(listener->problems.size(), 2U);
    return listener->problems;
  };
  for (const Problem& problem : listen()) EXPECT_FALSE(problem.noise);
  pair.noise = {{0, {0.3, 0.2, 1e-3}}, {4, {5, 5, 1}}, {9, {0.1, 0.4, 2e-3}}};
  const std::vector<Problem> problems = listen();
  EXPECT_EQ(problems[0].noise, pair.noise[0]);
  EXPECT_EQ(problems[1].noise, pair.noise[9]);
}

TEST(Pipeline, MajorityZeroStartsANewLabel) {
  FrameEstimator estimator = make();
  estimator.process(make_pair(0, {observe(1, moving), observe(2, standing)}));
  // Object 2 starts to move: its last label is 0. Most points of a new object come from the background.
  ObjectObservation newcomer = observe(3, moving, 100);
  newcomer.instance_prev.assign(100, 1);
  newcomer.n_background = 300;
  const FrameResult result =
      estimator.process(make_pair(1, {observe(1, moving), observe(2, moving), newcomer}));
  EXPECT_EQ(result.objects[0].track, 1);
  EXPECT_EQ(result.objects[1].track, 2);
  EXPECT_EQ(result.objects[2].track, 3);
}

TEST(Pipeline, ALabelIsGivenOnce) {
  FrameEstimator estimator = make();
  estimator.process(make_pair(0, {observe(1, moving)}));
  ObjectObservation piece = observe(2, moving, 60);
  piece.instance_prev.assign(60, 1);
  const FrameResult result = estimator.process(make_pair(1, {observe(1, moving), piece}));
  EXPECT_EQ(result.objects[0].track, 1);
  EXPECT_EQ(result.objects[1].track, 2);
}

TEST(Pipeline, PropagatesMotionsAndForgetsThemAcrossAGap) {
  FrameEstimator estimator = make();
  EXPECT_FALSE(estimator.process(make_pair(0, {})).ego.start_propagated);
  // The exact motion again: RANSAC can only tie with the propagated one.
  EXPECT_TRUE(estimator.process(make_pair(1, {})).ego.start_propagated);
  EXPECT_FALSE(estimator.process(make_pair(5, {})).ego.start_propagated);
}

TEST(Pipeline, ObjectMotionIsPropagatedThroughTheCameraMotion) {
  // An object with constant motion in the world: H in the second camera is that of the first one,
  // transformed.
  FrameEstimator estimator = make();
  estimator.process(make_pair(0, {observe(1, moving)}));
  const SE3 H2 = camera_step.inverse() * object_step * camera_step;
  const FrameResult second = estimator.process(make_pair(1, {observe(1, camera_step.inverse() * H2)}));
  EXPECT_TRUE(second.objects[0].start_propagated);
}

TEST(Pipeline, NoEgoMotionStillEstimatesObjectsInTheCameraFrame) {
  FrameEstimator estimator = make();
  FramePair pair = make_pair(0, {observe(1, moving)});
  pair.background = {};
  const FrameResult result = estimator.process(pair);
  EXPECT_EQ(result.ego.status, Status::too_few_points);
  EXPECT_EQ(result.objects[0].status, Status::ok);
  EXPECT_TRUE(std::isnan(result.objects[0].speed_mps));
  EXPECT_TRUE(std::isnan(result.objects[0].moving_share));
}

TEST(Pipeline, OptionsAreChecked) {
  EXPECT_THROW(make({.max_object_distance_m = -1}), Error);
  EXPECT_THROW(make({.min_object_points = 2}), Error);
  PipelineOptions options;
  EXPECT_THROW(read_options(Json{{"refine_on", "same"}}, options), Error);
  EXPECT_THROW(read_options(Json{{"refine_objects_on", "some"}}, options), Error);
}

}  // namespace
}  // namespace sextant
