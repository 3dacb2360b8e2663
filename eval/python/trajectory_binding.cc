#include <pybind11/stl.h>

#include <algorithm>
#include <array>

#include "sextant/eval/python/array_arguments.h"
#include "sextant/eval/python/bindings.h"
#include "sextant/metrics/kitti_odometry.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_association.h"
#include "sextant/metrics/trajectory_errors.h"

namespace py = pybind11;

namespace sextant {
namespace {

struct Paths {
  PoseSeries estimate, reference;

  Paths(const py::object& estimate_array, const py::object& reference_array)
      : estimate(path_of(estimate_array, "estimate")), reference(path_of(reference_array, "reference")) {
    if (estimate.size() != reference.size())
      fail("estimate: expected as many poses as the reference has, {}, got {}", reference.size(),
           estimate.size());
  }
};

py::array_t<double> array_of_path(const PoseSeries& path) {
  const auto n = static_cast<py::ssize_t>(path.size());
  py::array_t<double> out({n, py::ssize_t{4}, py::ssize_t{4}});
  auto at = out.mutable_unchecked<3>();
  for (py::ssize_t i = 0; i < n; ++i) {
    const auto& R = path.rotations[static_cast<size_t>(i)];
    const auto& p = path.positions_m[static_cast<size_t>(i)];
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column)
        at(i, row, column) = row == 3 ? (column == 3 ? 1 : 0) : column == 3 ? p[row] : R(row, column);
    }
  }
  return out;
}

py::array_t<double> absolute(const py::object& estimate, const py::object& reference,
                             const std::string& relation) {
  const Paths paths(estimate, reference);
  const auto kind = from_name<PoseRelation>(relation, "relation");
  if (kind == PoseRelation::point_distance_error_ratio)
    fail("relation: point_distance_error_ratio is of relative errors: use relative_errors");
  return array_of(absolute_errors(paths.estimate, paths.reference, kind));
}

std::vector<double> stamps_of(const py::object& value, const std::string& name) {
  const py::array array = finite_numbers(value, name, {-1}, "(n,)");
  const auto* first = static_cast<const double*>(array.data());
  std::vector<double> stamps(first, first + array.size());
  if (!std::ranges::is_sorted(stamps)) fail("{}: expected time stamps that rise, got some that do not", name);
  return stamps;
}

/// "10m" and its like; the program's flag for it is called --rpe.
PairSelection selection_of(const std::string& delta) {
  try {
    return PairSelection::parse(delta);
  } catch (const Error&) {
    fail("delta: expected a number and a unit: 1f (frames), 10m, 5deg, 0.5rad or 2s, got '{}'", delta);
  }
}

/// Of relative errors: the errors, and the pairs (i, j) that they are of.
py::tuple relative(const py::object& estimate, const py::object& reference, const std::string& delta,
                   bool all_pairs, double tolerance, bool pairs_from_reference, const std::string& relation,
                   const py::object& stamps) {
  Paths paths(estimate, reference);
  PairSelection selection = selection_of(delta);
  selection.all_pairs = all_pairs;
  selection.relative_tolerance = tolerance;
  if (!stamps.is_none()) {
    paths.estimate.stamps_s = paths.reference.stamps_s = stamps_of(stamps, "stamps");
    if (paths.estimate.stamps_s.size() != paths.estimate.size())
      fail("stamps: expected {}, one a pose, got {}", paths.estimate.size(), paths.estimate.stamps_s.size());
  }
  const auto kind = from_name<PoseRelation>(relation, "relation");
  std::vector<PosePair> pairs =
      select_pairs(pairs_from_reference ? paths.reference : paths.estimate, selection);
  if (kind == PoseRelation::point_distance_error_ratio) {
    std::erase_if(pairs, [&](const PosePair& pair) { return pair_distance_m(paths.reference, pair) == 0; });
    if (pairs.empty()) fail("reference: moves between no pair of poses: use relation='point_distance'");
  }
  const auto n = static_cast<py::ssize_t>(pairs.size());
  py::array_t<int64_t> of_pairs({n, py::ssize_t{2}});
  for (py::ssize_t i = 0; i < n; ++i) {
    of_pairs.mutable_at(i, 0) = pairs[static_cast<size_t>(i)].first;
    of_pairs.mutable_at(i, 1) = pairs[static_cast<size_t>(i)].second;
  }
  return py::make_tuple(array_of(relative_errors(paths.estimate, paths.reference, pairs, kind)), of_pairs);
}

/// The estimate moved, [s R | t], its scale, and the flatness of the points.
py::tuple aligned(const py::object& estimate, const py::object& reference, const std::string& method,
                  int first_n, const std::optional<std::array<double, 3>>& up) {
  Paths paths(estimate, reference);
  const auto how = from_name<Alignment>(method, "alignment");
  if ((how == Alignment::yaw) != up.has_value())
    fail(
        "up: expected with align='yaw', and only there: the direction up in both worlds, (0, 0, 1) where z points up");
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  if (up) {
    axis = Eigen::Vector3d((*up)[0], (*up)[1], (*up)[2]);
    if (!axis.allFinite() || axis.norm() < 1e-6)
      fail("up: expected a direction, got a vector of length {}", axis.norm());
    axis.normalize();
  }
  if (first_n < 0) fail("n_to_align: expected 0 (all poses) or more, got {}", first_n);
  const AlignmentResult result = align(paths.estimate, paths.reference, how, first_n, axis);
  return py::make_tuple(array_of_path(paths.estimate), array_of(result.ref_from_est.matrix()),
                        result.ref_from_est.scale, result.flatness);
}

py::tuple statistics(const py::object& errors) {
  const py::array array = finite_numbers(errors, "errors", {-1}, "(n,)");
  const ErrorStatistics s =
      error_statistics({static_cast<const double*>(array.data()), static_cast<size_t>(array.size())});
  return py::make_tuple(s.rmse, s.mean, s.median, s.std, s.min, s.max, s.sse);
}

py::list kitti(const py::object& estimate, const py::object& reference) {
  const Paths paths(estimate, reference);
  const KittiOdometryErrors errors = kitti_odometry_errors(paths.estimate, paths.reference);
  py::list rows;
  const auto add = [&](const KittiOdometryError& e) {
    rows.append(py::make_tuple(e.length_m, e.n, e.translation_percent, e.rotation_deg_per_m));
  };
  add(errors.all);
  for (const KittiOdometryError& e : errors.by_length) add(e);
  return rows;
}

py::tuple associate(const py::object& reference, const py::object& estimate, double max_difference,
                    double offset) {
  AssociationOptions options;
  options.max_difference_s = max_difference;
  options.offset_s = offset;
  const Association found = associate_by_time(stamps_of(reference, "reference_stamps"),
                                              stamps_of(estimate, "estimate_stamps"), options);
  const auto rows = [](const std::vector<int>& places) {
    return py::array_t<int>(static_cast<py::ssize_t>(places.size()), places.data());
  };
  return py::make_tuple(rows(found.reference), rows(found.estimate));
}

}  // namespace

void bind_trajectories(py::module_& core) {
  core.def("absolute_errors", absolute);
  core.def("relative_errors", relative);
  core.def("align", aligned);
  core.def("statistics", statistics);
  core.def("kitti_odometry", kitti);
  core.def("associate", associate);
  core.def("unit_of", [](const std::string& relation) {
    return std::string(unit_of(from_name<PoseRelation>(relation, "relation")));
  });
}

}  // namespace sextant
