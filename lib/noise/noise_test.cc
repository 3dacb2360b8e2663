// Tests of combinations of models on points and on dense frames.

#include "sextant/noise/noise.h"
#include "sextant/base/testing.h"

#include <cmath>
#include <random>

#include "sextant/base/machine.h"
#include "sextant/measurement/frame.h"

namespace sextant {
namespace {

constexpr int width = 320;
constexpr int height = 120;
const StereoCamera camera{{700, 700, 160, 60}, 350};
const Draws draws_of_test(4, "synthetic", "test");
const char* const everything = R"({"depth": {"delta_d_px": 0.8}, "quantisation": {"step_px": 0.0625},
    "flow": {"epe_x_px": 0.3, "epe_y_px": 0.2, "bodies": {"object:1": {"epe_px": 1}}},
    "outliers": {"share": 0.1, "radius_px": 20}})";

Noise noise(const char* json) { return Noise(Json::parse(json)); }

/// A frame with some invalid depths and flows and two instances.
Frame make_frame(int index) {
  Frame frame;
  frame.index = index;
  frame.depth_m = Image<float>(width, height);
  frame.flow = Image<Flow>(width, height);
  frame.mask = Image<uint16_t>(width, height);
  std::mt19937 random(static_cast<unsigned>(index));
  for (const auto [x, y] : PixelRange(width, height)) {
    frame.depth_m(x, y) = random() % 20 == 0 ? NAN : 5.0F + static_cast<float>(random() % 60000) / 1000.0F;
    frame.flow(x, y) = {static_cast<float>(random() % 1600) / 100.0F - 8,
                        static_cast<float>(random() % 800) / 100.0F - 4};
    if (random() % 30 == 0) frame.flow(x, y) = {};
    if (y > 40 && y < 80 && x > 100 && x < 200) frame.mask(x, y) = x < 160 ? 1 : 2;
  }
  return frame;
}

/// Points at every `step`-th pixel, as extraction creates them.
FramePair make_pair(const Frame& prev, const Frame& curr, int step) {
  FramePair pair;
  pair.prev = prev.index;
  pair.curr = curr.index;
  pair.dt_s = 0.1;
  pair.width = width;
  pair.height = height;
  pair.camera = camera;
  pair.objects.resize(1);
  pair.objects[0].instance = 1;
  for (int y = 0; y < height; y += step) {
    for (int x = 0; x < width; x += step) {
      const Flow flow = prev.flow(x, y);
      const TargetPixel target = target_pixel(x, y, flow, width, height);
      if (!target.inside || std::isnan(prev.depth_m(x, y))) continue;
      const uint16_t body = prev.mask(x, y);
      Correspondences& points = body == 0 ? pair.background : pair.objects[0].points;
      points.push_back(x, y, prev.depth_m(x, y), flow.u, flow.v, curr.depth_m(target.x, target.y));
      if (body != 0) pair.objects[0].instance_prev.push_back(body);
    }
  }
  return pair;
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void expect_equal(const Correspondences& a, const Correspondences& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    ASSERT_TRUE(a.u[i] == b.u[i] && a.v[i] == b.v[i] && a.depth[i] == b.depth[i] &&
                a.flow_u[i] == b.flow_u[i] && a.flow_v[i] == b.flow_v[i] &&
                same(a.depth_curr[i], b.depth_curr[i]))
        << i;
  }
}

TEST(Noise, PointsAndDenseFramesAgreeBitForBit) {
  const Frame prev = make_frame(7), curr = make_frame(8);
  for (const char* correlation : {R"("independent")", R"("shared_per_frame")",
                                  R"({"model": "spatial", "lengths_px": [3, 20], "shares": [0.3, 0.6]})"}) {
    Json options = Json::parse(everything);
    options["correlation"] = Json::parse(correlation);
    const Noise noise(options);
    const FramePair clean = make_pair(prev, curr, 2);
    const NoisyPair points = noise.apply(clean, draws_of_test);
    const NoisyFrame dense_prev = noise.apply(prev, camera, draws_of_test);
    const NoisyFrame dense_curr = noise.apply(curr, camera, draws_of_test);
    const auto check = [&](const Correspondences& noisy) {
      ASSERT_GT(noisy.size(), 300U);
      for (size_t i = 0; i < noisy.size(); ++i) {
        const int x = static_cast<int>(noisy.u[i]), y = static_cast<int>(noisy.v[i]);
        ASSERT_EQ(noisy.depth[i], dense_prev.frame.depth_m(x, y));
        ASSERT_EQ(noisy.flow_u[i], dense_prev.frame.flow(x, y).u);
        ASSERT_EQ(noisy.flow_v[i], dense_prev.frame.flow(x, y).v);
        const TargetPixel target = target_pixel(x, y, prev.flow(x, y), width, height);
        const bool outlier =
            std::hypot(noisy.flow_u[i] - prev.flow(x, y).u, noisy.flow_v[i] - prev.flow(x, y).v) > 6;
        if (outlier) {
          ASSERT_TRUE(std::isnan(noisy.depth_curr[i]));
        }
        if (!std::isnan(noisy.depth_curr[i])) {
          ASSERT_EQ(noisy.depth_curr[i], dense_curr.frame.depth_m(target.x, target.y));
        }
      }
    };
    check(points.pair.background);
    check(points.pair.objects[0].points);
    ASSERT_EQ(points.pair.objects[0].points.size(), points.pair.objects[0].instance_prev.size());
  }
}

TEST(Noise, FlowOfPointsAndFramesHasTheLevelsOfTheCorruptedMasks) {
  const Noise noise(Json::parse(R"({"mask": {"dilate_px": 5},
      "flow": {"epe_px": 0.1, "bodies": {"object:1": {"epe_px": 3}}}})"));
  Frame prev = make_frame(7), curr = make_frame(8);
  const NoisyFrame dense = noise.apply(prev, camera, draws_of_test);
  for (Frame* frame : {&prev, &curr}) noise.corrupt_mask(frame->mask);
  const NoisyPair points = noise.without_masks().apply(make_pair(prev, curr, 1), draws_of_test);
  const Correspondences& noisy = points.pair.objects[0].points;
  ASSERT_GT(noisy.size(), 4000U);
  for (size_t i = 0; i < noisy.size(); ++i) {
    const int x = static_cast<int>(noisy.u[i]), y = static_cast<int>(noisy.v[i]);
    ASSERT_EQ(noisy.flow_u[i], dense.frame.flow(x, y).u) << x << " " << y;
    ASSERT_EQ(noisy.flow_v[i], dense.frame.flow(x, y).v) << x << " " << y;
  }
}

TEST(Noise, APointDoesNotDependOnOtherPoints) {
  const Frame prev = make_frame(7), curr = make_frame(8);
  const Noise some = noise(everything);
  const Correspondences many = some.apply(make_pair(prev, curr, 1), draws_of_test).pair.background;
  const Correspondences few = some.apply(make_pair(prev, curr, 4), draws_of_test).pair.background;
  std::map<std::pair<double, double>, size_t> at;
  for (size_t i = 0; i < many.size(); ++i) at[{many.u[i], many.v[i]}] = i;
  for (size_t i = 0; i < few.size(); ++i) {
    const size_t j = at.at({few.u[i], few.v[i]});
    ASSERT_TRUE(few.depth[i] == many.depth[j] && few.flow_u[i] == many.flow_u[j] &&
                few.flow_v[i] == many.flow_v[j] && same(few.depth_curr[i], many.depth_curr[j]));
  }
}

TEST(Noise, ThreadsAndMergingInOrderGiveTheSameBits) {
  const Noise some = noise(everything);
  std::string first;
  for (const int jobs : {1, 2, 5}) {
    std::vector<NoisyPair> results(8);
    parallel_for(8, jobs, [&](int i) {
      results[i] = some.apply(make_pair(make_frame(i), make_frame(i + 1), 3), draws_of_test);
    });
    NoiseVerification total;
    for (const NoisyPair& result : results) {
      const Json sums = parse_json(json_line(result.achieved.sums()), "sums");  // as stored in files
      total.merge(NoiseVerification::from_sums(sums, "sums"));
    }
    const std::string text = total.json(some.options()).dump();
    NoiseVerification in_memory;
    for (const NoisyPair& result : results) in_memory.merge(result.achieved);
    EXPECT_EQ(in_memory.json(some.options()).dump(), text);
    if (first.empty()) first = text;
    EXPECT_EQ(text, first);
    expect_equal(results[3].pair.background,
                 some.apply(make_pair(make_frame(3), make_frame(4), 3), draws_of_test).pair.background);
  }
}

TEST(Noise, NoneChangesNothing) {
  const Frame prev = make_frame(1), curr = make_frame(2);
  const FramePair pair = make_pair(prev, curr, 2);
  for (const char* json : {"{}", R"({"depth": {"delta_d_px": 0}, "flow": {}, "mask": {}})"}) {
    EXPECT_TRUE(noise(json).none());
    EXPECT_EQ(noise(json).name(), "none");
    EXPECT_EQ(noise(json).options(), Json::object());
    const NoisyPair same_pair = noise(json).apply(pair, draws_of_test);
    expect_equal(same_pair.pair.background, pair.background);
    expect_equal(same_pair.pair.objects[0].points, pair.objects[0].points);
    EXPECT_EQ(same_pair.achieved.json(Json::object()).dump(), R"({"requested":{}})");
    const NoisyFrame same_frame = noise(json).apply(prev, camera, draws_of_test);
    EXPECT_EQ(same_frame.frame.mask, prev.mask);
    for (size_t i = 0; i < prev.flow.size(); ++i) {
      ASSERT_TRUE(same(same_frame.frame.flow.data()[i].u, prev.flow.data()[i].u));
      ASSERT_TRUE(same(same_frame.frame.depth_m.data()[i], prev.depth_m.data()[i]));
    }
  }
}

// A delta_d of 30 px makes about half of the depths beyond 12 m negative: these are dropped and counted.
TEST(Noise, InvalidDepthsAreDroppedAndCountedNeverClamped) {
  const Frame prev = make_frame(1), curr = make_frame(2);
  const FramePair pair = make_pair(prev, curr, 1);
  const Noise strong = noise(R"({"depth": {"delta_d_px": 30}})");
  const NoisyPair noisy = strong.apply(pair, draws_of_test);
  const size_t before = pair.background.size() + pair.objects[0].points.size();
  const size_t after = noisy.pair.background.size() + noisy.pair.objects[0].points.size();
  EXPECT_LT(after, before * 7 / 10);
  double expected_share = 0;  // P(z + sigma n <= 0)
  for (const double z : pair.background.depth) {
    expected_share +=
        0.5 * std::erfc(z / strong.depth_sigma_m(camera, z) / std::sqrt(2.0)) / pair.background.size();
  }
  EXPECT_NEAR(1 - static_cast<double>(noisy.pair.background.size()) / pair.background.size(), expected_share,
              0.01);
  for (const double z : noisy.pair.background.depth) ASSERT_GT(z, 0);
  const Correspondences& kept = noisy.pair.background;
  ASSERT_EQ(kept.before_noise.size(), kept.size());
  for (size_t i = 0; i < kept.size(); ++i) {
    const size_t k = kept.before_noise[i];
    ASSERT_TRUE(kept.u[i] == pair.background.u[k] && kept.v[i] == pair.background.v[k] &&
                (i == 0 || k > kept.before_noise[i - 1]));
  }
  uint64_t curr_before = 0;
  for (const double z : pair.background.depth_curr) curr_before += !std::isnan(z);
  for (const double z : pair.objects[0].points.depth_curr) curr_before += !std::isnan(z);
  EXPECT_EQ(noisy.achieved.depth.n_valid, before + curr_before);
  const NoisyFrame frame = strong.apply(prev, camera, draws_of_test);
  uint64_t valid = 0, lost = 0;
  for (size_t i = 0; i < prev.depth_m.size(); ++i) {
    const float was = prev.depth_m.data()[i], is = frame.frame.depth_m.data()[i];
    valid += !std::isnan(was);
    lost += !std::isnan(was) && std::isnan(is);
    ASSERT_TRUE(std::isnan(is) || is > 0);
    ASSERT_TRUE(!std::isnan(was) || std::isnan(is));
  }
  EXPECT_EQ(frame.achieved.depth.n_valid, valid);
  EXPECT_EQ(frame.achieved.depth.n_invalidated, lost);
  EXPECT_GT(lost, 1000U);
}

TEST(Noise, VerificationMeasuresTheAddedNoise) {
  const Noise some = noise(R"({"depth": {"delta_d_px": 0.2}, "flow": {"epe_x_px": 1.34, "epe_y_px": 0.27,
      "bodies": {"objects": {"epe_px": 0.5}}}, "outliers": {"share": 0.2}})");
  NoiseVerification total;
  for (int i = 0; i < 10; ++i)
    total.merge(some.apply(make_pair(make_frame(i), make_frame(i + 1), 1), draws_of_test).achieved);
  const double n = static_cast<double>(total.flow.at(0).x.n);
  EXPECT_GT(n, 2e5);
  EXPECT_NEAR(*total.depth.normalised.sigma(), 1, 4 / std::sqrt(2.0 * total.depth.normalised.n));
  EXPECT_LT(std::abs(*total.depth.normalised.mean()),
            4 / std::sqrt(static_cast<double>(total.depth.normalised.n)));
  EXPECT_NEAR(*total.flow.at(0).x.sigma() / 1.34, 1, 4 / std::sqrt(2 * n));
  EXPECT_NEAR(*total.flow.at(0).y.sigma() / 0.27, 1, 4 / std::sqrt(2 * n));
  EXPECT_NEAR(*total.flow.at(0).epe_px() / expected_epe_px({1.34, 0.27}), 1, 0.01);
  EXPECT_NEAR(*total.flow.at(0).outlier_share(), 0.2, 4 * std::sqrt(0.16 / n));
  for (const int id : {1, 2}) {
    const FlowVerification& object = total.flow.at(id);
    EXPECT_NEAR(*object.x.sigma() / 0.5, 1, 4 / std::sqrt(2.0 * object.x.n));
  }
  EXPECT_LT(std::abs(*total.depth_neighbours.correlation()), 0.01);
  EXPECT_LT(std::abs(*total.flow_neighbours.correlation()), 0.01);
  const Json json = total.json(some.options());
  EXPECT_EQ(json["requested"]["flow"]["epe_x_px"], 1.34);
  EXPECT_EQ(json["flow"]["background"]["x"]["requested_sigma_px"], 1.34);
  EXPECT_TRUE(json["flow"].contains("object:1") && json["flow"].contains("object:2"));
  EXPECT_TRUE(json["neighbours"]["depth"].contains("correlation"));
}

TEST(Noise, SharedDrawsHaveANeighbourCorrelationOfExactlyOne) {
  const Noise shared_noise =
      noise(R"({"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 1}, "correlation": "shared_per_frame"})");
  NoiseVerification total;
  for (int i = 0; i < 3; ++i)
    total.merge(shared_noise.apply(make_pair(make_frame(i), make_frame(i + 1), 3), draws_of_test).achieved);
  EXPECT_EQ(*total.depth_neighbours.correlation(), 1.0);
  EXPECT_EQ(*total.flow_neighbours.correlation(), 1.0);
}

TEST(Noise, MasksAreForFramesNotForPoints) {
  const Noise some = noise(R"({"mask": {"erode_px": 3}, "depth": {"delta_d_px": 0.2}})");
  const Frame prev = make_frame(1), curr = make_frame(2);
  EXPECT_TRUE(some.changes_masks());
  EXPECT_THROW(some.apply(make_pair(prev, curr, 4), draws_of_test), Error);
  EXPECT_NO_THROW(some.without_masks().apply(make_pair(prev, curr, 4), draws_of_test));
  EXPECT_EQ(some.without_masks().name(), "depth 0.2 px");
  EXPECT_TRUE(some.only_masks().changes_masks());
  EXPECT_TRUE(some.only_masks().without_masks().none());
  const NoisyFrame noisy = some.apply(prev, camera, draws_of_test);
  Image<uint16_t> mask = prev.mask;
  some.corrupt_mask(mask);
  EXPECT_EQ(noisy.frame.mask, mask);
  EXPECT_NE(mask, prev.mask);
}

TEST(Noise, LevelsByBodyNeedAMask) {
  Frame frame = make_frame(1);
  frame.mask = {};
  EXPECT_THROW(noise(everything).apply(frame, camera, draws_of_test), Error);
  EXPECT_NO_THROW(noise(R"({"flow": {"epe_px": 1}})").apply(frame, camera, draws_of_test));
}

TEST(Noise, DeclaresItsDeviationsByBodyAndNothingWithoutNoise) {
  const FramePair clean = make_pair(make_frame(7), make_frame(8), 4);
  EXPECT_TRUE(Noise().apply(clean, draws_of_test).pair.noise.empty());

  const FramePair noisy = noise(R"({"depth": {"delta_d_px": 0.2, "baseline_m": 0},
      "flow": {"epe_x_px": 0.3, "epe_y_px": 0.2, "bodies": {"object:1": {"epe_px": 1}}}})")
                              .apply(clean, draws_of_test)
                              .pair;
  const double inverse_depth_per_m = 0.2 / camera.bf;
  EXPECT_EQ(noisy.noise.at(0), (MeasurementNoise{0.3, 0.2, inverse_depth_per_m}));
  EXPECT_EQ(noisy.noise.at(1), (MeasurementNoise{1, 1, inverse_depth_per_m}));
  EXPECT_DOUBLE_EQ(noisy.noise.at(1).depth_sigma_m(20), camera.depth_sigma_m(20, 0.2));
}

TEST(Noise, DeclaresAndVerifiesSpatialCorrelation) {
  const Noise correlated = noise(R"({"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 1},
      "correlation": {"model": "spatial", "lengths_px": [6], "shares": [0.9]}})");
  EXPECT_EQ(correlated.name(), "depth 0.2 px + flow 1 px (spatial 6 px)");
  EXPECT_EQ(Noise(correlated.options()).options(), correlated.options());
  const MeasurementNoise declared = correlated.declared(camera, 0);
  EXPECT_EQ(declared.correlation, (SpatialCorrelation{{{6, 0.9}}}));
  EXPECT_EQ(declared.flow_x_px, 1);
  EXPECT_FALSE(declared.independent_gaussian);
  NoiseVerification total;
  for (int frame = 0; frame < 20; ++frame)
    total.merge(correlated.apply(make_frame(frame), camera, draws_of_test).achieved);
  EXPECT_NEAR(*total.flow_neighbours.correlation(), declared.correlation.at(1), 0.005);
  EXPECT_NEAR(*total.depth_neighbours.correlation(), declared.correlation.at(1), 0.005);
  EXPECT_NEAR(*total.flow.at(0).x.sigma(), 1, 0.02);
  EXPECT_NEAR(*total.depth.normalised.sigma(), 1, 0.02);
}

TEST(Noise, DeclaresNonGaussianNoise) {
  const auto declared = [](const char* json) { return noise(json).declared(camera, 0); };
  EXPECT_TRUE(declared(R"({"flow": {"epe_px": 1}})").independent_gaussian);
  EXPECT_FALSE(
      declared(R"({"flow": {"epe_px": 1}, "correlation": "shared_per_frame"})").independent_gaussian);
  const MeasurementNoise wrong = declared(R"({"flow": {"epe_px": 1}, "outliers": {"share": 0.1}})");
  EXPECT_DOUBLE_EQ(wrong.flow_outlier_share, 0.1);
  EXPECT_EQ(wrong.flow_x_px, 1);
  EXPECT_FALSE(wrong.independent_gaussian);
  const MeasurementNoise rounded = declared(R"({"quantisation": {"step_px": 0.5}})");
  EXPECT_NEAR(rounded.inverse_depth_per_m, 0.5 / std::sqrt(12.0) / camera.bf, 1e-15);
  EXPECT_FALSE(rounded.independent_gaussian);
  EXPECT_FALSE(rounded.gaussian);
  const std::string spatial = R"("correlation": {"model": "spatial", "lengths_px": [6], "shares": [0.9]})";
  EXPECT_TRUE(declared((R"({"flow": {"epe_px": 1}, )" + spatial + "}").c_str()).gaussian);
  EXPECT_FALSE(declared((R"({"quantisation": {"step_px": 0.5}, )" + spatial + "}").c_str()).gaussian);
}

TEST(Noise, HasACanonicalNameAndOptions) {
  EXPECT_EQ(noise(R"({"flow": {"epe_x_px": 0.3, "epe_y_px": 0.2}, "depth": {"delta_d_px": 0.2}})").name(),
            "depth 0.2 px + flow 0.3/0.2 px");
  EXPECT_EQ(
      noise(everything).name(),
      "depth 0.8 px + disparity step 0.0625 px + flow 0.3/0.2 px, object:1 1 px + outliers 10 % in disc 20 "
      "px");
  EXPECT_EQ(
      noise(R"({"mask": {"erode_px": 2}, "flow": {"epe_px": 1, "scale": 0.5, "reading": "epe_is_mean_error"},
      "correlation": "shared_per_frame"})")
          .name(),
      "flow 1 px, x 0.5, mean error + mask eroded 2 px (shared per frame)");
  const Noise a = noise(R"({"flow": {"epe_px": 1}, "depth": {"delta_d_px": 0.2}, "mask": {}})");
  const Noise b = noise(
      R"({"correlation": "independent", "depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 1, "scale": 1}})");
  EXPECT_EQ(a.options().dump(), b.options().dump());
  EXPECT_EQ(Noise(a.options()).options(), a.options());
}

TEST(Noise, RefusesUnknownModelsAndBadText) {
  const auto message = [](const char* text) { return error_of([&] { Noise::parse(text); }); };
  EXPECT_EQ(message("none"), "no error");
  EXPECT_EQ(message(""), "no error");
  EXPECT_EQ(message("{}"), "no error");
  EXPECT_THAT(message(R"({"dept": {}})"), HasSubstr("did you mean 'depth'"));
  EXPECT_THAT(message(R"({"correlation": "shared"})"), HasSubstr("shared_per_frame"));
  EXPECT_THAT(message(R"({"correlation": 1})"), HasSubstr("noise.correlation"));
  EXPECT_THAT(message("[1]"), HasSubstr("expected an object"));
  EXPECT_THAT(message(R"({"depth": )"), HasSubstr("noise:1: not valid JSON"));
  EXPECT_THAT(message(R"({"depth": {"delta_d_px": "a"}})"), HasSubstr("noise.depth.delta_d_px"));
}

TEST(Noise, DescribesEveryOption) {
  const std::vector<OptionHelp> lines = describe_noise_options();
  EXPECT_EQ(lines.front().key, "noise.depth.delta_d_px");
  EXPECT_EQ(lines.back().key, "noise.scale");
}

}  // namespace
}  // namespace sextant
