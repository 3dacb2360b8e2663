#include "sextant/geometry/axes.h"

#include <gtest/gtest.h>

#include "sextant/base/error.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

TEST(Axes, ForwardAndUpAreWhereTheNamesSay) {
  const Eigen::Vector3d forward(0, 0, 1), up(0, -1, 0);  // right, down, forward
  EXPECT_EQ(opencv_from_axes(Axes::opengl) * Eigen::Vector3d(0, 0, -1), forward);
  EXPECT_EQ(opencv_from_axes(Axes::opengl) * Eigen::Vector3d(0, 1, 0), up);
  EXPECT_EQ(opencv_from_axes(Axes::ned) * Eigen::Vector3d(1, 0, 0), forward);
  EXPECT_EQ(opencv_from_axes(Axes::ned) * Eigen::Vector3d(0, 0, -1), up);
  EXPECT_EQ(opencv_from_axes(Axes::flu) * Eigen::Vector3d(1, 0, 0), forward);
  EXPECT_EQ(opencv_from_axes(Axes::flu) * Eigen::Vector3d(0, 0, 1), up);
}

TEST(Axes, AreRightHandedAndExact) {
  for (const std::string_view name : names_of(Axes{})) {
    const Eigen::Matrix3d R = opencv_from_axes(from_name<Axes>(name, "axes"));
    EXPECT_EQ(R * R.transpose(), Eigen::Matrix3d::Identity()) << name;
    EXPECT_EQ(R.determinant(), 1) << name;
  }
  EXPECT_THROW(from_name<Axes>("enu", "axes"), Error);
}

}  // namespace
}  // namespace sextant
