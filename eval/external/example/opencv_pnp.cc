// Visual odometry as a newcomer would write it with OpenCV: corners of the previous image with their depth,
// the flow to the current image, solvePnPRansac (AP3P) and solvePnPRefineLM on its inliers, for the camera
// and for every object. It knows nothing of Sextant (docs/external-estimators.md) and is the reference
// "OpenCV PnP" of `sextant benchmark`.
//
// usage: opencv_pnp INPUT OUTPUT
// INPUT is a VDO-SLAM folder; writes OUTPUT/camera.txt: frame and 12 values of T_world_camera,
// OUTPUT/obj_<id>.txt: frame k and 12 values of the object's motion in the camera frame, T_curr_prev.

#include <filesystem>
#include <iostream>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "example_files.h"

constexpr int max_corners = 2000;  // of each body
constexpr double corner_quality = 0.001, corner_distance_px = 5;
constexpr double inlier_px = 4;  // of RANSAC; OpenCV's default is 8
constexpr int min_points = 10;
constexpr double max_depth_m = 40;

struct FrameData {
  cv::Mat1b image;
  cv::Mat1w disparity;  // px * 256; 0 is invalid
  cv::Mat1w mask;       // instance ids; 0 is the background
};

FrameData read_frame(const std::string& input, const std::string& name) {
  FrameData frame;
  frame.image = cv::imread(input + "/image_0/" + name + ".png", cv::IMREAD_GRAYSCALE);
  frame.disparity = cv::imread(input + "/depth/" + name + ".png", cv::IMREAD_UNCHANGED);
  if (frame.image.empty() || frame.disparity.empty())
    throw std::runtime_error(name + ": the image or depth cannot be read");
  frame.mask = read_mask(input + "/semantic/" + name + ".txt", frame.image.size());
  return frame;
}

// Estimates T_curr_prev of the body with this id by PnP; returns false if that fails.
bool estimate(const FrameData& before, const FrameData& after, const cv::Mat2f& flow, int id,
              const Camera& camera, cv::Matx44d& T_curr_prev) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(before.image, corners, max_corners, corner_quality, corner_distance_px,
                          before.mask == id);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const cv::Point2f& corner : corners) {
    const cv::Point at(cvRound(corner.x), cvRound(corner.y));
    const double z = before.disparity(at) == 0 ? 0 : camera.bf * 256 / before.disparity(at);
    const cv::Point2d to = cv::Point2d(at) + cv::Point2d(flow(at));
    const bool inside =
        to.x >= 0 && to.y >= 0 && to.x < after.mask.cols - 0.5 && to.y < after.mask.rows - 0.5;
    if (z <= 0 || z > max_depth_m || !inside || after.mask(cvRound(to.y), cvRound(to.x)) != id) continue;
    points.emplace_back((at.x - camera.cx) / camera.fx * z, (at.y - camera.cy) / camera.fy * z, z);
    pixels.push_back(to);
  }
  if (points.size() < min_points) return false;
  const cv::Matx33d k(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Vec3d rotation, translation;
  std::vector<int> inliers;
  cv::setRNGSeed(1);
  if (!cv::solvePnPRansac(points, pixels, k, {}, rotation, translation, false, 500, inlier_px, 0.99, inliers,
                          cv::SOLVEPNP_AP3P) ||
      inliers.size() < min_points)
    return false;
  std::vector<cv::Point3d> good_points;
  std::vector<cv::Point2d> good_pixels;
  for (const int i : inliers) {
    good_points.push_back(points[static_cast<size_t>(i)]);
    good_pixels.push_back(pixels[static_cast<size_t>(i)]);
  }
  cv::solvePnPRefineLM(good_points, good_pixels, k, {}, rotation, translation);
  T_curr_prev = pose_of(rotation, translation);
  return true;
}

std::set<int> ids_of(const cv::Mat1w& mask) {
  const std::set<int> ids(mask.begin(), mask.end());
  return ids;
}

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: opencv_pnp INPUT OUTPUT");
  const std::string input = argv[1];
  const std::filesystem::path output = argv[2];
  cv::setNumThreads(1);
  const Camera camera = read_camera(input + "/camera.yaml");
  std::vector<cv::String> files;
  cv::glob(input + "/depth/*.png", files);
  cv::Matx44d T_world_camera = cv::Matx44d::eye();
  FrameData before;
  std::string name_before;
  for (const cv::String& file : files) {
    const std::string name = std::filesystem::path(file).stem();
    FrameData frame = read_frame(input, name);
    if (!before.image.empty()) {
      const cv::Mat2f flow = read_flow(input + "/flow/" + name_before + ".flo");
      for (const int id : ids_of(before.mask)) {
        cv::Matx44d T_curr_prev;
        const bool found = estimate(before, frame, flow, id, camera, T_curr_prev);
        if (id == 0 && !found) throw std::runtime_error("lost at frame " + name);
        if (id == 0) T_world_camera = T_world_camera * T_curr_prev.inv();
        if (id != 0 && found)
          write(output / ("obj_" + std::to_string(id) + ".txt"), std::stoi(name), T_curr_prev);
      }
    }
    write(output / "camera.txt", std::stoi(name), T_world_camera);
    before = std::move(frame);
    name_before = name;
  }
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
