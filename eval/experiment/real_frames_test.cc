// Tests with real frames, stereo pairs and true motions, end to end.

#include <gtest/gtest.h>

#include "sextant/base/testing.h"
#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/estimator/reference/ceres_reference.h"
#include "sextant/estimator/registry.h"
#include "sextant/estimator/solvers/testing.h"
#include "sextant/eval/experiment/run.h"

namespace sextant {
namespace {

TEST(RealFrames, JointFlowEqualsCeresInPoseAndEveryFlow) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  const auto sequence = open_source(SourceSpec::parse("vdo:" + real_data("kitti_03_demo").string() + "@0-6"));
  const SequenceInfo& info = sequence->info();
  const JointFlowOptions options;
  MotionOnlyOptions matched{.sigma_px = options.effective_kernel().sigma_px,
                            .huber = options.effective_kernel().threshold};

  FrameEstimator pipeline({}, make_estimator("joint_flow"));
  constexpr Channels channels{.gray = true, .depth = true, .flow = true, .mask = true};
  Frame prev = sequence->read(info.first_frame, channels);
  int n_bodies = 0;
  for (int k = info.first_frame + 1; k <= info.last_frame; ++k) {
    Frame curr = sequence->read(k, channels);
    const FrameResult result =
        pipeline.process(extract_frame_pair(prev, curr, info.camera, 1.0 / info.rate_hz, {}));
    prev = std::move(curr);
    std::vector<BodyResult> bodies = result.objects;
    bodies.push_back(result.ego);
    for (const BodyResult& body : bodies) {
      if (body.status != Status::ok) continue;
      ++n_bodies;
      const Problem problem{info.camera, body.points};
      Vector6d away;
      away << 0.01, -0.01, 0.02, 0.001, 0.001, -0.001;  // a starting point away from the optimum under test
      const StartingPoint start{SE3::exp(away) * body.estimate.T_curr_prev, body.estimate.inliers};
      const MotionEstimate reference = JointFlowCeres(options).estimate(problem, start);
      const MotionEstimate motion_only = MotionOnly(matched).estimate(problem, start);
      ASSERT_EQ(reference.status, Status::ok);
      EXPECT_LT(pose_difference(body.estimate.T_curr_prev, reference.T_curr_prev), 1e-8)
          << k << ' ' << body.instance;
      EXPECT_LT(flow_difference(body.estimate, reference), 1e-6) << k << ' ' << body.instance;
      EXPECT_LT(pose_difference(body.estimate.T_curr_prev, motion_only.T_curr_prev), 1e-10)
          << k << ' ' << body.instance;
    }
  }
  EXPECT_GE(n_bodies, 12);
}

// Without given flow and depth: images of a stereo pair, processed by SGBM and DIS, and MOTS masks.
TEST(RealFrames, KittiStereoPairsGiveTheCamerasMotion) {
  SEXTANT_NEEDS_DATA("kitti_tracking");
  RunConfig config;
  config.sources = {SourceSpec::parse("kitti:" + real_data("kitti_tracking").string() + "#0005@0-15")};
  config.jobs = 2;
  config.quiet = true;
  double sum_m = 0, sum_deg = 0;
  int n = 0;
  for (const Record& record : run(config).records) {
    if (!record.is_ego()) continue;
    ASSERT_EQ(record.status, Status::ok) << record.frame;
    sum_m += record.errors.at("Et_m");
    sum_deg += record.errors.at("ER_deg");
    ++n;
  }
  ASSERT_EQ(n, 15);
  fmt::print("mean E_t {:.4f} m, mean E_R {:.4f} deg\n", sum_m / n, sum_deg / n);
  EXPECT_LE(sum_m / n, 0.12);
  EXPECT_LE(sum_deg / n, 0.12);
}

// The true motions of real sequences, rendered without noise, are recovered.
TEST(RealFrames, ReplaysGiveTheTrueMotions) {
  SEXTANT_NEEDS_DATA("vkitti_1.3.1_text");
  SEXTANT_NEEDS_DATA("kitti_tracking");
  RunConfig config;
  for (const char* source :
       {"replay-vkitti1:{}vkitti_1.3.1_text#0018@124-128", "replay-vkitti1:{}vkitti_1.3.1_text#0001@410-414",
        "replay-kitti:{}kitti_tracking#0003@8-12", "replay-kitti:{}kitti_tracking#0020@0-4"}) {
    config.sources.push_back(SourceSpec::parse(fmt::format(fmt::runtime(source), real_data("").string())));
  }
  config.jobs = 2;
  config.quiet = true;
  for (const char* estimator : {"motion_only", "joint_flow"}) {
    config.estimator = estimator;
    int n_objects = 0;
    for (const Record& record : run(config).records) {
      if (record.status != Status::ok) continue;
      const double limit = record.is_ego() ? 1e-6 : 1e-5;  // m and deg
      EXPECT_LT(record.errors.at("Et_m"), limit) << record.sequence << ' ' << record.frame << record.body;
      EXPECT_LT(record.errors.at("ER_deg"), limit) << record.sequence << ' ' << record.frame << record.body;
      n_objects += record.is_ego() ? 0 : 1;
    }
    EXPECT_GE(n_objects, 20) << estimator;
  }
}

}  // namespace
}  // namespace sextant
