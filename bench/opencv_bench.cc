// Our own implementations compared with OpenCV's: corners of one image, and motions through three points
// (P3P).

#include <benchmark/benchmark.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <random>

#include "sextant/estimator/points/extraction.h"
#include "sextant/estimator/solvers/testing.h"
#include "sextant/estimator/start/robust_start.h"

namespace sextant {
namespace {

constexpr int image_width = 1242;
constexpr int image_height = 375;
constexpr int threshold = 20;
constexpr size_t n_samples = 1000;

/// Squares of random gray with noise on them: about as many corners as a street has.
Image<uint8_t> make_image() {
  std::mt19937 engine(1);
  std::vector<uint8_t> gray(static_cast<size_t>(image_width) * image_height / 64 + image_width);
  for (uint8_t& g : gray) g = static_cast<uint8_t>(40 + engine() % 160);
  return image_of(image_width, image_height, [&](int x, int y) {
    const size_t square = static_cast<size_t>(y / 8) * (image_width / 8 + 1) + static_cast<size_t>(x / 8);
    return static_cast<uint8_t>(gray[square] + engine() % 8);
  });
}

void corners(benchmark::State& state) {
  const Image<uint8_t> image = make_image();
  size_t n = 0;
  for (auto _ : state) n = fast_corners(image, threshold).size();
  state.counters["corners"] = static_cast<double>(n);
}

void corners_opencv(benchmark::State& state) {
  Image<uint8_t> image = make_image();
  const cv::Mat view(image_height, image_width, CV_8UC1, image.data());
  cv::setNumThreads(1);
  std::vector<cv::KeyPoint> found;
  for (auto _ : state) cv::FAST(view, found, threshold, /*nonmaxSuppression=*/true);
  state.counters["corners"] = static_cast<double>(found.size());
}

struct Sample {
  std::array<Eigen::Vector3d, 3> points, rays;
};

std::vector<Sample> make_samples() {
  const RandomProblem random =
      make_random_problem(1, {.n_points = static_cast<int>(3 * n_samples), .flow_noise_px = 0.3});
  const PinholeCamera& camera = random.problem.camera.left;
  const Correspondences& p = random.problem.points;
  std::vector<Sample> samples(n_samples);
  for (size_t i = 0; i < p.size(); ++i) {
    samples[i / 3].points[i % 3] = camera.backproject(p.u[i], p.v[i], p.depth[i]);
    samples[i / 3].rays[i % 3] = camera.ray(p.u[i] + p.flow_u[i], p.v[i] + p.flow_v[i]).normalized();
  }
  return samples;
}

void p3p(benchmark::State& state) {
  const std::vector<Sample> samples = make_samples();
  for (auto _ : state) {
    for (const Sample& s : samples) benchmark::DoNotOptimize(P3PSolutions(s.points, s.rays).size());
  }
}

void p3p_opencv(benchmark::State& state) {
  std::vector<std::array<cv::Point3d, 3>> points;
  std::vector<std::array<cv::Point2d, 3>> pixels;
  for (const Sample& s : make_samples()) {
    for (size_t k = 0; k < 3; ++k) {
      if (k == 0) points.emplace_back(), pixels.emplace_back();
      points.back()[k] = {s.points[k].x(), s.points[k].y(), s.points[k].z()};
      pixels.back()[k] = {s.rays[k].x() / s.rays[k].z(), s.rays[k].y() / s.rays[k].z()};
    }
  }
  std::vector<cv::Mat> rotations, translations;
  for (auto _ : state) {
    for (size_t i = 0; i < n_samples; ++i)
      benchmark::DoNotOptimize(cv::solveP3P(points[i], pixels[i], cv::Matx33d::eye(), cv::noArray(),
                                            rotations, translations, cv::SOLVEPNP_AP3P));
  }
}

BENCHMARK(corners)->Unit(benchmark::kMillisecond);
BENCHMARK(corners_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(p3p)->Unit(benchmark::kMillisecond);
BENCHMARK(p3p_opencv)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sextant
