// Tests against cases worked by hand.

#include "sextant/metrics/dense_errors.h"

#include <gtest/gtest.h>

#include <vector>

namespace sextant {
namespace {

TEST(DenseFlowError, ByHand) {
  Image<Flow> truth(5, 1), estimate(5, 1);
  truth(0, 0) = {10, 0};
  estimate(0, 0) = {13, 4};  // error 5 px, 50 %: an outlier
  truth(1, 0) = {0, -100};
  estimate(1, 0) = {-4, -100};  // error 4 px, but only 4 %
  truth(2, 0) = {1, 1};
  estimate(2, 0) = {1, 3.5f};  // error 2.5 px
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
  EXPECT_NEAR(error.shift_px, 2, 1e-5);  // over the last three pixels
  EXPECT_DOUBLE_EQ(error.outlier_share, 0.25);
  EXPECT_DOUBLE_EQ(error.coverage, 0.8);
  EXPECT_NEAR(dense_disparity_error(estimate, truth, 128).mean_px, 1.25, 1e-5);
}

TEST(DenseDisparityError, AnErrorOfExactlyThePermittedOneIsNoOutlier) {
  for (const double bf : {387.57, 386.1448, 388.18, 300.0}) {
    Image<float> truth(200, 1), exact(200, 1), more(200, 1);
    for (int x = 0; x < 200; ++x) {
      const double d = 1 + x / 4.0;
      truth(x, 0) = static_cast<float>(bf / d);
      exact(x, 0) = static_cast<float>(bf / (d + 3));
      more(x, 0) = static_cast<float>(bf / (d + 3 + 1 / 256.0));  // the next value of a disparity image
    }
    EXPECT_EQ(dense_disparity_error(exact, truth, bf).n_outliers, 0) << bf;
    EXPECT_EQ(dense_disparity_error(more, truth, bf).n_outliers, 200) << bf;
  }
}

TEST(DenseDisparityError, WithoutEstimateOrTruth) {
  const Image<float> none(2, 1, NAN), some(2, 1, 4.0f);
  EXPECT_TRUE(std::isnan(dense_disparity_error(none, some, 100).mean_px));
  EXPECT_EQ(dense_disparity_error(none, some, 100).coverage, 0);
  EXPECT_TRUE(std::isnan(dense_disparity_error(some, none, 100).coverage));
  EXPECT_THROW(dense_disparity_error(some, Image<float>(1, 2), 100), InternalError);
}

TEST(DenseErrors, PoolOverPixels) {
  Image<Flow> truth(4, 1, Flow{10, 0}), near(4, 1, Flow{11, 0}), none(4, 1);
  Image<Flow> far = none;
  far(0, 0) = {10, 6};
  const std::vector<DenseFlowError> flows{dense_flow_error(near, truth), dense_flow_error(far, truth),
                                          dense_flow_error(none, truth)};
  const DenseFlowError flow = pooled(flows);
  EXPECT_EQ(flow.n, 5);
  EXPECT_EQ(flow.n_truth, 12);
  EXPECT_DOUBLE_EQ(flow.epe_px, (4 * 1 + 6) / 5.0);
  EXPECT_DOUBLE_EQ(flow.x_px, 4 / 5.0);
  EXPECT_DOUBLE_EQ(flow.y_px, 6 / 5.0);
  EXPECT_DOUBLE_EQ(flow.outlier_share, 1 / 5.0);
  EXPECT_DOUBLE_EQ(flow.coverage, 5 / 12.0);
  const Image<float> depth(2, 1, 10), true_depth(2, 1, 20), no_depth(2, 1, NAN);
  const std::vector<DenseDisparityError> depths{dense_disparity_error(depth, true_depth, 100),
                                                dense_disparity_error(no_depth, true_depth, 100)};
  EXPECT_DOUBLE_EQ(pooled(depths).mean_px, 5);
  EXPECT_DOUBLE_EQ(pooled(depths).outlier_share, 1);
  EXPECT_DOUBLE_EQ(pooled(depths).coverage, 0.5);
  EXPECT_TRUE(std::isnan(pooled(depths).shift_px));
  const Image<float> close(1, 1, 18);
  const std::vector<DenseDisparityError> shifted{dense_disparity_error(close, Image<float>(1, 1, 20), 100),
                                                 depths[0],
                                                 dense_disparity_error(close, Image<float>(1, 1, 15), 100)};
  EXPECT_NEAR(pooled(shifted).shift_px, (100 / 18. - 100 / 20. + 100 / 18. - 100 / 15.) / 2, 1e-6);
  EXPECT_EQ(pooled(std::span<const DenseFlowError>()).n, 0);
  EXPECT_TRUE(std::isnan(pooled(std::span<const DenseFlowError>()).coverage));
}

}  // namespace
}  // namespace sextant
