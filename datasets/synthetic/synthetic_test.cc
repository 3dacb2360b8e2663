#include <cmath>
#include <cstring>
#include <map>
#include <opencv2/features2d.hpp>
#include <thread>

#include "sextant/base/quantile.h"
#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/datasets/testing.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/estimator/registry.h"

namespace sextant {
namespace {

constexpr Channels all_channels = Channels::all();

/// Compares stored values; NaN equals NaN.
template <typename T>
bool same_bytes(const Image<T>& a, const Image<T>& b) {
  return a.width() == b.width() && a.height() == b.height() &&
         std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

bool same_bytes(const Frame& a, const Frame& b) {
  return a.index == b.index && same_bytes(a.gray, b.gray) && same_bytes(a.rgb, b.rgb) &&
         same_bytes(a.rgb_right, b.rgb_right) && same_bytes(a.depth_m, b.depth_m) &&
         same_bytes(a.flow, b.flow) && same_bytes(a.backward_flow, b.backward_flow) &&
         same_bytes(a.mask, b.mask);
}

std::map<int, double> area_shares(const Image<uint16_t>& mask) {
  std::map<int, double> shares;
  for (size_t i = 0; i < mask.size(); ++i) shares[mask.data()[i]] += 1.0 / static_cast<double>(mask.size());
  return shares;
}

class SyntheticScenario : public testing::TestWithParam<std::string> {
 protected:
  /// Opens a few frames only, because the truth of a long scenario takes long.
  static std::unique_ptr<Sequence> open_frames(int first, int last) {
    return open_uncached(fmt::format("synthetic:{}@{}-{}", GetParam(), first, last));
  }
  /// Returns `n` frames, evenly spaced from the first to the last minus `after_last`.
  std::vector<int> some_frames(int n, int after_last) const {
    const SequenceInfo& info = sequence_->info();
    const int last = info.last_frame - after_last;
    std::vector<int> frames;
    for (int i = 0; i < n; ++i) frames.push_back(info.first_frame + (last - info.first_frame) * i / (n - 1));
    return frames;
  }
  std::unique_ptr<Sequence> sequence_ = open_uncached("synthetic:" + GetParam());
};

TEST_P(SyntheticScenario, DepthAndPosesExplainTheFlow) {
  const SequenceInfo& info = sequence_->info();
  for (const int k : some_frames(5, 1)) {
    const auto sequence = open_frames(k, k + 1);
    const Frame frame = sequence->read(k, {.depth = true, .flow = true, .mask = true});
    int n_static = 0;
    int n_object = 0;
    double worst_px = 0;
    for (int y = 3; y < info.height; y += 5) {
      for (int x = 2; x < info.width; x += 5) {
        const double depth_m = frame.depth_m(x, y);
        if (!frame.flow(x, y).valid()) continue;
        ASSERT_TRUE(std::isfinite(depth_m));
        const int id = frame.mask(x, y);
        const auto motion = id == 0 ? sequence->truth().background_motion(k, k + 1)
                                    : sequence->truth().object_motion(id, k, k + 1);
        if (!motion) continue;  // the object is hidden in the next frame
        const Eigen::Vector2d to =
            info.camera.left.project(*motion * info.camera.left.backproject(x, y, depth_m));
        const Eigen::Vector2d flow(frame.flow(x, y).u, frame.flow(x, y).v);
        // Flow is stored in single precision, and near points move by thousands of pixels.
        const double error_px = (to - Eigen::Vector2d(x, y) - flow).norm() / std::max(1.0, flow.norm() / 500);
        worst_px = std::max(worst_px, error_px);
        ++(id == 0 ? n_static : n_object);
      }
    }
    EXPECT_LT(worst_px, 1e-4) << "frame " << k;
    EXPECT_GT(n_static, GetParam() == "highway" ? 2000 : 10000);
    EXPECT_GT(n_object, 100);
  }
}

TEST_P(SyntheticScenario, HasManyCornersOffTheObjects) {
  const SequenceInfo& info = sequence_->info();
  for (const int k : {info.first_frame, info.last_frame}) {
    const Frame frame = sequence_->read(k, {.gray = true, .depth = true, .mask = true});
    const cv::Mat view(info.height, info.width, CV_8UC1, const_cast<uint8_t*>(frame.gray.data()));
    std::vector<cv::KeyPoint> corners;
    cv::FAST(view, corners, 7, true);
    int n = 0;
    for (const cv::KeyPoint& corner : corners) {
      const int x = static_cast<int>(corner.pt.x), y = static_cast<int>(corner.pt.y);
      n += frame.mask(x, y) == 0 && std::isfinite(frame.depth_m(x, y)) ? 1 : 0;
    }
    EXPECT_GT(n, GetParam() == "highway" ? 300 : 2000) << "frame " << k;
    RecordProperty(fmt::format("corners_{}", k), n);
  }
}

TEST_P(SyntheticScenario, ImagesFollowTheFlow) {
  // Texture is fixed to the surfaces: the gray value at the end of the flow equals that at its start. Shadows
  // of moving cars, occlusions and filters differ, so the median is tested.
  const SequenceInfo& info = sequence_->info();
  const int k = info.first_frame + 3;
  const Frame prev = sequence_->read(k, {.gray = true, .flow = true});
  const Frame curr = sequence_->read(k + 1, {.gray = true});
  std::vector<int> differences, unmoved;
  for (int y = 0; y < info.height; y += 2) {
    for (int x = 0; x < info.width; x += 2) {
      if (!prev.flow(x, y).valid() || std::hypot(prev.flow(x, y).u, prev.flow(x, y).v) < 1) continue;
      const int to_x = static_cast<int>(std::lround(static_cast<float>(x) + prev.flow(x, y).u));
      const int to_y = static_cast<int>(std::lround(static_cast<float>(y) + prev.flow(x, y).v));
      if (!curr.gray.contains(to_x, to_y)) continue;
      differences.push_back(std::abs(prev.gray(x, y) - curr.gray(to_x, to_y)));
      unmoved.push_back(std::abs(prev.gray(x, y) - curr.gray(x, y)));
    }
  }
  ASSERT_GT(differences.size(), 200U);
  EXPECT_LE(upper_median(differences), 5);
  EXPECT_LT(2 * upper_median(differences), upper_median(unmoved));
}

TEST_P(SyntheticScenario, SameBytesEveryTimeAndFromTwoThreads) {
  const auto again = open_uncached("synthetic:" + GetParam());
  const int k = sequence_->info().first_frame + 2;
  const Frame expected = again->read(k, all_channels);
  Frame one, two;
  std::thread first([&] { one = sequence_->read(k, all_channels); });
  std::thread second([&] { two = sequence_->read(k, all_channels); });
  first.join();
  second.join();
  EXPECT_TRUE(same_bytes(one, expected));
  EXPECT_TRUE(same_bytes(two, expected));
  // A channel does not depend on which other channels are read.
  EXPECT_TRUE(same_bytes(sequence_->read(k, {.depth = true}).depth_m, expected.depth_m));
  EXPECT_TRUE(same_bytes(sequence_->read(k, {.mask = true}).mask, expected.mask));
  EXPECT_TRUE(same_bytes(*sequence_->true_flow(k), expected.flow));
  EXPECT_TRUE(same_bytes(sequence_->read(k, {.backward_flow = true}).backward_flow, expected.backward_flow));
  EXPECT_TRUE(same_bytes(sequence_->read(k, {.rgb_right = true}).rgb_right, expected.rgb_right));
}

TEST_P(SyntheticScenario, TruthHasTheBoxesOfTheMasks) {
  const SequenceInfo& info = sequence_->info();
  for (const int k : {info.first_frame, info.last_frame}) {
    const auto sequence = open_frames(k, k);
    const Image<uint16_t> mask = sequence->read(k, {.mask = true}).mask;
    const auto shares = area_shares(mask);
    EXPECT_EQ(sequence->truth().objects.at(k).size(), shares.size() - 1);
    for (const ObjectTruth& object : sequence->truth().objects.at(k)) {
      ASSERT_TRUE(shares.contains(object.id));
      ImageBox box;
      for (const auto [x, y] : pixels(mask)) {
        if (mask(x, y) == object.id) box.include(x, y);
      }
      EXPECT_EQ(object.box, box);
    }
  }
}

/// Returns the largest error of a motion in metres or degrees.
double motion_error(const SE3& truth, const SE3& estimate) {
  const SE3 error = truth.inverse() * estimate;
  return std::max(error.translation().norm(), rotation_angle_rad(error.rotation()) * 57.29577951308232);
}

TEST_P(SyntheticScenario, EstimatorsOnExactDataFindTheTruth) {
  const SequenceInfo& info = sequence_->info();
  constexpr Channels previous_frame{.gray = true, .depth = true, .flow = true, .mask = true};
  constexpr Channels current_frame{.depth = true, .mask = true};
  double worst_ego = 0, worst_object = 0;
  int n_pairs = 0, n_objects = 0;
  for (const int before : some_frames(8, 1)) {
    const int k = before + 1;
    ++n_pairs;
    const auto sequence = open_frames(before, k);
    const Frame prev = sequence->read(before, previous_frame);
    const Frame curr = sequence->read(k, current_frame);
    const FramePair pair = extract_frame_pair(prev, curr, info.camera, 1 / info.rate_hz, {});
    for (const char* name : {"motion_only", "joint_flow"}) {
      FrameEstimator estimator({}, make_estimator(name));
      const FrameResult result = estimator.process(pair);
      ASSERT_EQ(result.ego.status, Status::ok) << name << " " << k;
      const double ego =
          motion_error(*sequence->truth().background_motion(k - 1, k), result.ego.estimate.T_curr_prev);
      EXPECT_LT(ego, 1e-6) << name << " " << k;
      worst_ego = std::max(worst_ego, ego);
      for (const BodyResult& object : result.objects) {
        if (object.status != Status::ok) continue;
        const ObjectTruth* truth = sequence->truth().find(k, object.instance);
        ASSERT_NE(truth, nullptr);
        EXPECT_TRUE(*truth->moving) << name << " frame " << k << " object " << object.instance;
        const double error = motion_error(*sequence->truth().object_motion(object.instance, k - 1, k),
                                          object.estimate.T_curr_prev);
        EXPECT_LT(error, 1e-5) << name << " frame " << k << " object " << object.instance;
        worst_object = std::max(worst_object, error);
        ++n_objects;
      }
    }
  }
  EXPECT_GE(n_objects, n_pairs);  // at least one in every second pair, for each estimator
  RecordProperty("worst_ego", fmt::format("{:.2e}", worst_ego));
  RecordProperty("worst_object", fmt::format("{:.2e}", worst_object));
  RecordProperty("n_objects", n_objects);
  RecordProperty("n_pairs", n_pairs);
}

INSTANTIATE_TEST_SUITE_P(All, SyntheticScenario, testing::ValuesIn(synthetic::scenario_names()),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(Synthetic, S18HasTheCarsOfThePaper) {
  const auto sequence = open_uncached("synthetic:s18");
  EXPECT_EQ(sequence->info().first_frame, 0);
  EXPECT_EQ(sequence->info().last_frame, 10);
  const double distance_m[] = {8.4, 17.8, 26.3};
  const double share[] = {0.065, 0.0080, 0.0035};
  std::map<int, double> mean_m, mean_share;
  for (int k = 0; k <= 10; ++k) {
    const auto shares = area_shares(sequence->read(k, {.mask = true}).mask);
    for (int id = 1; id <= 3; ++id) {
      const ObjectTruth* car = sequence->truth().find(k, id);
      ASSERT_NE(car, nullptr);
      EXPECT_TRUE(*car->moving);
      mean_m[id] += car->T_camera_object.translation().norm() / 11;
      mean_share[id] += shares.at(id) / 11;
    }
    if (k == 0) continue;
    const double step_m = sequence->truth().camera.motion(k - 1, k)->translation().norm();
    EXPECT_GT(step_m, 0.53);
    EXPECT_LT(step_m, 0.68);
  }
  for (int id = 1; id <= 3; ++id) {
    EXPECT_NEAR(mean_m[id], distance_m[id - 1], 0.2 * distance_m[id - 1]) << id;
    EXPECT_NEAR(mean_share[id], share[id - 1], 0.2 * share[id - 1]) << id;
  }
}

TEST(Synthetic, TurnTurnsAndCrossingStands) {
  const auto turn = open_uncached("synthetic:s01-turn");
  for (int k = 1; k <= turn->info().last_frame; ++k) {
    const SE3 step = *turn->truth().camera.motion(k - 1, k);
    const double turn_deg = rotation_angle_rad(step.rotation()) * 57.29577951308232;
    EXPECT_GT(turn_deg, 1.45) << k;
    EXPECT_LT(turn_deg, 2.65) << k;
    EXPECT_GT(step.translation().norm(), 0.53) << k;
    EXPECT_LT(step.translation().norm(), 0.74) << k;
    EXPECT_NEAR(turn->truth().find(k, 1)->T_camera_object.translation().norm(), 13.0, 2.6);
  }
  const auto crossing = open_uncached("synthetic:s01-crossing");
  for (int k = 1; k <= crossing->info().last_frame; ++k) {
    EXPECT_EQ(crossing->truth().camera.motion(k - 1, k)->translation().norm(), 0.0);
    EXPECT_NEAR(crossing->truth().find(k, 1)->T_camera_object.translation().norm(), 14.0, 2.8) << k;
  }
}

TEST(Synthetic, LastFrameOfTheScenarioHasNoFlow) {
  EXPECT_TRUE(open_uncached("synthetic:s18")->read(10, {.flow = true}).flow.empty());
  EXPECT_FALSE(open_uncached("synthetic:s18")->true_flow(10).has_value());
  EXPECT_FALSE(open_uncached("synthetic:s18@2-5")->read(5, {.flow = true}).flow.empty());
}

TEST(Synthetic, SkyHasNoDepthAndNoFlow) {
  const Frame frame = open_uncached("synthetic:s18")->read(0, {.depth = true, .flow = true, .mask = true});
  EXPECT_TRUE(std::isnan(frame.depth_m(600, 60)));
  EXPECT_FALSE(frame.flow(600, 60).valid());
  EXPECT_EQ(frame.mask(600, 60), 0);
}

TEST(Synthetic, BadSourcesAreErrors) {
  expect_error([] { open_uncached("synthetic:s01-tun"); },
               "unknown scenario 's01-tun': did you mean 's01-turn'");
  expect_error([] { open_uncached("synthetic:s18@3-11"); },
               "synthetic:s18: frames 3-11 are requested, but it has frames 0-10");
  expect_error([] { open_uncached("synthetic:s18#left"); }, "no '#'");
  expect_error([] { open_uncached("synthetic:s18@2-4")->read(5, {.depth = true}); },
               "no frame 5: it has frames 2-4");
}

}  // namespace
}  // namespace sextant
