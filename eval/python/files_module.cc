// Files of trajectories, flow and depth as arrays, read by the functions of `sextant evaluate`.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstring>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/python/array_arguments.h"

namespace py = pybind11;

namespace sextant {
namespace {

/// Returns the poses as an array (n, 4, 4). Rotations are the matrices as read, identities if the recording
/// has positions only.
py::array_t<double> pose_array(const PoseSeries& series) {
  py::array_t<double> out({static_cast<py::ssize_t>(series.size()), py::ssize_t{4}, py::ssize_t{4}});
  for (size_t i = 0; i < series.size(); ++i) {
    Eigen::Matrix<double, 4, 4, Eigen::RowMajor> pose = Eigen::Matrix4d::Identity();
    if (!series.rotations.empty()) pose.topLeftCorner<3, 3>() = series.rotations[i];
    pose.topRightCorner<3, 1>() = series.positions_m[i];
    std::memcpy(out.mutable_data() + 16 * i, pose.data(), sizeof(double) * 16);
  }
  return out;
}

/// Returns (poses, stamps or None, frames or None, has_rotations).
py::tuple series_of(const PoseSeries& series) {
  py::object stamps = py::none(), frames = py::none();
  if (!series.stamps_s.empty()) stamps = array_of(series.stamps_s);
  if (!series.frames.empty())
    frames = py::array_t<int>(static_cast<py::ssize_t>(series.frames.size()), series.frames.data());
  return py::make_tuple(pose_array(series), stamps, frames, series.has_rotations());
}

py::tuple trajectory(const std::string& path, const std::string& format) {
  TrajectoryFile file;
  {
    const py::gil_scoped_release others_run;
    file = read_trajectory(path, format);
  }
  return py::make_tuple(series_of(file.poses), file.truth ? py::object(series_of(*file.truth)) : py::none(),
                        file.warnings, file.format);
}

template <typename Pixel>
py::array_t<float> float_array(const Image<Pixel>& image) {
  static_assert(sizeof(Pixel) % sizeof(float) == 0);
  std::vector<py::ssize_t> shape = {image.height(), image.width()};
  if (sizeof(Pixel) > sizeof(float)) shape.push_back(sizeof(Pixel) / sizeof(float));
  py::array_t<float> out(shape);
  std::memcpy(out.mutable_data(), image.data(), image.size() * sizeof(Pixel));
  return out;
}

py::array_t<float> flow(const std::string& path, const std::string& format) {
  Image<Flow> image;
  {
    const py::gil_scoped_release others_run;
    const std::string bytes = read_file(path);
    image = format == "flo"     ? decode_flo(bytes, path)
            : format == "kitti" ? flow_from_kitti(decode_png_rgb16(bytes, path))
                                : flow_from_vkitti(decode_png_rgb16(bytes, path));
  }
  return float_array(image);
}

py::array_t<float> depth(const std::string& path, const std::string& format, double bf) {
  Image<float> image;
  {
    const py::gil_scoped_release others_run;
    const Image<uint16_t> values = decode_png16(read_file(path), path);
    image = format == "depth256" ? depth_from_depth256(values)
            : format == "cm"     ? depth_from_cm(values)
                                 : depth_from_disparity256(values, bf);
  }
  return float_array(image);
}

}  // namespace
}  // namespace sextant

PYBIND11_MODULE(_files, files) {
  files.doc() = "Readers of trajectories, flow and depth, for the sextant package.";
  py::module_::import("sextant._core");  // defines Error
  files.def("trajectory", sextant::trajectory);
  files.def("flow", sextant::flow);
  files.def("depth", sextant::depth);
}
