// Tests of each model against its declared moments over 10^6 draws, and against small cases worked by hand.

#include <cmath>
#include <numbers>

#include "sextant/base/names.h"
#include "sextant/base/testing.h"
#include "sextant/noise/models.h"
#include "sextant/noise/verification.h"

namespace sextant {
namespace {

const StereoCamera vkitti{{725, 725, 620.5, 187}, 0};
const Draws draws_of_s18(1, "synthetic", "s18");

struct Pixels {
  std::vector<int> x, y;
  explicit Pixels(int n = 1000000) {
    for (int i = 0; i < n; ++i) {
      x.push_back(i % 1000);
      y.push_back(i / 1000);
    }
  }
  PixelBatch batch(int frame = 3) const { return {frame, x, y}; }
};

std::unique_ptr<NoiseModel> make(const char* name, const char* json) {
  return find_entry(noise_models(), name, "noise model").make(Json::parse(json));
}

std::string error_of_model(const char* name, const char* json) {
  return sextant::error_of([&] { make(name, json); });
}

MomentSums depth_deviations(const NoiseModel& model, double z_m, Correlation correlation) {
  static const Pixels pixels;
  std::vector<double> depth(pixels.x.size(), z_m);
  model.corrupt_depth({draws_of_s18, correlation, vkitti}, pixels.batch(), depth);
  MomentSums sums;
  for (const double z : depth) sums.add(z - z_m);
  return sums;
}

// As in docs/noise.md: f = 725, b = 0.5, delta_d = 0.2.
TEST(DepthNoise, HasTheStereoModelsSigmaOverAMillionDraws) {
  const auto model = make("depth", R"({"delta_d_px": 0.2})");
  for (const auto& [z_m, sigma_m] :
       {std::pair(10.0, 0.0552), std::pair(20.0, 0.2207), std::pair(40.0, 0.8828)}) {
    EXPECT_NEAR(model->depth_sigma_m(vkitti, z_m), sigma_m, 5e-5);
    const MomentSums sums = depth_deviations(*model, z_m, Correlation::independent);
    EXPECT_LT(std::abs(*sums.mean()), 4 * sigma_m / std::sqrt(1e6));
    EXPECT_NEAR(*sums.sigma() / model->depth_sigma_m(vkitti, z_m), 1, 0.005);
  }
}

TEST(DepthNoise, SharedGivesEveryPixelTheSameDraw) {
  const auto model = make("depth", R"({"delta_d_px": 0.2})");
  const MomentSums sums = depth_deviations(*model, 20, Correlation::shared_per_frame);
  EXPECT_NEAR(*sums.mean(),
              0.2207 * draws_of_s18.normals(NoiseChannel::depth, 3, 0, 0, Correlation::shared_per_frame)[0],
              1e-4);
  EXPECT_NEAR(*sums.sigma(), 0, 1e-6);
}

TEST(DepthNoise, UsesTheSourcesBaselineWhenAsked) {
  const StereoCamera camera{{700, 700, 0, 0}, 350};
  EXPECT_DOUBLE_EQ(make("depth", R"({"delta_d_px": 0.1, "baseline_m": 0})")->depth_sigma_m(camera, 10),
                   100.0 / 350 * 0.1);
  EXPECT_DOUBLE_EQ(make("depth", R"({"delta_d_px": 0.1, "baseline_m": 0.54})")->depth_sigma_m(camera, 10),
                   100.0 / (700 * 0.54) * 0.1);
  EXPECT_THROW(make("depth", R"({"delta_d_px": 0.1, "baseline_m": 0})")->depth_sigma_m(vkitti, 10), Error);
}

TEST(Quantisation, RoundsDisparityToTheStep) {
  const StereoCamera camera{{700, 700, 0, 0}, 350};
  const auto model = make("quantisation", R"({"step_px": 0.25})");
  std::vector<double> depth = {10, 350 / 0.3, 350 / 0.12, 5000, 14};
  const Pixels pixels(5);
  model->corrupt_depth({draws_of_s18, Correlation::independent, camera}, pixels.batch(), depth);
  EXPECT_DOUBLE_EQ(depth[0], 10);          // disparity 35
  EXPECT_DOUBLE_EQ(depth[1], 350 / 0.25);  // 0.3 -> 0.25
  EXPECT_TRUE(std::isnan(depth[2]));       // 0.12 -> 0: invalid
  EXPECT_TRUE(std::isnan(depth[3]));
  EXPECT_DOUBLE_EQ(depth[4], 14);  // disparity 25
}

TEST(Quantisation, ErrorsAreUniformOverAStep) {
  const StereoCamera camera{{700, 700, 0, 0}, 350};
  const auto model = make("quantisation", R"({"step_px": 0.0625})");
  const Pixels pixels;
  std::vector<double> depth;
  for (size_t i = 0; i < pixels.x.size(); ++i) depth.push_back(5 + 30 * (static_cast<double>(i) + 0.5) / 1e6);
  const std::vector<double> clean = depth;
  model->corrupt_depth({draws_of_s18, Correlation::independent, camera}, pixels.batch(), depth);
  MomentSums sums;
  for (size_t i = 0; i < depth.size(); ++i) sums.add(350 / depth[i] - 350 / clean[i]);
  EXPECT_NEAR(*sums.mean(), 0, 4e-4);
  EXPECT_NEAR(*sums.sigma(), 0.0625 / std::sqrt(12), 0.005 * 0.0625);
}

struct FlowSums {
  MomentSums x, y, epe;
  uint64_t n_outliers = 0;
};

FlowSums flow_deviations(const NoiseModel& model, int body, bool backward = false) {
  static const Pixels pixels;
  const size_t n = pixels.x.size();
  std::vector<double> u(n, 12.5), v(n, -3.25);
  std::vector<int> bodies(n, body);
  std::vector<unsigned char> outlier(n, 0);
  model.corrupt_flow({draws_of_s18, Correlation::independent, vkitti}, pixels.batch(),
                     {backward, bodies, u, v, outlier});
  FlowSums sums;
  for (size_t i = 0; i < n; ++i) {
    sums.x.add(u[i] - 12.5);
    sums.y.add(v[i] + 3.25);
    sums.epe.add(std::hypot(u[i] - 12.5, v[i] + 3.25));
    sums.n_outliers += outlier[i];
  }
  return sums;
}

void expect_sigma(const MomentSums& sums, double sigma) {
  EXPECT_LT(std::abs(*sums.mean()), 4 * sigma / std::sqrt(1e6));
  EXPECT_NEAR(*sums.sigma() / sigma, 1, 0.005);
}

TEST(FlowNoise, EpeIsSigmaPerAxis) {
  const auto model = make("flow", R"({"epe_x_px": 1.34, "epe_y_px": 0.27})");
  const FlowSums sums = flow_deviations(*model, 0);
  expect_sigma(sums.x, 1.34);
  expect_sigma(sums.y, 0.27);
  EXPECT_NEAR(*sums.epe.mean() / expected_epe_px({1.34, 0.27}), 1, 0.005);
}

TEST(FlowNoise, EpeIsMeanErrorPerAxis) {
  const auto model = make("flow", R"({"epe_x_px": 1.34, "epe_y_px": 0.27, "reading": "epe_is_mean_error"})");
  const FlowSums sums = flow_deviations(*model, 0);
  EXPECT_NEAR(*sums.x.mean_abs() / 1.34, 1, 0.005);
  EXPECT_NEAR(*sums.y.mean_abs() / 0.27, 1, 0.005);
  expect_sigma(sums.x, 1.34 * std::sqrt(std::numbers::pi / 2));
}

TEST(FlowNoise, EpeIsMeanErrorInTwoDimensions) {
  const auto model = make("flow", R"({"epe_px": 0.5, "reading": "epe_is_mean_error"})");
  const FlowSums sums = flow_deviations(*model, 0);
  EXPECT_NEAR(*sums.epe.mean() / 0.5, 1, 0.005);
  expect_sigma(sums.x, 0.5 / std::sqrt(std::numbers::pi / 2));
  expect_sigma(sums.y, 0.5 / std::sqrt(std::numbers::pi / 2));
}

TEST(FlowNoise, BodiesHaveTheirOwnLevelsAndScaleMultipliesAll) {
  const auto model = make("flow", R"({"epe_px": 1, "scale": 2, "bodies": {
      "background": {"epe_x_px": 1.34, "epe_y_px": 0.27}, "objects": {"epe_px": 0.3},
      "object:7": {"epe_px": 0}}})");
  EXPECT_DOUBLE_EQ(model->flow_sigma(0).x_px, 2.68);
  EXPECT_DOUBLE_EQ(model->flow_sigma(0).y_px, 0.54);
  EXPECT_DOUBLE_EQ(model->flow_sigma(3).x_px, 0.6);
  EXPECT_DOUBLE_EQ(model->flow_sigma(7).x_px, 0);
  EXPECT_TRUE(model->needs_bodies());
  expect_sigma(flow_deviations(*model, 3).y, 0.6);
  EXPECT_EQ(*flow_deviations(*model, 7).x.sigma(), 0);
  EXPECT_FALSE(make("flow", R"({"epe_px": 1, "scale": 0})")->changes_flow());
}

TEST(FlowNoise, BackwardFlowHasItsOwnDraws) {
  const auto model = make("flow", R"({"epe_px": 1})");
  const Pixels pixels(1);
  std::vector<double> u = {0}, v = {0}, back_u = {0}, back_v = {0};
  const std::vector<int> body = {0};
  std::vector<unsigned char> outlier = {0};
  const NoiseContext context{draws_of_s18, Correlation::independent, vkitti};
  model->corrupt_flow(context, pixels.batch(), {false, body, u, v, outlier});
  model->corrupt_flow(context, pixels.batch(), {true, body, back_u, back_v, outlier});
  EXPECT_NE(u, back_u);
  expect_sigma(flow_deviations(*model, 0, true).x, 1);
}

TEST(ExpectedEpe, AgreesWithTheRayleighMeanAndTheOneDimensionalLimit) {
  EXPECT_NEAR(expected_epe_px({2, 2}), 2 * std::sqrt(std::numbers::pi / 2), 1e-12);
  EXPECT_NEAR(expected_epe_px({0, 3}), 3 * std::sqrt(2 / std::numbers::pi), 1e-12);
  EXPECT_EQ(expected_epe_px({0, 0}), 0);
}

TEST(FlowOutliers, HaveTheShareAndFillTheDisc) {
  const auto model = make("outliers", R"({"share": 0.3, "radius_px": 50})");
  const FlowSums sums = flow_deviations(*model, 0);
  EXPECT_NEAR(static_cast<double>(sums.n_outliers), 3e5, 4 * std::sqrt(1e6 * 0.3 * 0.7));
  // Uniform over a disc of radius R: E r = 2R/3, E x = 0, E x^2 = R^2/4; all multiplied by the share.
  EXPECT_NEAR(*sums.epe.mean(), 0.3 * 100 / 3, 0.005 * 10);
  EXPECT_NEAR(sums.x.sum_squares / 1e6, 0.3 * 2500 / 4, 0.01 * 187.5);
  EXPECT_NEAR(sums.y.sum_squares / 1e6, 0.3 * 2500 / 4, 0.01 * 187.5);
  EXPECT_LT(std::abs(*sums.x.mean()), 4 * std::sqrt(187.5 / 1e6));
}

TEST(FlowOutliers, FillTheBox) {
  const auto model = make("outliers", R"({"share": 1, "radius_px": 30, "shape": "box"})");
  const FlowSums sums = flow_deviations(*model, 0);
  EXPECT_EQ(sums.n_outliers, 1000000U);
  EXPECT_NEAR(*sums.x.sigma(), 30 / std::sqrt(3), 0.005 * 30);
  EXPECT_NEAR(*sums.y.mean_abs(), 15, 0.005 * 15);
}

Image<uint16_t> mask_of(const std::vector<std::string>& rows) {
  Image<uint16_t> mask(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()));
  for (const auto [x, y] : pixels(mask))
    mask(x, y) = static_cast<uint16_t>(rows[y][x] == '.' ? 0 : rows[y][x] - '0');
  return mask;
}

std::vector<std::string> rows_of(const Image<uint16_t>& mask) {
  std::vector<std::string> rows;
  for (int y = 0; y < mask.height(); ++y) {
    rows.emplace_back();
    for (int x = 0; x < mask.width(); ++x)
      rows.back() += mask(x, y) == 0 ? '.' : static_cast<char>('0' + mask(x, y));
  }
  return rows;
}

std::vector<std::string> corrupted(const char* json, const std::vector<std::string>& rows) {
  Image<uint16_t> mask = mask_of(rows);
  make("mask", json)->corrupt_mask(mask);
  return rows_of(mask);
}

TEST(MaskNoise, ErosionTakesTheRimButNotAtTheImagesBorder) {
  const std::vector<std::string> mask = {"11112222", "11112222", "11112222", "........"};
  EXPECT_THAT(corrupted(R"({"erode_px": 1})", mask),
              ElementsAre("111..222", "111..222", "........", "........"));
  EXPECT_THAT(corrupted(R"({"erode_px": 2})", mask),
              ElementsAre("11....22", "........", "........", "........"));
}

TEST(MaskNoise, DilationReachesNStepsOfItsNeighbourhood) {
  const std::vector<std::string> mask = {".....", ".....", "..1..", ".....", "....."};
  EXPECT_THAT(corrupted(R"({"dilate_px": 1})", mask),
              ElementsAre(".....", "..1..", ".111.", "..1..", "....."));
  EXPECT_THAT(corrupted(R"({"dilate_px": 1, "neighbours": 8})", mask),
              ElementsAre(".....", ".111.", ".111.", ".111.", "....."));
  EXPECT_THAT(corrupted(R"({"dilate_px": 2})", mask),
              ElementsAre("..1..", ".111.", "11111", ".111.", "..1.."));
}

TEST(MaskNoise, TheSmallerIdWinsAndNoInstanceIsOverwritten) {
  EXPECT_THAT(corrupted(R"({"dilate_px": 1})", {"2.1.3"}), ElementsAre("21113"));
  EXPECT_THAT(corrupted(R"({"dilate_px": 100000})", {"2....1.."}), ElementsAre("22211111"));
}

TEST(MaskNoise, OpeningRemovesSpecks) {
  EXPECT_THAT(corrupted(R"({"erode_px": 1, "dilate_px": 1, "neighbours": 8})",
                        {"......1", ".111...", ".111...", ".111...", "......."}),
              ElementsAre(".......", ".111...", ".111...", ".111...", "......."));
}

TEST(NoiseOptions, RefuseNonsenseNamingTheOption) {
  EXPECT_THAT(error_of_model("depth", R"({"delta_d_px": -0.1})"), HasSubstr("depth.delta_d_px = -0.1"));
  EXPECT_THAT(error_of_model("depth", R"({"delta_d_m": 0.1})"), HasSubstr("did you mean 'delta_d_px'"));
  EXPECT_THAT(error_of_model("depth", R"({"baseline_m": -1})"), HasSubstr("baseline_m"));
  EXPECT_THAT(error_of_model("quantisation", R"({"step_px": -1})"), HasSubstr("step_px"));
  EXPECT_THAT(error_of_model("flow", R"({"epe_px": 1, "epe_x_px": 1})"),
              HasSubstr("0 if epe_x_px or epe_y_px"));
  EXPECT_THAT(error_of_model("flow", R"({"epe_x_px": -1})"), HasSubstr("flow.epe_x_px"));
  EXPECT_THAT(error_of_model("flow", R"({"reading": "sigma"})"), HasSubstr("epe_is_mean_error"));
  EXPECT_THAT(error_of_model("flow", R"({"scale": -1})"), HasSubstr("flow.scale"));
  EXPECT_THAT(error_of_model("flow", R"({"bodies": {"object:0": {}}})"), HasSubstr("object:0"));
  EXPECT_THAT(error_of_model("flow", R"({"bodies": {"object:x": {}}})"), HasSubstr("object:x"));
  EXPECT_THAT(error_of_model("flow", R"({"bodies": {"object:": {}}})"), HasSubstr("object:ID"));
  EXPECT_THAT(error_of_model("flow", R"({"bodies": {"object:1": {"epe": 1}}})"),
              HasSubstr("noise.flow.bodies.object:1.epe"));
  EXPECT_THAT(error_of_model("outliers", R"({"share": 1.5})"), HasSubstr("in 0..1"));
  EXPECT_THAT(error_of_model("outliers", R"({"radius_px": 0})"), HasSubstr("radius_px"));
  EXPECT_THAT(error_of_model("outliers", R"({"shape": "ball"})"), HasSubstr("known: disc, box"));
  EXPECT_THAT(error_of_model("mask", R"({"erode_px": -1})"), HasSubstr("erode_px"));
  EXPECT_THAT(error_of_model("mask", R"({"neighbours": 6})"), HasSubstr("4 or 8"));
}

}  // namespace
}  // namespace sextant
