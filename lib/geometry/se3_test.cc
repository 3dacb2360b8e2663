#include "sextant/geometry/se3.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

constexpr double pi = std::numbers::pi;

/// Returns the Lie algebra element of a twist as a 4x4 matrix.
Eigen::Matrix4d hat(const Vector6d& xi) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.topLeftCorner<3, 3>() = skew(xi.tail<3>());
  m.topRightCorner<3, 1>() = xi.head<3>();
  return m;
}

TEST(Skew, IsTheCrossProduct) {
  const Eigen::Vector3d a(1, -2, 3);
  const Eigen::Vector3d b(0.5, 4, -1);
  EXPECT_THAT((skew(a) * b).eval(), EigenNear(a.cross(b).eval(), 0.0));
  EXPECT_THAT(skew(a).transpose().eval(), EigenNear((-skew(a)).eval(), 0.0));
}

TEST(SE3, ExpIsTheMatrixExponential) {
  std::mt19937_64 generator(1);
  for (const double angle : {1e-12, 1e-6, 1e-3, 5e-3, 9.9e-3, 1.01e-2, 0.1, 1.0, 1.8}) {
    for (int i = 0; i < 20; ++i) {
      const Vector6d xi = random_twist(generator, 5.0, angle);
      EXPECT_THAT(SE3::exp(xi).matrix(), EigenNear(hat(xi).exp().eval(), 5e-14)) << "angle scale " << angle;
    }
  }
}

// Angles of every magnitude, on both sides of the switch to series at 1e-2 rad, up to just below pi.
class LogOfExp : public ::testing::TestWithParam<double> {};

TEST_P(LogOfExp, IsTheTwist) {
  std::mt19937_64 generator(2);
  for (int i = 0; i < 100; ++i) {
    Vector6d xi = random_twist(generator, 10.0, 1.0);
    xi.tail<3>() *= GetParam() / xi.tail<3>().norm();
    // Near pi, the sensitivity of log is about 1 / (2 pi - angle), so no digits are lost; the inverse of V is
    // bounded too.
    EXPECT_THAT(SE3::exp(xi).log(), EigenNear(xi, 1e-13 * 100)) << xi.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Angles, LogOfExp,
                         ::testing::Values(1e-300, 1e-15, 1e-11, 0.99e-10, 1.01e-10, 1e-8, 1e-4, 0.00999999,
                                           0.01000001, 0.1, 1.0, 2.0, 3.0, pi - 1e-3, pi - 1e-6, pi - 1e-9));

TEST(SE3, LogOfIdentityIsZero) {
  EXPECT_THAT(SE3().log(), EigenNear(Vector6d::Zero().eval(), 0.0));
  EXPECT_THAT(SE3::exp(Vector6d::Zero()).matrix(), EigenNear(Eigen::Matrix4d::Identity().eval(), 0.0));
}

TEST(SE3, ExpOfLogAtPiIsTheMotion) {
  // At pi the sign of the axis is arbitrary, so only the motion is unique.
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 2, -3)}) {
    const SE3 T(Eigen::Quaterniond(Eigen::AngleAxisd(pi, axis.normalized())), {1, 2, 3});
    EXPECT_NEAR(T.log().tail<3>().norm(), pi, 1e-15);
    EXPECT_THAT(SE3::exp(T.log()), SE3Near(T, 1e-14));
  }
}

TEST(SE3, LogDoesNotDependOnTheQuaternionsSign) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  const Eigen::Quaterniond negative(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_THAT(so3_log(negative), EigenNear(so3_log(q), 1e-15));
  const Eigen::Quaterniond tiny(-1.0, -1e-12, 0, 0);
  EXPECT_THAT(so3_log(tiny), EigenNear(Eigen::Vector3d(2e-12, 0, 0), 1e-25));
}

TEST(SE3, ExpTakesAnglesBeyondPi) {
  Vector6d xi;
  xi << 1, 2, 3, 0, 0, 4.0;
  EXPECT_THAT(SE3::exp(xi).matrix(), EigenNear(hat(xi).exp().eval(), 1e-13));
  EXPECT_NEAR(SE3::exp(xi).log().tail<3>().norm(), 2 * pi - 4.0, 1e-14);
}

TEST(SE3, IsAGroup) {
  std::mt19937_64 generator(3);
  for (int i = 0; i < 100; ++i) {
    const SE3 A = SE3::exp(random_twist(generator, 10.0, 1.5));
    const SE3 B = SE3::exp(random_twist(generator, 10.0, 1.5));
    const SE3 C = SE3::exp(random_twist(generator, 10.0, 1.5));
    EXPECT_THAT((A * B) * C, SE3Near(A * (B * C), 1e-13));
    EXPECT_THAT(A * A.inverse(), SE3Near(SE3(), 1e-13));
    EXPECT_THAT(A.inverse() * A, SE3Near(SE3(), 1e-13));
    EXPECT_THAT(A * SE3(), SE3Near(A, 1e-14));
    EXPECT_THAT((A * B).inverse(), SE3Near(B.inverse() * A.inverse(), 1e-13));
    EXPECT_THAT((A * B).matrix(), EigenNear((A.matrix() * B.matrix()).eval(), 1e-13));
  }
}

TEST(SE3, ActsOnPointsAsItsMatrix) {
  std::mt19937_64 generator(4);
  const SE3 T_a_b = SE3::exp(random_twist(generator, 3.0, 1.0));
  const SE3 T_b_c = SE3::exp(random_twist(generator, 3.0, 1.0));
  const Eigen::Vector3d p_c(1, 2, 30);
  EXPECT_THAT(T_a_b * p_c, EigenNear((T_a_b.matrix() * p_c.homogeneous()).head<3>().eval(), 1e-13));
  EXPECT_THAT((T_a_b * T_b_c) * p_c, EigenNear(T_a_b * (T_b_c * p_c), 1e-13));
}

TEST(SE3, AdjointMovesATwistAcross) {
  std::mt19937_64 generator(5);
  for (int i = 0; i < 100; ++i) {
    const SE3 T = SE3::exp(random_twist(generator, 10.0, 1.5));
    const Vector6d xi = random_twist(generator, 1.0, 1.0);
    EXPECT_THAT(SE3::exp(T.adjoint() * xi) * T, SE3Near(T * SE3::exp(xi), 1e-12));
    const SE3 S = SE3::exp(random_twist(generator, 10.0, 1.5));
    EXPECT_THAT((T * S).adjoint(), EigenNear((T.adjoint() * S.adjoint()).eval(), 1e-12));
    EXPECT_THAT(T.inverse().adjoint(), EigenNear(T.adjoint().inverse().eval(), 1e-10));
  }
}

TEST(SE3, LeftPerturbationOfAPoint) {
  // d (exp(xi) T p) / d xi at 0 = [I, -[T p]_x].
  std::mt19937_64 generator(6);
  const SE3 T = SE3::exp(random_twist(generator, 5.0, 1.0));
  const Eigen::Vector3d p(1, -2, 10);
  Eigen::Matrix<double, 3, 6> analytic;
  analytic << Eigen::Matrix3d::Identity(), -skew(T * p);
  const auto f = [&](const Vector6d& xi) { return Eigen::Vector3d(SE3::exp(xi) * (T * p)); };
  EXPECT_THAT(analytic, EigenNear(numeric_jacobian(f, Vector6d::Zero().eval()), 1e-8));
}

TEST(SE3, LongProductsStayRotations) {
  Vector6d xi;
  xi << 0.1, 0, 0, 0.01, 0.02, -0.03;
  SE3 T;
  for (int i = 0; i < 100000; ++i) T = SE3::exp(xi) * T;
  EXPECT_NEAR(T.rotation().norm(), 1.0, 1e-15);
}

TEST(SE3, FromMatrixRoundTrips) {
  std::mt19937_64 generator(7);
  for (int i = 0; i < 50; ++i) {
    const SE3 T = SE3::exp(random_twist(generator, 10.0, 1.8));
    EXPECT_THAT(SE3::from_matrix(T.matrix().topRows<3>()), SE3Near(T, 1e-13));
  }
}

TEST(SE3, FromMatrixTakesTheRoundingOfTextFiles) {
  const SE3 T(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized())), {1, 2, 3});
  const Eigen::Matrix<double, 3, 4> rounded = (T.matrix().topRows<3>() * 1e6).array().round() / 1e6;
  const SE3 read = SE3::from_matrix(rounded);
  EXPECT_NEAR(read.rotation().norm(), 1.0, 1e-15);
  EXPECT_THAT(read, SE3Near(T, 2e-6));
}

TEST(SE3, IsFiniteSeesNaN) {
  EXPECT_TRUE(SE3().is_finite());
  EXPECT_FALSE(SE3(Eigen::Quaterniond::Identity(), {0, NAN, 0}).is_finite());
  EXPECT_FALSE(SE3(Eigen::Quaterniond(NAN, 0, 0, 0), {0, 0, 0}).is_finite());
}

// Davenport's q-method: the quaternion of the rotation is the eigenvector of K for the largest eigenvalue.
TEST(NearestRotation, AgreesWithDavenportsMethodForBothSignsOfTheDeterminant) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Matrix3d m = Eigen::Matrix3d::NullaryExpr([&] { return normal(random); });
    for (const Eigen::Matrix3d& matrix : {m, Eigen::Matrix3d(-m)}) {
      const Eigen::Vector3d z(matrix(2, 1) - matrix(1, 2), matrix(0, 2) - matrix(2, 0),
                              matrix(1, 0) - matrix(0, 1));
      Eigen::Matrix4d K;
      K << matrix.trace(), z.transpose(), z,
          matrix + matrix.transpose() - matrix.trace() * Eigen::Matrix3d::Identity();
      const Eigen::Vector4d q = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(K).eigenvectors().col(3);
      const Eigen::Matrix3d expected = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
      EXPECT_THAT(nearest_rotation(matrix), EigenNear(expected, 1e-9));
    }
  }
}

TEST(RotationAngle, KnownValues) {
  const auto about = [](double angle) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(3, -1, 2).normalized()));
  };
  EXPECT_EQ(rotation_angle_rad(Eigen::Quaterniond::Identity()), 0.0);
  for (const double angle : {1e-12, 1e-9, 1e-6, 1e-3, 0.5, 1.5, 3.0, pi}) {
    EXPECT_NEAR(rotation_angle_rad(about(angle)), angle, 1e-15 + 1e-15 * angle) << angle;
  }
  EXPECT_NEAR(rotation_angle_rad(about(pi + 0.5)), pi - 0.5, 1e-14);
  EXPECT_NEAR(rotation_angle_rad(about(-0.25)), 0.25, 1e-15);
}

}  // namespace
}  // namespace sextant
