// Every degenerate configuration has its status, weak but valid bodies are estimated, and no configuration
// causes a crash, an exception or a NaN. SEXTANT_FUZZ_PROBLEMS sets the number of random problems.

#include "sextant/estimator/solvers/degeneracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/registry.h"
#include "sextant/estimator/solvers/testing.h"

namespace sextant {
namespace {

const StereoCamera camera = {{720, 718, 610, 180}, 380};
const SE3 motion(so3_exp({0.002, 0.01, -0.003}), Eigen::Vector3d(0.05, 0.02, -0.9));

/// Observes points in the previous camera's coordinates that move by `motion`; `delta_d_px` and `flow_px` are
/// noise levels.
Problem observe(const std::vector<Eigen::Vector3d>& points, double delta_d_px = 0, double flow_px = 0,
                const SE3& X = motion) {
  std::mt19937_64 engine(7);
  std::normal_distribution<double> normal;
  Problem problem;
  problem.camera = camera;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d from = camera.left.project(p);
    const Eigen::Vector2d to = camera.left.project(X * p);
    const double depth = camera.bf / (camera.bf / p.z() + delta_d_px * normal(engine));
    problem.points.push_back(from.x(), from.y(), depth, to.x() - from.x() + flow_px * normal(engine),
                             to.y() - from.y() + flow_px * normal(engine));
  }
  return problem;
}

StartingPoint start_at(const SE3& X, size_t n) { return {X, std::vector<unsigned char>(n, 1)}; }

std::vector<Eigen::Vector3d> line(int n, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < n; ++i) points.push_back(from + (to - from) * i / (n - 1.0));
  return points;
}

/// A grid of points on a rectangle at `centre` with `relief_m` of depth variation.
std::vector<Eigen::Vector3d> patch(int columns, int rows, const Eigen::Vector3d& centre, double width_m,
                                   double height_m, double relief_m) {
  std::vector<Eigen::Vector3d> points;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double a = i / (columns - 1.0) - 0.5;
      const double b = j / (rows - 1.0) - 0.5;
      points.push_back(centre +
                       Eigen::Vector3d(width_m * a, height_m * b, relief_m * ((3 * i + 5 * j) % 7) / 7));
    }
  }
  return points;
}

struct Configuration {
  const char* name;
  Problem problem;
  Status status;
};

std::vector<Configuration> configurations() {
  const Eigen::Vector3d near(1, 0.5, 8);
  Problem declared = observe(line(50, {-2, 1, 6}, {3, 1, 14}), 0.3, 0.3);
  declared.noise = MeasurementNoise{0.3, 0.3, 0.3 / camera.bf};
  Problem infinite = observe(patch(8, 8, {0, 0, 20}, 12, 5, 8));
  infinite.points.depth.assign(infinite.points.size(), INFINITY);
  return {
      {"NoPoints", observe({}), Status::too_few_points},
      {"TwoPoints", observe({near, {2, 1, 9}}), Status::too_few_points},
      {"Line", observe(line(50, {-2, 1, 6}, {3, 1, 14})), Status::collinear},
      {"LineWithNoise", observe(line(50, {-2, 1, 6}, {3, 1, 14}), 0.1, 0.3), Status::collinear},
      {"LineWithDeclaredNoise", declared, Status::collinear},
      {"ThreeOnALine", observe(line(3, {-2, 1, 6}, {3, 1, 14})), Status::collinear},
      {"OnePointOverAndOver", observe(std::vector<Eigen::Vector3d>(40, near)), Status::collinear},
      {"ViewingRay", observe(line(40, near, 3 * near)), Status::collinear},
      {"DepthInfinite", infinite, Status::at_infinity},
      {"Far", observe(patch(20, 10, {0, 0, 5000}, 4000, 1500, 800)), Status::at_infinity},
      {"SmallFlatPatch", observe(patch(4, 4, {0.3, 0.2, 20}, 0.06, 0.06, 0), 0, 0.3), Status::no_parallax},
  };
}

TEST(Degeneracy, EveryConfigurationHasItsStatus) {
  for (const Configuration& c : configurations()) {
    const size_t n = c.problem.points.size();
    for (const EstimatorEntry& entry : estimators()) {
      const MotionEstimate estimate = entry.make(Json::object())->estimate(c.problem, start_at(motion, n));
      EXPECT_EQ(to_string(estimate.status), to_string(c.status)) << c.name << ' ' << entry.name;
    }
    const RobustStart start = robust_start(c.problem, std::nullopt, {});
    // The robust start checks the points, not the covariance.
    if (c.status != Status::no_parallax) {
      EXPECT_EQ(to_string(start.status), to_string(c.status)) << c.name;
    }
  }
}

TEST(Degeneracy, WeakButHealthyBodiesAreEstimated) {
  const std::vector<Configuration> healthy = {
      {"FarCar", observe(patch(10, 6, {4, 0.5, 35}, 1.7, 1.4, 0.8), 0, 0.2), Status::ok},
      {"FarCarNoisyDepth", observe(patch(10, 6, {4, 0.5, 35}, 1.7, 1.4, 0.8), 0.2, 0.2), Status::ok},
      {"FlatBackOfATruck", observe(patch(12, 12, {0, 0, 20}, 2.4, 2.4, 0), 0, 0.2), Status::ok},
      {"FlatBackNoisyDepth", observe(patch(12, 12, {0, 0, 20}, 2.4, 2.4, 0), 0.2, 0.2), Status::ok},
      {"ThinPole", observe(patch(3, 40, {3, 0, 12}, 0.15, 4, 0.1), 0, 0.2), Status::ok},
      {"FourPoints", observe({{0, 0, 8}, {1, 0, 9}, {0, 1, 10}, {-1, 1, 7}}), Status::ok},
      {"Plane", observe(patch(15, 10, {0, 1.5, 12}, 8, 0.001, 6)), Status::ok},
      {"FarBackground", observe(patch(20, 10, {0, 0, 150}, 120, 40, 60), 0.1, 0.2), Status::ok},
      {"StandsStill", observe(patch(10, 6, {4, 0.5, 15}, 1.7, 1.4, 0.8), 0, 0.2, SE3()), Status::ok},
  };
  for (const Configuration& c : healthy) {
    const size_t n = c.problem.points.size();
    EXPECT_EQ(to_string(robust_start(c.problem, std::nullopt, {}).status), "ok") << c.name;
    for (const EstimatorEntry& entry : estimators()) {
      const SE3 X = std::string_view(c.name) == "StandsStill" ? SE3() : motion;
      const MotionEstimate estimate = entry.make(Json::object())->estimate(c.problem, start_at(X, n));
      EXPECT_EQ(to_string(estimate.status), "ok") << c.name << ' ' << entry.name;
      EXPECT_GT(estimate.condition, 1) << c.name;
      EXPECT_LT(estimate.condition, 1e12) << c.name;
    }
  }
}

TEST(Degeneracy, ConditionEqualsThatOfTheCovariance) {
  const auto random = make_random_problem(1, {.n_points = 200});
  for (const EstimatorEntry& entry : estimators()) {
    const MotionEstimate estimate = entry.make(Json::object())->estimate(random.problem, random.start);
    const Eigen::JacobiSVD<Matrix6d> svd(estimate.covariance);
    EXPECT_NEAR(estimate.condition, svd.singularValues()[0] / svd.singularValues()[5],
                1e-6 * estimate.condition);
  }
}

TEST(Degeneracy, InvalidMeasurementsAreIgnored) {
  auto random = make_random_problem(2, {.n_points = 100});
  Correspondences& p = random.problem.points;
  p.flow_u[3] = NAN, p.depth[5] = 0, p.depth[7] = -4, p.depth[11] = INFINITY, p.v[13] = INFINITY;
  for (const EstimatorEntry& entry : estimators()) {
    const MotionEstimate estimate = entry.make(Json::object())->estimate(random.problem, random.start);
    ASSERT_EQ(to_string(estimate.status), "ok") << entry.name;
    EXPECT_LT(pose_difference(estimate.T_curr_prev, random.T_curr_prev), 0.1) << entry.name;
    for (const size_t bad : {3, 5, 7, 11, 13}) EXPECT_EQ(estimate.inliers[bad], 0) << entry.name;
  }
}

class RandomProblems {
 public:
  explicit RandomProblems(unsigned seed) : engine_(seed) {}

  Problem next() {
    Problem problem;
    problem.camera = camera;
    if (chance(0.2)) problem.noise = MeasurementNoise{uniform(0, 1), uniform(0, 1), uniform(0, 1e-3)};
    const int n = chance(0.9) ? pick(7) : 7 + pick(60);
    const int shape = pick(6);
    const double size = std::pow(10.0, uniform(-6, 1));
    const Eigen::Vector3d centre(uniform(-5, 5), uniform(-2, 2), std::pow(10.0, uniform(-1, 4)));
    const Eigen::Vector3d a = direction(), b = direction();
    const SE3 X = random_motion();
    for (int i = 0; i < n; ++i) {
      Eigen::Vector3d p = centre;                                             // 0: all points identical
      if (shape == 1) p += size * uniform(-1, 1) * a;                         // on a line
      if (shape == 2) p += size * (uniform(-1, 1) * a + uniform(-1, 1) * b);  // on a plane
      if (shape >= 3) p += (shape == 3 ? size : 3.0) * direction();
      const Eigen::Vector2d from = camera.left.project(p);
      const Eigen::Vector2d to = camera.left.project(X * p);
      const double wrong = chance(0.2) ? 30 : 0.3;
      problem.points.push_back(from.x(), from.y(), p.z(), to.x() - from.x() + wrong * uniform(-1, 1),
                               to.y() - from.y() + wrong * uniform(-1, 1), chance(0.5) ? (X * p).z() : NAN);
    }
    if (chance(0.5)) spoil(problem.points);
    return problem;
  }

  SE3 random_motion() {
    const double size = std::pow(10.0, uniform(-3, 1));
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = size * uniform(-1, 1);
    return SE3::exp(xi);
  }

  bool chance(double p) { return uniform(0, 1) < p; }

 private:
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11U) * 0x1p-53);
  }
  int pick(int n) { return static_cast<int>(engine_() % static_cast<uint64_t>(n)); }
  Eigen::Vector3d direction() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

  void spoil(Correspondences& points) {
    constexpr double bad[] = {NAN, INFINITY, -INFINITY, 0, -3, 1e-300, 1e300, 5e-324, 1e9, -1e9};
    const bool all = chance(0.3);
    std::vector<double>* const arrays[] = {&points.depth, &points.flow_u,     &points.flow_v, &points.u,
                                           &points.v,     &points.depth_curr, &points.depth,  &points.flow_u};
    std::vector<double>& array = *arrays[pick(8)];
    const double value = bad[pick(10)];
    for (double& x : array) {
      if (all || chance(0.3)) x = chance(0.8) ? value : bad[pick(10)];
    }
  }

  std::mt19937_64 engine_;
};

int n_problems(int usual) {
  const char* wanted = std::getenv("SEXTANT_FUZZ_PROBLEMS");
  return wanted == nullptr ? usual : std::atoi(wanted);
}

void expect_sound(const MotionEstimate& estimate, const Problem& problem) {
  EXPECT_TRUE(estimate.T_curr_prev.is_finite());
  EXPECT_TRUE(estimate.covariance.allFinite());
  EXPECT_TRUE(std::isfinite(estimate.cost));
  EXPECT_FALSE(std::isinf(estimate.condition));
  if (estimate.status != Status::ok) return;
  EXPECT_GE(estimate.condition, 1);
  EXPECT_GT(estimate.covariance.diagonal().minCoeff(), 0);
  ASSERT_EQ(estimate.inliers.size(), problem.points.size());
  ASSERT_EQ(estimate.refined_flow_u.size(), problem.points.size());
  for (size_t i = 0; i < estimate.inliers.size(); ++i) {
    if (estimate.inliers[i] == 0) continue;
    EXPECT_TRUE(std::isfinite(estimate.refined_flow_u[i]) && std::isfinite(estimate.refined_flow_v[i]));
  }
}

class EveryEstimatorAndKernel : public ::testing::TestWithParam<std::pair<std::string, std::string>> {};

TEST_P(EveryEstimatorAndKernel, RandomDegenerateProblems) {
  const auto& [name, robust] = GetParam();
  const auto estimator = make_estimator(name, Json{{"robust", robust}});
  const bool slow = name.ends_with("_ceres");
  const int n = n_problems(slow ? 60 : 500);
  RandomProblems random(1);
  int estimated = 0;
  for (int k = 0; k < n && !HasFailure(); ++k) {
    SCOPED_TRACE("problem " + std::to_string(k));
    const Problem problem = random.next();
    StartingPoint start = start_at(random.random_motion(), problem.points.size());
    for (unsigned char& inlier : start.inliers) inlier = random.chance(0.9) ? 1 : 0;
    MotionEstimate estimate;
    ASSERT_NO_THROW(estimate = estimator->estimate(problem, start));
    expect_sound(estimate, problem);
    estimated += estimate.status == Status::ok ? 1 : 0;
    const RobustStart robust_start_ = robust_start(problem, std::nullopt, {});
    if (robust_start_.status != Status::ok) continue;
    ASSERT_NO_THROW(estimate = estimator->estimate(problem, robust_start_.point));
    expect_sound(estimate, problem);
    estimated += estimate.status == Status::ok ? 1 : 0;
  }
  EXPECT_GT(estimated, 0);
}

std::vector<std::pair<std::string, std::string>> estimators_and_kernels() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const EstimatorEntry& entry : estimators()) {
    for (const char* robust : {"huber", "geman_mcclure_gnc", "none"}) {
      // Two references reject the redescending kernel with an error.
      const bool lacks = entry.name == "motion_only_ceres" || entry.name == "joint_flow_ceres";
      if (!lacks || robust != std::string("geman_mcclure_gnc")) all.emplace_back(entry.name, robust);
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(, EveryEstimatorAndKernel, ::testing::ValuesIn(estimators_and_kernels()),
                         [](const auto& test) { return test.param.first + "_" + test.param.second; });

TEST(Degeneracy, RandomFramePairsThroughThePipeline) {
  RandomProblems random(2);
  for (const char* name : {"joint_flow", "joint_flow_depth"}) {
    FrameEstimator estimator({.min_object_area = 0, .min_object_points = 4}, make_estimator(name));
    for (int k = 0; k < n_problems(300) && !HasFailure(); ++k) {
      FramePair pair;
      pair.prev = k;
      pair.curr = k + 1;
      pair.dt_s = 0.1;
      pair.width = 1242;
      pair.height = 375;
      pair.camera = camera;
      pair.background = random.next().points;
      for (int id = 1; id < 3; ++id) {
        ObjectObservation object;
        object.instance = id;
        object.area_fraction = 0.1;
        object.points = random.next().points;
        object.instance_prev.assign(object.points.size(), static_cast<uint16_t>(id));
        pair.objects.push_back(std::move(object));
      }
      FrameResult result;
      ASSERT_NO_THROW(result = estimator.process(pair)) << k;
      for (const BodyResult& body : result.objects) {
        if (body.status == Status::ok && result.ego.status == Status::ok) {
          EXPECT_TRUE(std::isfinite(body.speed_mps)) << k;
        }
      }
    }
  }
}

TEST(Degeneracy, ACovarianceThatDoesNotDetermineTheMotionGivesNoEstimate) {
  MotionEstimate estimate;
  estimate.status = Status::ok;
  estimate.covariance = Matrix6d::Identity();
  replace_covariance(4 * Matrix6d::Identity(), estimate);
  EXPECT_EQ(estimate.status, Status::ok);
  EXPECT_EQ(estimate.covariance(0, 0), 4);
  replace_covariance(Matrix6d::Constant(INFINITY), estimate);
  EXPECT_EQ(estimate.status, Status::no_parallax);
  EXPECT_EQ(estimate.covariance(0, 0), 4);
  estimate.status = Status::collinear;
  replace_covariance(Matrix6d::Zero(), estimate);
  EXPECT_EQ(estimate.status, Status::collinear);
}

}  // namespace
}  // namespace sextant
