#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <map>
#include <random>

#include "sextant/estimator/consistency.h"
#include "sextant/estimator/flow_depth/correlated_covariance.h"
#include "sextant/estimator/flow_depth/error_model.h"
#include "sextant/estimator/registry.h"
#include "sextant/estimator/solvers/testing.h"

namespace sextant {
namespace {

using Part = SpatialCorrelation::Part;
constexpr Lanes ones = {1, 1, 1, 1};

/// One realisation of a field with one length: white noise on a fine lattice, weighted by distance.
class Field {
 public:
  Field(double length_px, std::mt19937_64& random) : length_(length_px), random_(random) {}
  double at(double u, double v) {
    const double step = length_ / 1.5;
    double sum = 0, squares = 0;
    for (int i = -3; i <= 4; ++i) {
      for (int j = -3; j <= 4; ++j) {
        const int a = static_cast<int>(std::floor(u / step)) + i,
                  b = static_cast<int>(std::floor(v / step)) + j;
        const double du = (u - a * step) / length_, dv = (v - b * step) / length_;
        const double weight = std::exp(-du * du - dv * dv);
        sum += weight * node(a, b);
        squares += weight * weight;
      }
    }
    return sum / std::sqrt(squares);
  }

 private:
  double node(int a, int b) {
    const auto [at, is_new] = nodes_.try_emplace({a, b}, 0.0);
    if (is_new) at->second = normal_(random_);
    return at->second;
  }
  double length_;
  std::mt19937_64& random_;
  std::normal_distribution<double> normal_;
  std::map<std::pair<int, int>, double> nodes_;
};

/// Points of a body with derivatives of its motion that are smooth over the image, as for a camera.
std::vector<ErrorScore> random_scores(int n, double width_px, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<ErrorScore> out(static_cast<size_t>(n));
  for (ErrorScore& p : out) {
    p.u = 17 + width_px * uniform(random);
    p.v = 5 + 0.4 * width_px * uniform(random);
    p.measured = ones;
    const double x = p.u / 500 - 1, y = p.v / 500, c = 0.05 + 0.2 * uniform(random);
    const Lanes rows[7] = {Lanes{c, 0, 0, 0},
                           Lanes{0, c, 0, 0},
                           Lanes{-x * c, -y * c, 0, 0},
                           Lanes{-x * y, -1 - y * y, 0, 0},
                           Lanes{1 + x * x, x * y, 0, 0},
                           Lanes{-y, x, 0, 0},
                           Lanes{0, 0, 1, 1}};
    std::copy_n(rows, 7, p.derivative);
    p.by_depth = Lanes{0.44 * x, 0.44 * y, 1, 1};
    const Lanes squares = p.by_depth * p.by_depth;
    p.by_depth /= std::sqrt(sum_of_lanes(&squares));
    p.eliminate_depth();
  }
  return out;
}

ScoreMatrix sum_over_pairs(const std::vector<ErrorScore>& points, double length_px) {
  ScoreMatrix out = ScoreMatrix::Zero();
  for (const ErrorScore& p : points) {
    for (const ErrorScore& q : points) {
      const double rho = SpatialCorrelation{{{length_px, 1}}}.at(std::hypot(p.u - q.u, p.v - q.v));
      for (int a = 0; a < 7; ++a) {
        for (int b = 0; b < 7; ++b) {
          const Lanes product = p.derivative[a] * q.derivative[b];
          out(a, b) += rho * sum_of_lanes(&product);
        }
      }
    }
  }
  return out;
}

// Compared with the sum over all pairs, for dense points as on an object and sparse ones as on the
// background.
TEST(CorrelatedErrors, SumsOverNodesAreSumsOverPairs) {
  for (const double width_px : {100.0, 1200.0}) {
    const std::vector<ErrorScore> points = random_scores(600, width_px, 3);
    for (const double length_px : {3.0, 10.0, 40.0, 100.0, 160.0}) {
      // One tenth is independent, so that relative differences far below that are irrelevant.
      const ScoreMatrix rest = independent_scores(points).times(0.1 * ones);
      const ScoreMatrix expected = 0.9 * sum_over_pairs(points, length_px) + rest;
      const ScoreMatrix sum = correlated_scores(points, {{length_px, 0.9}}).times(ones) + rest;
      const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> ratio(sum.topLeftCorner<6, 6>(),
                                                                     expected.topLeftCorner<6, 6>());
      EXPECT_GT(ratio.eigenvalues()[0], 0.97) << width_px << " " << length_px;
      EXPECT_LT(ratio.eigenvalues()[5], 1.03) << width_px << " " << length_px;
      EXPECT_NEAR(sum.trace() / expected.trace(), 1, 0.01) << width_px << " " << length_px;
    }
  }
}

// One error has an effect through the disparities of both frames.
TEST(PersistentErrors, HaveTheirEffectThroughBothDisparities) {
  const std::vector<ErrorScore> points = random_scores(300, 100, 4);
  const NoiseLevels levels{.delta_d_px = 0.2, .delta_d_curr_px = 0.4};
  ErrorParts parts{.shape = {{40, 1}}, .persistent = 2};
  std::vector<ErrorScore> both = points;
  for (ErrorScore& point : both) {
    for (Lanes& row : point.derivative) row = Lanes{row[2] + 0.5 * row[3], 0, 0, 0};
  }
  const ScoreMatrix expected = 2 * sum_over_pairs(both, 40);
  const ScoreMatrix M = smooth_error_scores(points, parts, levels);
  EXPECT_LT((M - expected).norm(), 0.03 * expected.norm());
  parts.persistent = 0;
  EXPECT_TRUE(smooth_error_scores(points, parts, levels).isZero(0));
  parts.correlated = ones;
  EXPECT_LT((smooth_error_scores(points, parts, levels) - sum_over_pairs(points, 40)).norm(),
            0.03 * sum_over_pairs(points, 40).norm());
}

TEST(CorrelatedErrors, ArePositiveSemiDefiniteForAnyPoints) {
  for (const int n : {1, 2, 7, 300}) {
    for (const double width_px : {0.0, 2.0, 1e5}) {
      const ScoreMatrix sum =
          correlated_scores(random_scores(n, width_px, 5), {{1e-4, 0.1}, {1, 0.2}, {20, 0.5}, {900, 0.2}})
              .times(ones);
      ASSERT_TRUE(sum.allFinite());
      const Eigen::SelfAdjointEigenSolver<ScoreMatrix> eigen(sum);
      EXPECT_GE(eigen.eigenvalues()[0], -1e-6 * eigen.eigenvalues()[6]) << n << " " << width_px;
    }
  }
  EXPECT_TRUE(correlated_scores({}, {{20, 1}}).times(ones).isZero(0));
  std::vector<ErrorScore> far_apart = random_scores(50, 100, 5);
  far_apart[0].u = 1e308, far_apart[1].u = -1e308;
  EXPECT_TRUE(correlated_scores(far_apart, {{20, 1}}).times(ones).allFinite());
  EXPECT_GE(estimate_error_parts(far_apart).independent[0], 0);
}

/// Mean estimated variances by channel, of errors with these components after a fit of the motion to them.
struct MeanVariances {
  Lanes independent = {}, correlated = {};
  int found = 0;        ///< number of realisations with correlated errors
  int significant = 0;  ///< number of realisations in which they are significant
};
MeanVariances mean_variances(const std::vector<Part>& parts, double independent, const Lanes& variances,
                             int n_draws) {
  MeanVariances mean;
  for (int draw = 0; draw < n_draws; ++draw) {
    std::mt19937_64 random(static_cast<unsigned>(draw));
    std::normal_distribution<double> normal;
    std::vector<ErrorScore> points = random_scores(150, 1200, static_cast<unsigned>(draw));
    for (ErrorScore& p : points)
      p.residual =
          std::sqrt(independent) * Lanes{normal(random), normal(random), normal(random), normal(random)};
    for (const Part& part : parts) {
      for (int channel = 0; channel < 4; ++channel) {
        Field field(part.length_px, random);
        for (ErrorScore& p : points) p.residual[channel] += std::sqrt(part.share) * field.at(p.u, p.v);
      }
    }
    for (ErrorScore& p : points) {
      for (int channel = 0; channel < 4; ++channel) p.residual[channel] *= std::sqrt(variances[channel]);
      const Lanes left = p.by_depth * p.residual;
      p.residual -= p.by_depth * sum_of_lanes(&left);
    }
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (const ErrorScore& p : points) {
      for (int a = 0; a < 6; ++a) {
        const Lanes products = p.derivative[a] * p.residual;
        g[a] += sum_of_lanes(&products);
        for (int b = 0; b < 6; ++b) {
          const Lanes product = p.derivative[a] * p.derivative[b];
          H(a, b) += sum_of_lanes(&product);
        }
      }
    }
    const Vector6d x = H.ldlt().solve(g);
    for (ErrorScore& p : points) {
      for (int a = 0; a < 6; ++a) p.residual -= x[a] * p.derivative[a];
    }
    const ErrorParts estimated = estimate_error_parts(points);
    mean.independent += estimated.independent / n_draws;
    mean.correlated += estimated.correlated / n_draws;
    mean.found += estimated.correlate() ? 1 : 0;
    mean.significant += estimated.significant ? 1 : 0;
  }
  return mean;
}

// The effect of the fit on the residuals is known, so the estimated variances of u, v and disparity are
// unbiased. They exceed the true ones by the factor freedoms / (freedoms - 2), and the correlated ones by 2.5
// standard deviations, partly at the expense of the independent ones.
TEST(CorrelatedErrors, VariancesAreFoundInTheResidualsOfAFit) {
  const Lanes variances = {4, 1, 0.5, 0.5};
  const MeanVariances mean = mean_variances({{20, 0.48}, {100, 0.32}}, 0.2, variances, 200);
  for (int channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(mean.independent[channel] / variances[channel], 0.06, 0.06) << channel;
    EXPECT_NEAR(mean.correlated[channel] / variances[channel], 1.27, 0.14) << channel;
  }
  EXPECT_GE(mean.significant, 195);
}

// Covariances always include correlated errors. The cost: a part of independent errors is attributed to
// correlation.
TEST(CorrelatedErrors, IndependentErrorsArePartlyAttributedToCorrelation) {
  const MeanVariances mean = mean_variances({}, 1, ones, 200);
  for (int channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(mean.independent[channel], 0.6, 0.15) << channel;
    EXPECT_NEAR(mean.independent[channel] + mean.correlated[channel], 1, 0.1) << channel;
  }
  EXPECT_EQ(mean.found, 200);
  EXPECT_LE(mean.significant, 30);
}

/// A random problem whose flow errors are a correlated field, declared or undeclared.
RandomProblem correlated_problem(unsigned seed, const SpatialCorrelation& correlation) {
  RandomProblem out = make_random_problem(seed, {.n_points = 400, .flow_noise_px = 0, .start_error = 0.002});
  std::mt19937_64 random(seed + 1000);
  std::normal_distribution<double> normal;
  Correspondences& p = out.problem.points;
  for (std::vector<double>* flow : {&p.flow_u, &p.flow_v}) {
    for (double& value : *flow) value += 0.3 * std::sqrt(correlation.independent_share()) * normal(random);
    for (const Part& part : correlation.parts) {
      Field field(part.length_px, random);
      for (size_t i = 0; i < p.size(); ++i)
        (*flow)[i] += 0.3 * std::sqrt(part.share) * field.at(p.u[i], p.v[i]);
    }
  }
  return out;
}

const SpatialCorrelation smooth{{{10, 0.4}, {60, 0.5}}};

class CovarianceOption : public ::testing::TestWithParam<const char*> {
 protected:
  static MotionEstimate estimate(const RandomProblem& random, const char* covariance) {
    Json options = {{"covariance", covariance}};  // and the true standard deviation, 0.3 px
    if (std::string(GetParam()) == "motion_only") options["sigma_px"] = 0.3;
    if (std::string(GetParam()) == "joint_flow")
      options["sigma_projection_px"] = 0.18, options["sigma_flow_px"] = 0.24;
    return make_estimator(GetParam(), options)->estimate(random.problem, random.start);
  }
};
INSTANTIATE_TEST_SUITE_P(, CovarianceOption,
                         ::testing::Values("motion_only", "joint_flow", "joint_flow_depth"),
                         [](const auto& test) { return std::string(test.param); });

// joint_flow_depth also weights the points by the correlation.
TEST_P(CovarianceOption, ChangesNeitherPointsNorMotionOfOtherEstimators) {
  const auto random = correlated_problem(1, smooth);
  const MotionEstimate independent = estimate(random, "independent");
  const MotionEstimate correlated = estimate(random, "correlated");
  ASSERT_EQ(correlated.status, Status::ok);
  const bool same = independent.T_curr_prev.translation() == correlated.T_curr_prev.translation() &&
                    independent.T_curr_prev.rotation().coeffs() == correlated.T_curr_prev.rotation().coeffs();
  EXPECT_EQ(same, std::string(GetParam()) != "joint_flow_depth");
  EXPECT_EQ(independent.inliers, correlated.inliers);
  EXPECT_NE(independent.covariance, correlated.covariance);
  EXPECT_NE(independent.condition, correlated.condition);
  EXPECT_THROW(make_estimator(GetParam(), Json{{"covariance", "other"}}), Error);
}

// The mean of a consistent NEES over 120 realisations lies in 6 +- 2.6 sqrt(12 / 120) with 99 %.
TEST_P(CovarianceOption, IsRightForDeclaredAndForUndeclaredCorrelation) {
  constexpr int n = 120;
  double declared = 0, undeclared = 0, independent = 0;
  for (unsigned seed = 0; seed < n; ++seed) {
    auto random = correlated_problem(seed, smooth);
    const auto nees = [&](const char* covariance) {
      const MotionEstimate e = estimate(random, covariance);
      const Vector6d error = (e.T_curr_prev * random.T_curr_prev.inverse()).log();
      return error.dot(e.covariance.ldlt().solve(error)) / n;
    };
    undeclared += nees("correlated");
    independent += nees("independent");
    random.problem.noise = MeasurementNoise{0.3, 0.3, 0, 0, smooth, false};
    declared += nees("correlated");
  }
  EXPECT_NEAR(declared, 6, 0.82);
  // the correlation is not declared: covariances are too large rather than too small
  EXPECT_NEAR(undeclared, 3.6, 1);
  EXPECT_GT(independent, 20);
}

/// Mean squared error with weights for correlated errors, divided by that without, in units of the latter's
/// covariances.
template <typename MakeProblem>
double squared_error_by_weights(const MakeProblem& make_problem) {
  const auto weighing = make_estimator("joint_flow_depth"),
             plain = make_estimator("joint_flow_depth", Json{{"covariance", "independent"}});
  double with = 0, without = 0;
  for (unsigned seed = 0; seed < 120; ++seed) {
    const RandomProblem random = make_problem(seed);
    const MotionEstimate reference = plain->estimate(random.problem, random.start);
    const auto square = [&](const MotionEstimate& e) {
      const Vector6d error = (e.T_curr_prev * random.T_curr_prev.inverse()).log();
      return error.dot(reference.covariance.ldlt().solve(error));
    };
    without += square(reference);
    with += square(weighing->estimate(random.problem, random.start));
  }
  return with / without;
}

TEST(CorrelatedWeights, GetMoreFromTheSamePoints) {
  const SpatialCorrelation known{{{25, 0.3}, {100, 0.6}}};
  EXPECT_LT(squared_error_by_weights([&](unsigned seed) {
              auto random = correlated_problem(seed, known);
              random.problem.noise = MeasurementNoise{0.3, 0.3, 0, 0, known, false};
              return random;
            }),
            0.8);
}

TEST(CorrelatedWeights, CostLittleForUndeclaredIndependentErrors) {
  EXPECT_NEAR(squared_error_by_weights([](unsigned seed) {
                return make_random_problem(seed, {.n_points = 400, .delta_d_px = 0.2});
              }),
              1.03, 0.05);
}

TEST(CorrelatedCovariance, DeclaredIndependenceIsTakenAtItsWord) {
  auto random = make_random_problem(2, {.n_points = 400, .delta_d_px = 0.2});
  random.problem.noise = MeasurementNoise{0.3, 0.3, 0.2 / random.problem.camera.bf};
  const auto covariance = [&](const char* option) {
    return make_estimator("joint_flow_depth", Json{{"covariance", option}})
        ->estimate(random.problem, random.start)
        .covariance;
  };
  EXPECT_EQ(covariance("independent"), covariance("correlated"));
}

// A smooth error that the disparities of both frames share does not appear in their differences. The
// covariance includes it.
TEST(PersistentErrors, AreInTheCovariance) {
  constexpr int n = 60;
  constexpr double delta_d_px = 0.2;
  const auto estimator = make_estimator("joint_flow_depth", Json{{"plane_radius_px", 0}});
  double with = 0, without = 0;
  for (unsigned seed = 0; seed < n; ++seed) {
    auto random = make_random_problem(seed, {.n_points = 300,
                                             .flow_noise_px = 0.03,
                                             .near_m = 12,
                                             .far_m = 15,
                                             .spread = 0.15,
                                             .delta_d_px = delta_d_px,
                                             .depth_curr = true,
                                             .start_error = 0.002});
    std::mt19937_64 engine(seed + 1000);
    Field near(20, engine), far(100, engine);
    Correspondences& p = random.problem.points;
    for (size_t i = 0; i < p.size(); ++i) {
      const double error_px =
          2 * delta_d_px *
          (std::sqrt(0.6) * near.at(p.u[i], p.v[i]) + std::sqrt(0.4) * far.at(p.u[i], p.v[i]));
      for (double* depth : {&p.depth[i], &p.depth_curr[i]})
        *depth = 1 / (1 / *depth + error_px / random.problem.camera.bf);
    }
    const auto nees = [&](const MotionEstimate& e) {
      const Vector6d error = (e.T_curr_prev * random.T_curr_prev.inverse()).log();
      return error.dot(e.covariance.ldlt().solve(error)) / n;
    };
    const MotionEstimate estimate = estimator->estimate(random.problem, random.start);
    ASSERT_TRUE(estimate.errors);
    EXPECT_EQ(estimate.errors->parts.persistent, persistent_ratio);
    with += nees(estimate);
    auto errors = std::make_shared<ErrorModel>(*estimate.errors);
    errors->parts.persistent = 0;
    StartingPoint start = random.start;
    start.errors = errors;
    const MotionEstimate other = estimator->estimate(random.problem, start);
    without += nees(other);
    const Eigen::SelfAdjointEigenSolver<Matrix6d> growth(estimate.covariance - other.covariance);
    EXPECT_GE(growth.eigenvalues()[0], -1e-3 * growth.eigenvalues()[5]);
  }
  EXPECT_LT(with, 9);
  EXPECT_GT(without, 1.5 * with);
}

// The disparities have a common offset, which moves each half of the points differently.
TEST(SplitNees, DetectsErrorsMissingFromTheCovariance) {
  const auto mean = [](bool noisy_as_declared) {
    const auto estimator = make_estimator("joint_flow_depth", Json{{"covariance", "independent"}});
    double sides = 0, cells = 0;
    constexpr int n = 100;
    for (unsigned seed = 0; seed < n; ++seed) {
      auto random = make_random_problem(seed, {.n_points = 600, .delta_d_px = 0.1, .start_error = 0.002});
      random.problem.noise = MeasurementNoise{0.3, 0.3, 0.1 / random.problem.camera.bf};
      if (!noisy_as_declared) {
        for (double& depth : random.problem.points.depth)
          depth = 1 / (1 / depth + 0.6 / random.problem.camera.bf);
      }
      const MotionEstimate whole = estimator->estimate(random.problem, random.start);
      const SplitNees split = split_nees(random.problem, whole, *estimator);
      EXPECT_TRUE(split.sides && split.cells);
      sides += split.sides.value_or(0) / n;
      cells += split.cells.value_or(0) / n;
    }
    return std::array{sides, cells};
  };
  const auto [sides, cells] = mean(true);
  EXPECT_NEAR(sides, 6, 0.9);  // 2.6 sqrt(12 / 100)
  EXPECT_NEAR(cells, 6, 0.9);
  EXPECT_GT(mean(false)[0], 9);
}

// The cross-covariance of the halves is subtracted: adjacent squares give the same result as sides.
TEST(SplitNees, IsRightWhereErrorsCorrelate) {
  const auto estimator = make_estimator("joint_flow_depth");
  double sides = 0, cells = 0;
  constexpr int n = 120;
  for (unsigned seed = 0; seed < n; ++seed) {
    auto random = correlated_problem(seed, smooth);
    random.problem.noise = MeasurementNoise{0.3, 0.3, 0, 0, smooth, false};
    const SplitNees split =
        split_nees(random.problem, estimator->estimate(random.problem, random.start), *estimator);
    sides += split.sides.value_or(NAN) / n;
    cells += split.cells.value_or(NAN) / n;
  }
  EXPECT_NEAR(sides, 6, 1.2);  // 2.6 sqrt(12 / 120), and 15 % for sums over cells
  EXPECT_NEAR(cells, 6, 1.2);
}

TEST(SplitNees, TooFewPointsHaveNoResult) {
  const auto random = make_random_problem(1, {.n_points = 5});
  const auto estimator = make_estimator("joint_flow");
  MotionEstimate whole;
  whole.T_curr_prev = random.T_curr_prev;
  whole.inliers.assign(5, 1);
  EXPECT_FALSE(split_nees(random.problem, whole, *estimator).sides);
  whole.inliers.assign(5, 0);
  EXPECT_FALSE(split_nees(random.problem, whole, *estimator).sides);
}

}  // namespace

}  // namespace sextant
