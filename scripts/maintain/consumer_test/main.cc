#include <cstdio>

#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"

int main() {
  sextant::Problem problem;
  problem.camera = {{700, 700, 320, 240}, 350};
  problem.camera.check();
  sextant::Vector6d xi;
  xi << 1, 2, 3, 0.1, 0.2, 0.3;
  const double error = (sextant::SE3::exp(xi).log() - xi).norm();
  std::printf("exp/log error %.1e\n", error);
  return error < 1e-12 ? 0 : 1;
}
