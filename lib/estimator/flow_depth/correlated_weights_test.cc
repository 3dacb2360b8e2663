#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "sextant/estimator/flow_depth/correlated_weights.h"

namespace sextant {
namespace {

constexpr int n_unknowns = ErrorScore::n_unknowns;

/// One point in each square of a grid, so that every point has its own cell.
std::vector<ErrorScore> points_of_a_grid(int per_side, double side_px, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<ErrorScore> points(static_cast<size_t>(per_side * per_side));
  for (size_t i = 0; i < points.size(); ++i) {
    ErrorScore& p = points[i];
    p.u = side_px * static_cast<double>(i % static_cast<size_t>(per_side)) + 40;
    p.v = side_px * static_cast<double>(i / static_cast<size_t>(per_side)) + 7;
    p.measured = Lanes{1, 1, 1, i % 3 == 0 ? 0.0 : 1.0};
    const auto draw = [&](Lanes& out) {
      for (size_t c = 0; c < n_lanes; ++c) out[c] = normal(random) * p.measured[c];
    };
    for (Lanes& row : p.derivative) draw(row);
    draw(p.residual);
    draw(p.by_depth);
    const Lanes squares = p.by_depth * p.by_depth;
    p.by_depth /= std::sqrt(sum_of_lanes(&squares));
    p.eliminate_depth();
  }
  return points;
}

/// Reference equations from the inverse of the full covariance of all channels of all points, with every
/// depth as an unknown.
struct Literal {
  ScoreMatrix curvature;
  ScoreVector gradient;

  Literal(const std::vector<ErrorScore>& points, const ErrorParts& errors, double side_px) {
    std::vector<std::pair<size_t, size_t>> rows;  // point, channel
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t c = 0; c < n_lanes; ++c) {
        if (points[i].measured[c] > 0) rows.emplace_back(i, c);
      }
    }
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n), D(n, n_unknowns);
    Eigen::MatrixXd b = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(points.size()));
    Eigen::VectorXd r(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto [i, c] = rows[static_cast<size_t>(k)];
      for (int a = 0; a < n_unknowns; ++a) D(k, a) = points[i].derivative[a][c];
      r[k] = points[i].residual[c];
      b(k, static_cast<Eigen::Index>(i)) = points[i].by_depth[c];
      for (Eigen::Index l = 0; l < n; ++l) {
        const auto [j, e] = rows[static_cast<size_t>(l)];
        if (c != e) continue;
        if (i == j) S(k, l) += errors.independent[c];
        const double squared =
            std::pow(points[i].u - points[j].u, 2) + std::pow(points[i].v - points[j].v, 2);
        for (const SpatialCorrelation::Part& part : errors.shape) {
          const double wide = part.length_px * part.length_px + side_px * side_px / 6;
          const double height = part.length_px * part.length_px / wide;
          S(k, l) += errors.correlated[c] * part.share *
                     (height * std::exp(-squared / (2 * wide)) + (i == j ? 1 - height : 0));
        }
      }
    }
    const Eigen::MatrixXd P = S.inverse();
    const Eigen::MatrixXd without = P - P * b * (b.transpose() * P * b).inverse() * b.transpose() * P;
    curvature = D.transpose() * without * D;
    gradient = D.transpose() * without * r;
  }
};

TEST(CorrelatedWeights, EqualTheFullCovarianceWithACellForEveryPoint) {
  // At most 24 cells: 16 of this side contain the points, at their centres except for a common shift.
  constexpr double width = 3 * 40;
  const double side = (2 * width + std::sqrt(4 * width * width * 24)) / (2 * 23);
  const ErrorParts errors = {{0.3, 0.1, 0.5, 0.5}, {2, 0.7, 0.4, 0}, {{25, 0.5}, {100, 0.5}}};
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::vector<ErrorScore> points = points_of_a_grid(4, 40, seed);
    const std::vector<ErrorScore> before = points;
    const WeightedEquations ours = weigh(points, errors);
    // Distances are those between cells.
    std::vector<ErrorScore> centred = before;
    for (ErrorScore& p : centred) {
      p.u = side * std::floor((p.u - 40) / side);
      p.v = side * std::floor((p.v - 7) / side);
    }
    const Literal literal(centred, errors, side);
    EXPECT_LT((ours.curvature - literal.curvature).norm(), 1e-8 * literal.curvature.norm());
    EXPECT_LT((ours.gradient - literal.gradient).norm(), 1e-8 * literal.gradient.norm());
    // G reproduces the same equations.
    for (int a = 0; a < n_unknowns; ++a) {
      double gradient = 0;
      for (size_t i = 0; i < points.size(); ++i) {
        const Lanes product = points[i].derivative[a] * before[i].residual;
        gradient += sum_of_lanes(&product);
      }
      EXPECT_NEAR(gradient, ours.gradient[a], 1e-9 * (1 + std::abs(gradient)));
    }
  }
}

TEST(CorrelatedWeights, OfIndependentErrorsAreOne) {
  std::vector<ErrorScore> points = points_of_a_grid(6, 25, 3);
  const std::vector<ErrorScore> before = points;
  EXPECT_NEAR(weigh(points, {}).independent, 1, 1e-12);
  for (size_t i = 0; i < points.size(); ++i) {
    for (int a = 0; a < n_unknowns; ++a) {
      for (size_t c = 0; c < n_lanes; ++c)
        EXPECT_NEAR(points[i].derivative[a][c], before[i].derivative[a][c], 1e-12);
    }
  }
}

TEST(CorrelatedWeights, PointsOfAnyPlace) {
  const ErrorParts errors = {{1, 1, 1, 1}, {3, 3, 3, 3}, {{25, 0.5}, {100, 0.5}}};
  std::vector<ErrorScore> none;
  EXPECT_EQ(weigh(none, errors).curvature.norm(), 0);
  for (const double side : {0.0, 1e-9, 1e-3, 1e5, 1e200, 1e308}) {
    std::vector<ErrorScore> points = points_of_a_grid(5, side, 1);
    const WeightedEquations out = weigh(points, errors);
    EXPECT_TRUE(out.curvature.allFinite() && out.gradient.allFinite()) << side;
    EXPECT_GT(out.curvature.topLeftCorner(6, 6).eval().ldlt().vectorD().minCoeff(), 0) << side;
  }
}

}  // namespace

namespace {

constexpr int n_right = 7;

/// Random matrix with eigenvalues from `least` to about n.
Eigen::MatrixXd random_matrix(int n, double least) {
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(n, n);
  return root * root.transpose() + least * Eigen::MatrixXd::Identity(n, n);
}

PositiveDefiniteSystem system_of(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  PositiveDefiniteSystem out(static_cast<size_t>(A.rows()));
  for (Eigen::Index column = 0; column < A.cols(); ++column) {
    for (Eigen::Index row = column; row < A.rows(); ++row)
      out.left(static_cast<size_t>(row), static_cast<size_t>(column)) = A(row, column);
    for (Eigen::Index side = 0; side < B.cols(); ++side)
      out.right(static_cast<size_t>(column), static_cast<size_t>(side)) = B(column, side);
  }
  return out;
}

TEST(PositiveDefiniteSystem, AgreesWithEigen) {
  for (const int n : {1, 2, 3, 4, 5, 23, 24, 95, 96, 97}) {
    const Eigen::MatrixXd A = random_matrix(n, 0.1), B = Eigen::MatrixXd::Random(n, n_right);
    const Eigen::MatrixXd expected = A.llt().solve(B);
    PositiveDefiniteSystem system = system_of(A, B);
    ASSERT_TRUE(system.solve()) << n;
    for (int row = 0; row < n; ++row) {
      for (int side = 0; side < n_right; ++side)
        EXPECT_NEAR(system.right(static_cast<size_t>(row), static_cast<size_t>(side)), expected(row, side),
                    1e-11 * expected.norm())
            << n;
    }
  }
}

TEST(PositiveDefiniteSystem, RefusesIndefiniteMatrices) {
  for (const int n : {1, 4, 6, 30}) {
    const Eigen::MatrixXd B = Eigen::MatrixXd::Random(n, n_right);
    Eigen::MatrixXd A = random_matrix(n, 0.1);
    A(n - 1, n - 1) = -1;
    EXPECT_FALSE(system_of(A, B).solve()) << n;
    A(n - 1, n - 1) = NAN;
    EXPECT_FALSE(system_of(A, B).solve()) << n;
    EXPECT_FALSE(system_of(Eigen::MatrixXd::Zero(n, n), B).solve()) << n;
  }
}

}  // namespace

}  // namespace sextant
