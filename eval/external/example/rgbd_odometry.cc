// A small RGB-D odometry that knows nothing of Sextant: an example of an external estimator
// (docs/external-estimators.md). It reads a VDO-SLAM folder (depth, flow, semantic, camera.yaml) and
// estimates the motion of the camera and of every object from frame to frame by PnP: pixels of the previous
// frame with their depth, and the pixels to which the flow takes them.
//
// usage: rgbd_odometry INPUT OUTPUT
// writes OUTPUT/camera.txt: frame and 12 values of T_world_camera, OUTPUT/obj_<id>.txt: frame k and 12 values
// of the motion from k-1 to k in the world.

#include <filesystem>
#include <iostream>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

#include "example_files.h"

struct Points {
  std::vector<cv::Point3d> before;  // previous camera coordinates, m
  std::vector<cv::Point2d> after;   // px in the current image
};

// Returns the points of every third pixel in x and y, by id; 0 is the background.
std::map<int, Points> sample(const cv::Mat1w& disparity, const cv::Mat2f& flow, const cv::Mat1w& mask,
                             const cv::Mat1w& mask_after, const Camera& camera) {
  std::map<int, Points> points;
  for (int y = 1; y < mask.rows; y += 3) {
    for (int x = 1; x < mask.cols; x += 3) {
      const int id = mask(y, x);
      const double z = camera.bf * 256 / disparity(y, x);
      const cv::Point2d to = cv::Point2d(x, y) + cv::Point2d(flow(y, x));
      const bool inside = to.x >= 0 && to.y >= 0 && to.x < mask.cols - 0.5 && to.y < mask.rows - 0.5;
      if (disparity(y, x) == 0 || z > 40 || !inside || mask_after(cvRound(to.y), cvRound(to.x)) != id)
        continue;
      points[id].before.emplace_back((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
      points[id].after.push_back(to);
    }
  }
  return points;
}

// Estimates the motion of points from previous to current camera coordinates; returns false if that fails.
bool estimate(const Points& points, const Camera& camera, cv::Matx44d& motion) {
  if (points.before.size() < 50) return false;
  const cv::Matx33d k(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Vec3d rotation, translation;
  cv::Mat inliers;
  cv::setRNGSeed(1);
  if (!cv::solvePnPRansac(points.before, points.after, k, {}, rotation, translation, false, 200, 1.5, 0.999,
                          inliers, cv::SOLVEPNP_AP3P) ||
      inliers.rows < 30) {
    return false;
  }
  Points good;
  for (const int i : cv::Mat1i(inliers)) {
    good.before.push_back(points.before[static_cast<size_t>(i)]);
    good.after.push_back(points.after[static_cast<size_t>(i)]);
  }
  cv::solvePnPRefineLM(good.before, good.after, k, {}, rotation, translation);
  motion = pose_of(rotation, translation);
  return true;
}

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: rgbd_odometry INPUT OUTPUT");
  const std::string input = argv[1];
  const std::filesystem::path output = argv[2];
  cv::setNumThreads(1);
  const Camera camera = read_camera(input + "/camera.yaml");
  std::vector<cv::String> files;
  cv::glob(input + "/depth/*.png", files);
  cv::Mat1w mask_before;
  cv::Matx44d T_world_camera = cv::Matx44d::eye();
  for (size_t i = 0; i < files.size(); ++i) {
    const std::string name = std::filesystem::path(files[i]).stem();
    const int frame = std::stoi(name);
    const cv::Mat1w disparity = cv::imread(files[i], cv::IMREAD_UNCHANGED);
    const cv::Mat1w mask = read_mask(input + "/semantic/" + name + ".txt", disparity.size());
    if (i > 0) {
      const std::string before = std::filesystem::path(files[i - 1]).stem();
      const auto points = sample(cv::imread(files[i - 1], cv::IMREAD_UNCHANGED),
                                 read_flow(input + "/flow/" + before + ".flo"), mask_before, mask, camera);
      cv::Matx44d background;
      if (!points.contains(0) || !estimate(points.at(0), camera, background)) {
        std::cerr << "lost at frame " << frame << '\n';
        return 1;
      }
      const cv::Matx44d T_world_before = T_world_camera;
      T_world_camera = T_world_before * background.inv();
      for (const auto& [id, of_object] : points) {
        cv::Matx44d motion;
        if (id != 0 && estimate(of_object, camera, motion))
          write(output / ("obj_" + std::to_string(id) + ".txt"), frame,
                T_world_camera * motion * T_world_before.inv());
      }
    }
    write(output / "camera.txt", frame, T_world_camera);
    mask_before = mask;
  }
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
