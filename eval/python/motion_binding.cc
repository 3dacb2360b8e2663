#include <pybind11/stl.h>

#include <algorithm>
#include <array>

#include "sextant/eval/python/array_arguments.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/crlb.h"
#include "sextant/metrics/pair_errors.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_errors.h"

namespace py = pybind11;

namespace sextant {
namespace {

using Motions = std::vector<SE3>;

void expect_count(const Motions& motions, size_t n, const std::string& name) {
  if (motions.size() != n) fail("{}: expected {} motions, one per step, got {}", name, n, motions.size());
}

/// Returns E_t (m) and E_R (deg) of each pair.
py::tuple pose_changes(const Motions& estimates, const Motions& truths) {
  std::vector<double> Et_m, ER_deg;
  for (size_t i = 0; i < estimates.size(); ++i) {
    const PoseChangeError e = pose_change_error(estimates[i], truths[i]);
    Et_m.push_back(e.Et_m);
    ER_deg.push_back(e.ER_deg);
  }
  return py::make_tuple(array_of(Et_m), array_of(ER_deg));
}

py::tuple pose_change_errors(const py::object& estimate, const py::object& truth) {
  const Motions estimates = rigid_motions_of(estimate, "estimate"), truths = rigid_motions_of(truth, "truth");
  expect_count(estimates, truths.size(), "estimate");
  return pose_changes(estimates, truths);
}

struct Cameras {
  Motions before, after;
};

std::optional<Cameras> cameras_of(const py::object& pair, const std::string& name, size_t n) {
  if (pair.is_none()) return std::nullopt;
  if (!py::isinstance<py::tuple>(pair) || py::len(pair) != 2)
    fail("{}: expected a tuple (previous, current) of arrays (n, 4, 4), got {}", name,
         std::string(py::str(py::type::handle_of(pair).attr("__name__"))));
  Cameras cameras{rigid_motions_of(pair[py::int_(0)], name + "[0]"),
                  rigid_motions_of(pair[py::int_(1)], name + "[1]")};
  expect_count(cameras.before, n, name + "[0]");
  expect_count(cameras.after, n, name + "[1]");
  return cameras;
}

/// Returns inverse(T_k) H T_k-1 of each motion H in the world: the motion as the camera sees it.
Motions seen_from(const Cameras& cameras, const Motions& world) {
  Motions seen;
  for (size_t i = 0; i < world.size(); ++i)
    seen.push_back(cameras.after[i].inverse() * world[i] * cameras.before[i]);
  return seen;
}

/// Returns errors of motions H in the world, with the definitions of `sextant evaluate objects`
/// (docs/metrics.md).
py::dict object_errors(const py::object& estimate, const py::object& truth, const py::object& pose,
                       double dt_s, const py::object& camera, const py::object& true_camera) {
  if (!(dt_s > 0 && std::isfinite(dt_s))) fail("dt: expected seconds above 0, got {}", dt_s);
  const Motions H = rigid_motions_of(estimate, "estimate"), H_true = rigid_motions_of(truth, "truth");
  expect_count(H, H_true.size(), "estimate");
  py::dict errors;
  const auto put = [&](const char* Et, const char* ER, const Motions& a, const Motions& b) {
    const py::tuple both = pose_changes(a, b);
    errors[Et] = both[0];
    errors[ER] = both[1];
  };
  put("Et_world_m", "ER_world_deg", H, H_true);
  const auto of_estimate = cameras_of(camera, "camera", H.size());
  const auto of_truth = cameras_of(true_camera, "true_camera", H.size());
  if (of_estimate || of_truth) {
    const Cameras& with = of_estimate ? *of_estimate : *of_truth;
    put("Et_m", "ER_deg", seen_from(with, H), seen_from(of_truth ? *of_truth : *of_estimate, H_true));
  }
  if (pose.is_none()) return errors;
  const Motions L = rigid_motions_of(pose, "object_pose");
  expect_count(L, H.size(), "object_pose");
  Motions body, body_true;
  std::vector<double> v, v_true, Ev;
  for (size_t i = 0; i < H.size(); ++i) {
    body.push_back(body_motion(H[i], L[i]));
    body_true.push_back(body_motion(H_true[i], L[i]));
    v.push_back(velocity_kmh(body.back(), Eigen::Vector3d::Zero(), dt_s));
    v_true.push_back(velocity_kmh(body_true.back(), Eigen::Vector3d::Zero(), dt_s));
    Ev.push_back(velocity_error_kmh(v.back(), v_true.back()));
  }
  put("Et_body_m", "ER_body_deg", body, body_true);
  errors["v_kmh"] = array_of(v);
  errors["v_gt_kmh"] = array_of(v_true);
  errors["Ev_kmh"] = array_of(Ev);
  return errors;
}

/// Converts points to Correspondences; flow and pixels are (n, 2).
Correspondences points_of(const py::object& pixels, const py::object& depth, const py::object& flow,
                          const py::object& depth_curr) {
  const py::array p = finite_numbers(pixels, "pixels", {-1, 2}, "(n, 2)");
  const py::ssize_t n = p.shape(0);
  const py::array f = finite_numbers(flow, "flow", {n, 2}, fmt::format("({}, 2), as many as pixels", n));
  const std::string as_many = fmt::format("({},), as many as pixels", n);
  const py::array z = finite_numbers(depth, "depth", {n}, as_many);
  const std::string bad = places_of<double>(z, [](double value) { return !(value > 0); });
  if (!bad.empty()) fail("depth: expected depths above 0 m, got {}", bad);
  Correspondences points;
  points.reserve(static_cast<size_t>(n));
  const auto* uv = static_cast<const double*>(p.data());
  const auto* phi = static_cast<const double*>(f.data());
  const auto* d = static_cast<const double*>(z.data());
  const double* d_curr = nullptr;
  py::array z_curr;
  if (!depth_curr.is_none()) {
    z_curr = checked_array(depth_curr, "depth_curr", {"float64", {n}, as_many});
    const std::string none = places_of<double>(z_curr, [](double value) { return value <= 0; });
    if (!none.empty()) fail("depth_curr: expected depths above 0 m, or NaN without a depth, got {}", none);
    d_curr = static_cast<const double*>(z_curr.data());
  }
  for (py::ssize_t i = 0; i < n; ++i) {
    points.push_back(uv[2 * i], uv[2 * i + 1], d[i], phi[2 * i], phi[2 * i + 1],
                     d_curr == nullptr ? NAN : d_curr[i]);
  }
  return points;
}

/// Returns the tuple (bound with the previous depth only, bound with both depths or None), each a covariance
/// (6, 6); None if the points do not determine the motion.
py::object bound(const std::array<double, 5>& camera, const py::object& pixels, const py::object& depth,
                 const py::object& flow, const py::object& depth_curr, const py::object& motion,
                 const std::array<double, 3>& deviations,
                 const std::vector<std::pair<double, double>>& correlation) {
  const PinholeCamera pinhole{camera[0], camera[1], camera[2], camera[3]};
  pinhole.check();
  const Correspondences points = points_of(pixels, depth, flow, depth_curr);
  const SE3 X = rigid_motion_of(motion, "T_curr_prev");
  MeasurementNoise noise;
  noise.flow_x_px = deviations[0];
  noise.flow_y_px = deviations[1];
  noise.inverse_depth_per_m = deviations[2];
  for (const auto& [length_px, share] : correlation) noise.correlation.parts.push_back({length_px, share});
  noise.independent_gaussian = correlation.empty();
  const auto found = motion_bound(pinhole, points, X, noise);
  if (!found) return py::none();
  return py::make_tuple(array_of(found->previous_depth), found->both_depths
                                                             ? py::object(array_of(*found->both_depths))
                                                             : py::object(py::none()));
}

}  // namespace

void bind_motions(py::module_& core) {
  core.def("pose_change_errors", pose_change_errors);
  core.def("object_errors", object_errors);
  core.def("motion_bound", bound);
  core.def("rms_error", [](const py::object& covariance, const py::object& T) {
    Matrix6d C = covariance_of(covariance, "covariance");
    if (!T.is_none()) C = transported(C, rigid_motion_of(T, "T"));
    const PoseChangeError e = rms_error(C);
    return py::make_tuple(e.Et_m, e.ER_deg);
  });
  core.def("nees", [](const py::object& estimate, const py::object& covariance, const py::object& truth) {
    return nees(rigid_motion_of(estimate, "estimate"), covariance_of(covariance, "covariance"),
                rigid_motion_of(truth, "truth"));
  });
}

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

py::array_t<double> absolute(const py::object& estimate, const py::object& reference,
                             const std::string& relation) {
  const Paths paths(estimate, reference);
  const auto kind = from_name<PoseRelation>(relation, "relation");
  if (kind == PoseRelation::point_distance_error_ratio)
    fail("relation: point_distance_error_ratio is defined for relative errors only: use relative_errors");
  return array_of(absolute_errors(paths.estimate, paths.reference, kind));
}

std::vector<double> stamps_of(const py::object& value, const std::string& name) {
  const py::array array = finite_numbers(value, name, {-1}, "(n,)");
  const auto* first = static_cast<const double*>(array.data());
  std::vector<double> stamps(first, first + array.size());
  if (!std::ranges::is_sorted(stamps)) fail("{}: expected time stamps in ascending order: sort them", name);
  return stamps;
}

/// Returns the relative errors, and the pairs (i, j) behind them.
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
      fail("stamps: expected {}, one per pose, got {}", paths.estimate.size(),
           paths.estimate.stamps_s.size());
  }
  const auto kind = from_name<PoseRelation>(relation, "relation");
  std::vector<PosePair> pairs =
      select_pairs(pairs_from_reference ? paths.reference : paths.estimate, selection);
  if (kind == PoseRelation::point_distance_error_ratio) {
    std::erase_if(pairs, [&](const PosePair& pair) { return pair_distance_m(paths.reference, pair) == 0; });
    if (pairs.empty())
      fail("the reference does not move between any pair of poses: use relation='point_distance'");
  }
  return py::make_tuple(array_of(relative_errors(paths.estimate, paths.reference, pairs, kind)),
                        array_of(pairs));
}

/// Returns the aligned estimate, [s R | t], its scale, and the flatness of the points.
py::tuple aligned(const py::object& estimate, const py::object& reference, const std::string& method,
                  int first_n, const std::optional<std::array<double, 3>>& up) {
  Paths paths(estimate, reference);
  const auto how = from_name<Alignment>(method, "alignment");
  const Eigen::Vector3d axis =
      up ? Eigen::Vector3d((*up)[0], (*up)[1], (*up)[2]).normalized() : Eigen::Vector3d::Zero();
  const AlignmentResult result = align(paths.estimate, paths.reference, how, first_n, axis);
  return py::make_tuple(array_of(paths.estimate), array_of(result.ref_from_est.matrix()),
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
  return py::make_tuple(array_of(found.reference), array_of(found.estimate));
}

}  // namespace

void bind_trajectories(py::module_& core) {
  core.def("absolute_errors", absolute);
  core.def("relative_errors", relative);
  core.def("align", aligned);
  core.def("statistics", statistics);
  core.def("kitti_odometry", kitti);
  core.def("associate", associate);
  core.attr("default_max_difference") = AssociationOptions{}.max_difference_s;
  core.attr("default_tolerance") = PairSelection{}.relative_tolerance;
  core.def("check_path", [](const py::object& path, const std::string& name) { motions_of(path, name); });
  core.def("needs_rotations", [](const std::string& relation, bool relative) {
    return needs_rotations(from_name<PoseRelation>(relation, "relation"), relative);
  });
  core.def("unit_of", [](const std::string& relation) {
    return std::string(unit_of(from_name<PoseRelation>(relation, "relation")));
  });
}

}  // namespace sextant
