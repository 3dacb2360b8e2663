#include <gtest/gtest.h>

#include <algorithm>

#include "sextant/eval/report/claims/testing.h"
#include "sextant/eval/report/tables/testing.h"

namespace sextant {
namespace {

/// test_evidence() with the errors of motion_only on the sets `factor` times those of joint_flow.
Evidence with_gain(double factor) {
  Evidence evidence = test_evidence();
  for (Record& r : evidence.parts.front().records) {
    if (r.estimator == "motion_only") r.errors["Et_m"] *= factor;
  }
  return evidence;
}

TEST(SetsClaims, GainsOfJoint) {
  const auto camera = [](double factor) { return check_claim("joint_camera", with_gain(factor)).front(); };
  EXPECT_NEAR(camera(4).value, 300, 1e-9);
  EXPECT_EQ(camera(4).verdict, Verdict::reproduced);
  EXPECT_EQ(camera(1.01).verdict, Verdict::not_reproduced);
  const auto objects = [](double factor) { return check_claim("joint_objects", with_gain(factor)); };
  EXPECT_EQ(objects(1.15).size(), 3U);
  EXPECT_EQ(objects(1.15).front().verdict, Verdict::reproduced);
  EXPECT_EQ(objects(1.5).front().verdict, Verdict::not_reproduced);
}

TEST(SetsClaims, GainIsSelectionWhereEqualPointsGainNothing) {
  const auto results = [](double of_inliers, double of_joint) {
    Evidence evidence = test_evidence();
    for (Record& r : evidence.parts.back().records) {
      if (r.estimator.str().ends_with("on inliers")) r.errors["Et_m"] *= of_inliers;
      if (r.estimator.str().starts_with("joint_flow on")) r.errors["Et_m"] *= of_joint;
    }
    return check_claim("gain_is_selection", evidence);
  };
  const std::vector<ClaimResult> selection = results(4, 1);
  ASSERT_EQ(selection.size(), 10U);  // four bodies on two choices of points; the camera with two functions
  for (const ClaimResult& result : selection)
    EXPECT_EQ(result.verdict, Verdict::reproduced) << result.quantity;
  EXPECT_NEAR(selection.front().value, 0, 1e-9);
  EXPECT_NEAR(selection.back().value, 300, 1e-9);
  EXPECT_EQ(results(1, 1).back().verdict, Verdict::not_reproduced);
  EXPECT_EQ(results(4, 0.5).front().verdict, Verdict::not_reproduced);
}

TEST(SetsClaims, EqualityIsToTheMicrometre) {
  EXPECT_EQ(check_claim("joint_is_matched", with_gain(1)).front().verdict, Verdict::reproduced);
  EXPECT_EQ(check_claim("joint_is_matched", with_gain(1.001)).front().verdict, Verdict::not_reproduced);
}

TEST(SetsClaims, EpeAndClassification) {
  Evidence evidence = test_evidence();
  EXPECT_EQ(check_claim("epe_falls", evidence).front().verdict, Verdict::reproduced);
  EXPECT_DOUBLE_EQ(check_claim("epe_falls", evidence).front().value, -50);
  EXPECT_EQ(check_claim("classification", evidence).front().value, 0);
  for (Record& r : evidence.parts[2].records) {
    if (!r.is_ego()) r.values["dynamic"] = 0;
  }
  EXPECT_EQ(check_claim("classification", evidence).front().verdict, Verdict::not_reproduced);
}

TEST(RealClaims, VelocityOrbSlamAndFrameRate) {
  const Evidence evidence = test_evidence();
  EXPECT_EQ(check_claim("velocity", evidence).front().verdict, Verdict::reproduced);
  const ClaimResult ahead = check_claim("ahead_of_orb_slam", evidence).front();
  EXPECT_DOUBLE_EQ(ahead.value, 0);  // both systems have the same errors
  EXPECT_EQ(ahead.verdict, Verdict::undecided);
  const std::vector<ClaimResult> floor = check_claim("within_floor", evidence);
  ASSERT_EQ(floor.size(), 2U);  // ours, and the published difference of 0.0088 m
  EXPECT_EQ(floor[0].verdict, Verdict::reproduced);
  EXPECT_NEAR(floor[1].value, 0.0088, 1e-12);
  const std::vector<ClaimResult> rotation = check_claim("rotation_floor", evidence);
  ASSERT_EQ(rotation.size(), 3U);                           // published twice, and the recorded trajectories
  EXPECT_EQ(rotation[0].verdict, Verdict::reproduced);      // 0.057 deg between 0.02 and 0.06
  EXPECT_EQ(rotation[1].verdict, Verdict::not_reproduced);  // 0.062 deg
  EXPECT_EQ(rotation[2].verdict, Verdict::reproduced);
  // extraction 4, camera 5, three objects of 5 ms: 24 ms.
  EXPECT_NEAR(check_claim("frame_rate", evidence).front().value, 1000.0 / 24, 1e-9);
}

TEST(EvidenceClaims, NothingIsClaimedWithoutRecords) {
  Evidence none;
  none.published = paper().published;
  for (const CheckedClaim& checked : check_claims(none)) EXPECT_TRUE(checked.results.empty());
}

}  // namespace
}  // namespace sextant
