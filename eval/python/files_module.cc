// Files of trajectories, flow and depth as arrays, read by the functions of `sextant evaluate`, and its
// evaluation of trajectories.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/python/array_arguments.h"

namespace py = pybind11;

namespace sextant {
namespace {

/// Returns (poses, stamps or None, frames or None, has_rotations).
py::tuple series_of(const PoseSeries& series) {
  py::object stamps = py::none(), frames = py::none();
  if (!series.stamps_s.empty()) stamps = array_of(series.stamps_s);
  if (!series.frames.empty()) frames = array_of(series.frames);
  return py::make_tuple(array_of(series), stamps, frames, series.has_rotations());
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

/// Converts what series_of() returns.
PoseSeries series_from(const py::tuple& values, const std::string& name) {
  PoseSeries series = path_of(values[0], name);
  if (!values[1].is_none()) series.stamps_s = values[1].cast<std::vector<double>>();
  if (!values[2].is_none()) series.frames = values[2].cast<std::vector<int>>();
  if (!values[3].cast<bool>()) series.rotations.clear();
  return series;
}

/// Evaluates as `sextant evaluate ego` does; returns (errors, pairs or None, matched and aligned estimate,
/// matched reference, warnings).
py::tuple evaluate(const py::tuple& estimate, const py::tuple& reference, const std::string& alignment,
                   int n_to_align, const std::optional<std::array<double, 3>>& up,
                   const std::string& relation, const std::optional<std::string>& delta, bool all_pairs,
                   double max_difference_s, double offset_s, double max_speed_m_s) {
  EgoOptions options{.alignment = from_name<Alignment>(alignment, "alignment"),
                     .n_to_align = n_to_align,
                     .relation = from_name<PoseRelation>(relation, "relation")};
  if (up) options.up = Eigen::Vector3d((*up)[0], (*up)[1], (*up)[2]).normalized();
  if (delta) {
    options.rpe_lengths = {selection_of(*delta)};
    options.rpe_lengths.front().all_pairs = all_pairs;
  }
  options.association.max_difference_s = max_difference_s;
  options.association.offset_s = offset_s;
  TrajectoryFile file{.poses = series_from(estimate, "estimate")};
  const EgoReference truth{.poses = series_from(reference, "reference"), .side = {.name = "path"}};
  EgoResult found;
  {
    const py::gil_scoped_release others_run;
    check_physical(truth.poses, "reference", max_speed_m_s);
    found = evaluate_ego(truth, std::move(file), "estimate", options);
  }
  py::list warnings;
  for (const DataWarning& warning : found.warnings) warnings.append(warning.text);
  return py::make_tuple(array_of(found.errors), delta ? py::object(array_of(found.pairs)) : py::none(),
                        array_of(found.estimate), array_of(found.reference), warnings);
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
  return array_of<float>(image);
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
  return array_of<float>(image);
}

}  // namespace
}  // namespace sextant

PYBIND11_MODULE(_files, files) {
  files.doc() = "Readers of trajectories, flow and depth, for the sextant package.";
  py::module_::import("sextant._core");  // defines Error
  files.def("trajectory", sextant::trajectory);
  files.def("evaluate", sextant::evaluate);
  files.def("flow", sextant::flow);
  files.def("depth", sextant::depth);
}
