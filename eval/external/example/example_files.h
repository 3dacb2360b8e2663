#pragma once

// Files that the examples of external estimators read and write: a VDO-SLAM folder (depth, flow, semantic,
// camera.yaml), and files of poses and motions. Needs OpenCV and nothing of Sextant.

#include <filesystem>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

struct Camera {
  double fx, fy, cx, cy, bf;
};

inline Camera read_camera(const std::string& path) {
  const cv::FileStorage file(path, cv::FileStorage::READ);
  return {file["Camera.fx"], file["Camera.fy"], file["Camera.cx"], file["Camera.cy"], file["Camera.bf"]};
}

inline cv::Mat2f read_flow(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  float magic = 0;
  int size[2] = {0, 0};
  file.read(reinterpret_cast<char*>(&magic), 4).read(reinterpret_cast<char*>(size), 8);
  cv::Mat2f flow(size[1], size[0]);
  file.read(reinterpret_cast<char*>(flow.data), static_cast<std::streamsize>(flow.total() * 8));
  if (!file || magic != 202021.25f) throw std::runtime_error(path + ": is not a complete .flo file");
  return flow;
}

inline cv::Mat1w read_mask(const std::string& path, cv::Size size) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  cv::Mat1w mask(size);
  for (unsigned short& id : mask) text >> id;
  if (!text) throw std::runtime_error(path + ": does not contain an id for every pixel");
  return mask;
}

/// Returns the matrix of a rotation vector and a translation, as solvePnP returns them.
inline cv::Matx44d pose_of(const cv::Vec3d& rotation, const cv::Vec3d& translation) {
  cv::Matx33d r;
  cv::Rodrigues(rotation, r);
  return {r(0, 0), r(0, 1), r(0, 2), translation[0], r(1, 0), r(1, 1), r(1, 2), translation[1],
          r(2, 0), r(2, 1), r(2, 2), translation[2], 0,       0,       0,       1};
}

// Appends a line with the frame and the 12 values of a pose or motion.
inline void write(const std::filesystem::path& file, int frame, const cv::Matx44d& pose) {
  std::ofstream out(file, std::ios::app);
  out.precision(17);
  out << frame;
  for (int i = 0; i < 12; ++i) out << ' ' << pose.val[i];
  out << '\n';
}
