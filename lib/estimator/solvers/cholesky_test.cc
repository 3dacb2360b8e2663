#include "sextant/estimator/solvers/cholesky.h"

#include <gtest/gtest.h>
#include <Eigen/Dense>

namespace sextant {
namespace {

constexpr int n_right = 7;

/// Random, with eigenvalues from `least` to about n.
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

TEST(PositiveDefiniteSystem, RefusesWhatIsNotPositiveDefinite) {
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
