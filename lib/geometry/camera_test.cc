#include "sextant/geometry/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

const PinholeCamera camera{721.5, 718.25, 609.5, 172.75};
const StereoCamera stereo{camera, 387.57};
const std::vector<Eigen::Vector3d> points = {
    {0, 0, 5}, {1, -2, 8}, {-12, 3, 40}, {0.2, 0.1, 0.9}, {30, -4, 120}};

TEST(PinholeCamera, ThePrincipalPointLooksForward) {
  EXPECT_THAT(camera.project({0, 0, 7}), EigenNear(Eigen::Vector2d(609.5, 172.75), 0.0));
  // x right, y down.
  EXPECT_GT(camera.project({1, 0, 7}).x(), 609.5);
  EXPECT_GT(camera.project({0, 1, 7}).y(), 172.75);
  EXPECT_THAT(camera.project({1, 2, 4}),
              EigenNear(Eigen::Vector2d(609.5 + 721.5 / 4, 172.75 + 718.25 / 2), 1e-12));
}

TEST(PinholeCamera, BackprojectInvertsProject) {
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d uv = camera.project(p);
    EXPECT_THAT(camera.backproject(uv.x(), uv.y(), p.z()), EigenNear(p, 1e-12));
    EXPECT_EQ(camera.ray(uv.x(), uv.y()).z(), 1.0);
  }
}

TEST(PinholeCamera, ProjectJacobian) {
  for (const Eigen::Vector3d& p : points) {
    const auto f = [](const Eigen::Vector3d& x) { return camera.project(x); };
    EXPECT_THAT(camera.project_jacobian(p), EigenNear(numeric_jacobian(f, p), 1e-5)) << p.transpose();
  }
}

TEST(PinholeCamera, CheckRefusesImpossibleNumbers) {
  EXPECT_NO_THROW(camera.check());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const PinholeCamera& bad : {PinholeCamera{}, PinholeCamera{0, 700, 1, 1}, PinholeCamera{700, -1, 1, 1},
                                   PinholeCamera{nan, 700, 1, 1}, PinholeCamera{700, 700, infinity, 1}}) {
    EXPECT_THROW(bad.check(), Error);
  }
}

TEST(StereoCamera, DisparityAndDepthAreInverse) {
  for (const double z : {0.5, 4.0, 20.0, 300.0})
    EXPECT_NEAR(stereo.depth_m(stereo.disparity_px(z)), z, 1e-12 * z);
  EXPECT_DOUBLE_EQ(stereo.disparity_px(387.57), 1.0);
}

TEST(StereoCamera, DepthSigmaOfThePaper) {
  // z = 20 m, f = 725 px, b = 0.5 m, delta_d = 0.2 px: 400 / 362.5 * 0.2 m.
  const StereoCamera vkitti{{725, 725, 620.5, 187}, 725 * 0.5};
  EXPECT_NEAR(vkitti.depth_sigma_m(20, 0.2), 0.2207, 5e-5);
  EXPECT_DOUBLE_EQ(vkitti.depth_sigma_m(20, 0.2), 80.0 / 362.5);
  // First-order propagation: sigma = |d depth / d disparity| * delta_d.
  const double disparity = vkitti.disparity_px(33);
  const double slope = (vkitti.depth_m(disparity + 1e-4) - vkitti.depth_m(disparity - 1e-4)) / 2e-4;
  EXPECT_NEAR(vkitti.depth_sigma_m(33, 0.15), std::abs(slope) * 0.15, 1e-8);
}

TEST(StereoCamera, CheckRefusesImpossibleNumbers) {
  EXPECT_NO_THROW(stereo.check());
  EXPECT_THROW((StereoCamera{camera, 0}).check(), Error);
  EXPECT_THROW((StereoCamera{camera, -1}).check(), Error);
  EXPECT_THROW((StereoCamera{camera, std::numeric_limits<double>::quiet_NaN()}).check(), Error);
  EXPECT_THROW((StereoCamera{PinholeCamera{}, 387}).check(), Error);
}

}  // namespace
}  // namespace sextant
