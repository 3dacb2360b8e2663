#include "sextant/eval/profile/noise_profile.h"

#include <cmath>
#include <vector>

#include "sextant/base/quantile.h"
#include "sextant/datasets/testing.h"

namespace sextant {
namespace {

std::unique_ptr<Sequence> scene() { return open_with("synthetic:s18@0-4", {{"cache", ""}}); }

double at(const SpatialCorrelation& spatial, double r) { return spatial.at(r); }

// Noise injected into a scene is recovered: magnitude by axis, tails, correlation.
TEST(NoiseProfile, IsRecoveredFromItsOwnNoise) {
  const SpatialCorrelation injected{{{5, 0.3}, {20, 0.3}, {60, 0.3}}};
  const Json noise = {
      {"flow", {{"epe_x_px", 0.9}, {"epe_y_px", 0.4}}},
      {"outliers", {{"share", 0.05}, {"radius_px", 30}}},
      {"depth", {{"delta_d_px", 0.3}, {"baseline_m", 0}}},
      {"correlation", {{"model", "spatial"}, {"lengths_px", {5, 20, 60}}, {"shares", {0.3, 0.3, 0.3}}}}};
  const auto sequence = scene();
  const NoiseProfile first =
      fit_noise_profile(*sequence, "scene", {.name = "first", .noise = Noise(noise), .seed = 1, .jobs = 2});
  ASSERT_TRUE(first.flow && first.disparity);
  const ChannelErrors& flow = first.flow->errors;
  EXPECT_EQ(first.flow->reference, "given");
  EXPECT_NEAR(flow.sigma_px[0], 0.9, 0.06);
  EXPECT_NEAR(flow.sigma_px[1], 0.4, 0.03);
  EXPECT_NEAR(flow.tail_share, 0.05, 0.01);  // some outliers are small by chance
  EXPECT_NEAR(flow.tail_radius_px, 30, 2);
  for (const double r : {1.0, 3.0, 8.0, 20.0, 50.0, 100.0})
    EXPECT_NEAR(at(flow.spatial, r), at(injected, r), 0.08) << r;
  const ChannelErrors& disparity = first.disparity->errors;
  EXPECT_EQ(first.disparity->reference, "given");
  EXPECT_NEAR(disparity.sigma_px[0], 0.3, 0.03);
  for (const double r : {3.0, 20.0}) EXPECT_NEAR(at(disparity.spatial, r), at(injected, r), 0.1) << r;

  // The fitted profile, injected in turn.
  const NoiseProfile second = fit_noise_profile(
      *sequence, "scene", {.name = "second", .noise = Noise(first.noise()), .seed = 2, .jobs = 2});
  EXPECT_NEAR(second.flow->errors.sigma_px[0] / flow.sigma_px[0], 1, 0.07);
  EXPECT_NEAR(second.flow->errors.sigma_px[1] / flow.sigma_px[1], 1, 0.07);
  EXPECT_NEAR(second.flow->errors.tail_share / flow.tail_share, 1, 0.1);
  for (const double r : {1.0, 3.0, 8.0, 20.0, 50.0, 100.0})
    EXPECT_NEAR(at(second.flow->errors.spatial, r), at(flow.spatial, r), 0.08) << r;

  // The correlation of noise drawn with the fit agrees with the measured one.
  for (size_t b = 0; b < flow.correlation.size(); ++b) {
    if (flow.correlation[b].distance_px >= 150) continue;
    EXPECT_NEAR(first.flow->injected[b], flow.correlation[b].value[0], 0.12)
        << flow.correlation[b].distance_px;
  }
  EXPECT_EQ(first.json(),
            fit_noise_profile(*sequence, "scene", {.name = "first", .noise = Noise(noise), .seed = 1})
                .json());  // for any number of jobs
  const Figure figure = profile_figure(first);
  EXPECT_FALSE(figure.data.rows.empty());
  EXPECT_THAT(figure.script, HasSubstr(fmt::format("set lmargin at screen {:.5f}", 1.8 / figure.width_cm)))
      << "space for the label of the axis";
  EXPECT_EQ(profile_table(first).rows.size(), 2U);
}

TEST(NoiseProfile, IndependentNoiseHasNoCorrelation) {
  const NoiseProfile profile = fit_noise_profile(
      *scene(), "scene",
      {.name = "white", .noise = Noise(Json{{"flow", {{"epe_px", 0.5}}}}), .seed = 1, .jobs = 2});
  EXPECT_TRUE(profile.flow->errors.spatial.parts.empty());
  EXPECT_EQ(profile.noise().at("correlation"), "independent");
  EXPECT_FALSE(profile.disparity.has_value());  // all of its errors are 0
}

// The next frame as reference measures the noise of both frames, whether it is independent between pixels
// or smooth.
TEST(NoiseProfile, NextFrameMeasuresTheLevelOfAnyCorrelation) {
  constexpr double delta_d_px = 0.2;
  const Json smooth = {{"model", "spatial"}, {"lengths_px", {5}}, {"shares", {1.0}}};
  for (const Json& correlation : {Json("independent"), smooth}) {
    const Json noise = {{"flow", {{"epe_px", 0.1}}},
                        {"depth", {{"delta_d_px", delta_d_px}, {"baseline_m", 0}}},
                        {"correlation", correlation}};
    const NoiseProfile profile = fit_noise_profile(
        *scene(), "scene",
        {.name = "next", .noise = Noise(noise), .seed = 1, .depth = DepthReference::next_frame, .jobs = 2});
    ASSERT_TRUE(profile.disparity);
    EXPECT_EQ(profile.disparity->reference, "next_frame");
    EXPECT_NEAR(profile.disparity->errors.sigma_px[0] / delta_d_px, 1, 0.06) << correlation;
  }
}

TEST(NoiseProfile, WarnsOfTailsThatOverlapTheCore) {
  const auto warnings = [&](const Json& outliers, const char* correlation) {
    const Json noise = {{"flow", {{"epe_px", 0.8}}}, {"outliers", outliers}, {"correlation", correlation}};
    return fit_noise_profile(*scene(), "scene",
                             {.name = "tails", .noise = Noise(noise), .seed = 1, .jobs = 2})
        .warnings();
  };
  EXPECT_THAT(warnings({{"share", 0.3}, {"radius_px", 50}}, "independent"), testing::IsEmpty());
  EXPECT_THAT(warnings({{"share", 0.3}, {"radius_px", 8}}, "independent"),
              testing::ElementsAre(HasSubstr("flow: sigma is 2.")));
  EXPECT_THAT(warnings({{"share", 0}}, "shared_per_frame"),
              testing::Contains(HasSubstr("of the errors are tails")));
}

TEST(NoiseProfile, NothingToMeasure) {
  expect_error([&] { fit_noise_profile(*scene(), "scene", {.name = "none"}); }, "give --noise");
}

// Errors of SGBM at the same point of a surface in both frames of a pair, against the true disparities.
// Their covariance between the frames is the variance of the part that persists; joint_flow_depth assumes
// that it is twice the rest of the variance (persistent_ratio, estimator/flow_depth/error_model.h).
class PersistentErrors : public testing::TestWithParam<const char*> {
 protected:
  static double median(std::vector<double> values) { return upper_median(values); }
};

TEST_P(PersistentErrors, HaveOneToThreeTimesTheVarianceOfTheOthers) {
  SEXTANT_NEEDS_DATA("kitti_sceneflow_2015");
  constexpr int first = 10;
  constexpr double largest_px = 1.5;
  const auto pair = open_with("sceneflow:" + real_data("kitti_sceneflow_2015").string() + "#" + GetParam());
  const double bf = pair->info().camera.bf;
  const Image<Flow> flow = pair->true_flow(first).value();
  const auto errors = [&](int frame) {
    Image<float> error = pair->read(frame, {.depth = true}).depth_m;
    const Image<float> truth = pair->true_depth(frame).value();
    for (const auto [x, y] : pixels(error))
      error(x, y) = static_cast<float>(bf / error(x, y) - bf / truth(x, y));
    return error;
  };
  const Image<float> now = errors(first), next = errors(first + 1), depth_m = pair->true_depth(first).value();
  for (const auto& [nearest_px, farthest_px] : {std::pair{20.0, INFINITY}, {10.0, 20.0}, {0.0, 10.0}}) {
    std::vector<double> a, b;
    for (const auto [x, y] : pixels(flow)) {
      const double disparity = bf / depth_m(x, y);
      if (!flow(x, y).valid() || !(disparity > nearest_px && disparity <= farthest_px)) continue;
      const auto column = std::lround(x + flow(x, y).u), row = std::lround(y + flow(x, y).v);
      if (!next.contains(static_cast<int>(column), static_cast<int>(row))) continue;
      const double there = next(static_cast<int>(column), static_cast<int>(row));
      if (!(std::abs(now(x, y)) < 3 && std::abs(there) < 3)) continue;
      a.push_back(now(x, y));
      b.push_back(there);
    }
    const double middle_a = median(a), middle_b = median(b);
    double n = 0, variance = 0, covariance = 0;
    for (size_t i = 0; i < a.size(); ++i) {
      const double e = a[i] - middle_a, f = b[i] - middle_b;
      if (!(std::abs(e) < largest_px && std::abs(f) < largest_px)) continue;
      n += 1;
      variance += 0.5 * (e * e + f * f);
      covariance += e * f;
    }
    const double ratio = covariance / (variance - covariance);
    fmt::print("{}, disparity above {} px: {:.0f} points, {:.3f} px, ratio {:.2f}\n", GetParam(), nearest_px,
               n, std::sqrt(variance / n), ratio);
    EXPECT_GT(ratio, 0.9);
    EXPECT_LT(ratio, 3);
  }
}
INSTANTIATE_TEST_SUITE_P(SceneFlow, PersistentErrors, testing::Values("000002", "000007"));

TEST(FitCorrelation, FindsAMixture) {
  const SpatialCorrelation truth{{{4, 0.3}, {32, 0.5}}};
  std::vector<CorrelationBin> bins;
  for (const double r : {1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0, 80.0, 120.0, 200.0})
    bins.push_back({r, r, r, 1000, {truth.at(r)}, {}});
  const SpatialCorrelation fit = fit_correlation(bins);
  for (const CorrelationBin& bin : bins)
    EXPECT_NEAR(fit.at(bin.distance_px), truth.at(bin.distance_px), 0.01);
}

TEST(BorderDistance, IsThatOfTheChessboard) {
  Image<uint16_t> mask(100, 20);
  for (const auto [x, y] : PixelRange(10, 20)) mask(x, y) = 3;
  const Image<float> distance = border_distance(mask);
  EXPECT_EQ(distance(9, 5), 1);
  EXPECT_EQ(distance(10, 5), 1);
  EXPECT_EQ(distance(0, 5), 10);
  EXPECT_EQ(distance(30, 5), 21);
  EXPECT_TRUE(std::isnan(distance(99, 5)));
}

}  // namespace
}  // namespace sextant
