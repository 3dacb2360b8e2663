#include "sextant/eval/experiment/evaluate_pair.h"

#include <gtest/gtest.h>

#include "sextant/estimator/registry.h"
#include "sextant/metrics/crlb.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

const StereoCamera stereo{{700, 700, 600, 180}, 350};
const SE3 T_world_prev(so3_exp({0, 0.4, 0}), {3, 0, 9});
const SE3 T_prev_curr(so3_exp({0, 0.02, 0}), {0, 0, 1});
const SE3 L(so3_exp({0, 0.3, 0}), {-2, 1, 8});  // T_camera_object, previous frame
const SE3 X(so3_exp({0, -0.03, 0}), {0.1, 0, -0.4});
constexpr int id = 5;

Correspondences exact_points(const SE3& T_curr_prev, double u0, double z0, int n) {
  Correspondences points;
  for (int i = 0; i < n; ++i) {
    const double u = u0 + 11 * (i % 12);
    const double v = 90 + 13.0 * (i / 12);
    const auto z = static_cast<float>(z0 + 0.41 * ((i * 7) % 11));
    const Eigen::Vector3d p = T_curr_prev * stereo.left.backproject(u, v, z);
    const Eigen::Vector2d uv = stereo.left.project(p);
    points.push_back(u, v, z, uv.x() - u, uv.y() - v, p.z());
  }
  return points;
}

/// A pair with the background and one object, with noise, and the pipeline's results for it.
class Limits : public testing::Test {
 protected:
  Limits() {
    clean_.prev = 0;
    clean_.curr = 1;
    clean_.dt_s = 0.1;
    clean_.width = 1242;
    clean_.height = 375;
    clean_.camera = stereo;
    clean_.background = exact_points(T_prev_curr.inverse(), 300, 6, 120);
    ObjectObservation object{.instance = id, .area_fraction = 0.1, .points = exact_points(X, 500, 7, 96)};
    object.instance_prev.assign(96, id);
    clean_.objects = {object};
    truth_.camera.set(0, T_world_prev);
    truth_.camera.set(1, T_world_prev * T_prev_curr);
    for (const int frame : {0, 1}) {
      ObjectTruth object_truth{.id = id, .T_camera_object = frame == 0 ? L : X * L};
      truth_.objects[frame] = {object_truth};
    }
  }

  std::vector<Record> evaluate(const char* noise) {
    FramePair pair = clean_;
    const Noise model(Json::parse(noise));
    if (!model.none()) pair = model.apply(clean_, Draws(3, "d", "s")).pair;
    PipelineOptions options;
    options.max_object_distance_m = max_object_distance_m_;
    options.start.inlier_threshold_px = 5;
    result_ = FrameEstimator(options, make_estimator("motion_only")).process(pair);
    const Trajectory none;
    return evaluate_pair(result_,
                         {{.dataset = "d", .sequence = "s", .estimator = "motion_only", .noise = "n"},
                          stereo.left,
                          truth_,
                          none,
                          nullptr,
                          model.none() ? nullptr : &clean_});
  }

  SequenceTruth truth_;
  FramePair clean_;
  FrameResult result_;
  double max_object_distance_m_ = 25;
};

const char* const gaussian = R"({"depth": {"delta_d_px": 0.3}, "flow": {"epe_x_px": 0.4, "epe_y_px": 0.2}})";
const MeasurementNoise declared{0.4, 0.2, 0.3 / 350};

TEST_F(Limits, BoundsUseTheCleanPointsOfTheEstimator) {
  max_object_distance_m_ = 10;  // excludes some points of the object
  const std::vector<Record> records = evaluate(gaussian);
  ASSERT_EQ(records.size(), 2U);
  ASSERT_EQ(records[1].status, Status::ok);
  EXPECT_LT(records[1].n_points, 96);
  EXPECT_GT(records[1].n_points, 40);

  const auto ego = motion_bound(stereo.left, clean_.background, T_prev_curr.inverse(), declared);
  EXPECT_NEAR(records[0].bound.at("Et_m") / rms_error(ego->previous_depth).Et_m, 1, 1e-9);
  EXPECT_NEAR(records[0].bound.at("ER_deg") / rms_error(ego->previous_depth).ER_deg, 1, 1e-9);
  EXPECT_NEAR(records[0].bound.at("Et_both_m") / rms_error(*ego->both_depths).Et_m, 1, 1e-9);
  EXPECT_FALSE(records[0].bound.contains("Et_body_m"));

  Correspondences near;
  const Correspondences& all = clean_.objects[0].points;
  const Correspondences& offered = result_.objects[0].points;
  for (size_t i = 0; i < all.size(); ++i) {
    for (size_t k = 0; k < offered.size(); ++k) {
      if (offered.u[k] == all.u[i] && offered.v[k] == all.v[i])
        near.push_back(all.u[i], all.v[i], all.depth[i], 0, 0, all.depth_curr[i]);
    }
  }
  const auto object = motion_bound(stereo.left, near, X, declared);
  const PoseChangeError camera_frame = rms_error(transported(object->previous_depth, X.inverse()));
  EXPECT_NEAR(records[1].bound.at("Et_m") / camera_frame.Et_m, 1, 1e-9);
  EXPECT_NEAR(records[1].bound.at("ER_deg") / camera_frame.ER_deg, 1, 1e-9);
  EXPECT_LT(records[1].bound.at("Et_both_m"), camera_frame.Et_m);
  const Matrix6d both_bodies = object->previous_depth + ego->previous_depth;
  EXPECT_NEAR(records[1].bound.at("Et_body_m") / rms_error(transported(both_bodies, (X * L).inverse())).Et_m,
              1, 1e-9);
}

TEST_F(Limits, NoBoundWithoutGaussianNoise) {
  for (const char* noise :
       {"{}", R"({"depth": {"delta_d_px": 0.1}})", R"({"flow": {"epe_px": 0.3}, "outliers": {"share": 0.1}})",
        R"({"flow": {"epe_px": 0.3}, "correlation": "shared_per_frame"})"}) {
    for (const Record& record : evaluate(noise)) {
      EXPECT_TRUE(record.bound.empty()) << noise;
      EXPECT_EQ(record.values.contains("nees"), record.status == Status::ok) << noise;
    }
  }
}

TEST_F(Limits, NoBoundWithoutPointsForTheEstimator) {
  max_object_distance_m_ = 6;
  const std::vector<Record> records = evaluate(gaussian);
  EXPECT_EQ(records[1].status, Status::gated);
  EXPECT_TRUE(records[1].bound.empty());
  EXPECT_FALSE(records[1].values.contains("nees"));
  EXPECT_TRUE(records[0].bound.contains("Et_m"));
  truth_.camera = {};
  EXPECT_TRUE(evaluate(gaussian)[0].bound.empty());
}

}  // namespace
}  // namespace sextant
