#include "sextant/eval/diagnosis/motion_disagreement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sextant {
namespace {

TEST(MotionFactor, IsThatOfTheLeastSquaresFitWithItsStandardError) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  constexpr int n_samples = 200;
  double off = 0, stated = 0;
  for (int sample = 0; sample < n_samples; ++sample) {
    std::vector<Eigen::Vector3d> truth, estimate;
    for (int i = 0; i < 100; ++i) {
      truth.push_back(draw());
      estimate.push_back(-0.5 * truth.back() + 0.3 * draw());
    }
    const auto found = motion_factor(truth, estimate);
    ASSERT_TRUE(found);
    off += std::pow(found->factor + 0.5, 2) / n_samples;
    stated += std::pow(found->standard_error, 2) / n_samples;
  }
  EXPECT_NEAR(std::sqrt(off), 0.3 / std::sqrt(300.0), 0.003);  // sigma / |t| of 100 vectors of 3 numbers
  EXPECT_NEAR(std::sqrt(stated), std::sqrt(off), 0.004);
}

TEST(MotionFactor, NeedsMotionInMoreThanOneStretch) {
  std::vector<Eigen::Vector3d> truth(20, Eigen::Vector3d::Zero());
  EXPECT_FALSE(motion_factor(truth, truth));
  truth[3] = {1, 0, 0};
  EXPECT_TRUE(std::isinf(motion_factor(truth, truth)->standard_error));
  truth.resize(9);
  EXPECT_FALSE(motion_factor(truth, truth));
}

}  // namespace
}  // namespace sextant
