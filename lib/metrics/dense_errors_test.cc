// Against cases worked out by hand.

#include "sextant/metrics/dense_errors.h"

#include <gtest/gtest.h>

namespace sextant {
namespace {

TEST(DenseFlowError, ByHand) {
  Image<Flow> truth(5, 1), estimate(5, 1);
  truth(0, 0) = {10, 0};
  estimate(0, 0) = {13, 4};  // 5 px off, 50 %: an outlier
  truth(1, 0) = {0, -100};
  estimate(1, 0) = {-4, -100};  // 4 px off, but 4 %
  truth(2, 0) = {1, 1};
  estimate(2, 0) = {1, 3.5f};  // 2.5 px off
  truth(3, 0) = {7, 7};        // no estimate
  estimate(4, 0) = {7, 7};     // no truth
  const DenseFlowError error = dense_flow_error(estimate, truth);
  EXPECT_EQ(error.n, 3);
  EXPECT_DOUBLE_EQ(error.epe_px, (5 + 4 + 2.5) / 3);
  EXPECT_DOUBLE_EQ(error.x_px, (3 + 4 + 0) / 3.0);
  EXPECT_DOUBLE_EQ(error.y_px, (4 + 0 + 2.5) / 3);
  EXPECT_DOUBLE_EQ(error.outlier_share, 1.0 / 3);
  EXPECT_DOUBLE_EQ(error.coverage, 3.0 / 4);
}

TEST(DenseFlowError, WithoutEstimateOrTruth) {
  const Image<Flow> none(2, 1), some(2, 1, Flow{1, 2});
  EXPECT_TRUE(std::isnan(dense_flow_error(none, some).epe_px));
  EXPECT_EQ(dense_flow_error(none, some).coverage, 0);
  EXPECT_TRUE(std::isnan(dense_flow_error(some, none).coverage));
  EXPECT_THROW(dense_flow_error(some, Image<Flow>(1, 2)), InternalError);
}

TEST(DenseDisparityError, ByHand) {
  Image<float> truth(6, 1, NAN), estimate(6, 1, NAN);
  const auto set = [&](int x, float true_disparity, float disparity) {
    truth(x, 0) = 256 / true_disparity;
    estimate(x, 0) = 256 / disparity;
  };
  set(0, 16, 20);    // 4 px, 25 %: an outlier
  set(1, 128, 132);  // 4 px, 3 %
  set(2, 8, 10);     // 2 px
  set(3, 8, 8);
  truth(4, 0) = 3;
  estimate(5, 0) = 3;
  const DenseDisparityError error = dense_disparity_error(estimate, truth, 256);
  EXPECT_EQ(error.n, 4);
  EXPECT_NEAR(error.mean_px, 2.5, 1e-5);
  EXPECT_NEAR(error.median_px, 3, 1e-5);
  EXPECT_DOUBLE_EQ(error.outlier_share, 0.25);
  EXPECT_DOUBLE_EQ(error.coverage, 0.8);
  EXPECT_NEAR(dense_disparity_error(estimate, truth, 128).mean_px, 1.25, 1e-5);
}

TEST(DenseDisparityError, WithoutEstimateOrTruth) {
  const Image<float> none(2, 1, NAN), some(2, 1, 4.0f);
  EXPECT_TRUE(std::isnan(dense_disparity_error(none, some, 100).median_px));
  EXPECT_EQ(dense_disparity_error(none, some, 100).coverage, 0);
  EXPECT_TRUE(std::isnan(dense_disparity_error(some, none, 100).coverage));
  EXPECT_THROW(dense_disparity_error(some, Image<float>(1, 2), 100), InternalError);
}

}  // namespace
}  // namespace sextant
