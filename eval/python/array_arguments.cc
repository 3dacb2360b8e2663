#include "sextant/eval/python/array_arguments.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <cmath>

namespace py = pybind11;

namespace sextant {
namespace {

std::string type_name(const py::handle& value) {
  return py::str(py::type::handle_of(value).attr("__name__"));
}

std::string shape_text(const py::array& array) {
  std::string text;
  for (py::ssize_t axis = 0; axis < array.ndim(); ++axis)
    text += fmt::format("{}{}", axis > 0 ? ", " : "", array.shape(axis));
  return fmt::format("({}{})", text, array.ndim() == 1 ? "," : "");
}

bool fits(const py::array& array, const std::vector<py::ssize_t>& shape) {
  if (array.ndim() != static_cast<py::ssize_t>(shape.size())) return false;
  for (py::ssize_t axis = 0; axis < array.ndim(); ++axis) {
    const py::ssize_t wanted = shape[static_cast<size_t>(axis)];
    if (wanted >= 0 && array.shape(axis) != wanted) return false;
  }
  return array.size() > 0;
}

/// Returns the deviation of R from a rotation: the largest absolute entry of R'R - I, or 2 for a reflection.
double off_rotation(const Eigen::Matrix3d& R) {
  const Eigen::Matrix3d off = R.transpose() * R - Eigen::Matrix3d::Identity();
  return R.determinant() < 0 ? 2 : off.cwiseAbs().maxCoeff();
}

using RowMajor4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

/// Returns the problem with a rigid motion; empty if there is none.
std::string problem_of(const RowMajor4& m) {
  if ((m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() != 0)
    return fmt::format("the last row {} {} {} {}", m(3, 0), m(3, 1), m(3, 2), m(3, 3));
  constexpr double most = 0.01;
  const double off = off_rotation(m.topLeftCorner<3, 3>());
  if (off > most)
    return off == 2 ? "a reflection" : fmt::format("a rotation part that is off orthonormal by {:.3g}", off);
  return "";
}

}  // namespace

py::array checked_array(const py::handle& value, const std::string& name, const ExpectedArray& expected) {
  const std::string wanted =
      fmt::format("{}: expected a numpy array of {} with shape {}", name, expected.type, expected.in_words);
  if (!py::isinstance<py::array>(value)) fail("{}, got {}", wanted, type_name(value));
  const auto array = py::reinterpret_borrow<py::array>(value);
  const std::string variable = name.substr(name.rfind(' ') + 1);  // without "estimator NAME: "
  if (py::isinstance(value, py::module_::import("numpy").attr("ma").attr("MaskedArray")))
    fail("{}, got one with a mask: give {}.filled(VALUE)", wanted, variable);
  const std::string type = py::str(array.dtype());
  if (type != expected.type) fail("{}, got {}: give {}.astype('{}')", wanted, type, variable, expected.type);
  if (!fits(array, expected.shape)) fail("{}, got shape {}", wanted, shape_text(array));
  constexpr int needed =
      static_cast<int>(py::array::c_style) | static_cast<int>(py::detail::npy_api::NPY_ARRAY_ALIGNED_);
  if ((array.flags() & needed) != needed)
    fail("{}, C-contiguous and aligned, got one that is not: give {}.copy()", wanted, variable);
  return array;
}

py::array finite_numbers(const py::handle& value, const std::string& name, std::vector<py::ssize_t> shape,
                         const std::string& in_words) {
  py::array array = checked_array(value, name, {"float64", std::move(shape), in_words});
  const std::string bad = places_of<double>(array, [](double x) { return !std::isfinite(x); });
  if (!bad.empty()) fail("{}: expected finite numbers, got {}", name, bad);
  return array;
}

std::vector<Eigen::Matrix4d> motions_of(const py::handle& value, const std::string& name) {
  const py::array array = finite_numbers(value, name, {-1, 4, 4}, "(n, 4, 4)");
  const auto* values = static_cast<const double*>(array.data());
  std::vector<Eigen::Matrix4d> motions;
  for (py::ssize_t i = 0; i < array.shape(0); ++i) {
    const Eigen::Map<const RowMajor4> m(values + 16 * i);
    if (const std::string problem = problem_of(m); !problem.empty())
      fail("{}: expected rigid motions [R t; 0 0 0 1], got {} at [{}]", name, problem, i);
    motions.emplace_back(m);
  }
  return motions;
}

SE3 rigid_motion_of(const py::handle& value, const std::string& name) {
  const py::array array = finite_numbers(value, name, {4, 4}, "(4, 4)");
  const Eigen::Map<const RowMajor4> m(static_cast<const double*>(array.data()));
  if (const std::string problem = problem_of(m); !problem.empty())
    fail("{}: expected a rigid motion [R t; 0 0 0 1], got {}", name, problem);
  return SE3::from_matrix(m.topRows<3>());
}

std::vector<SE3> rigid_motions_of(const py::handle& value, const std::string& name) {
  std::vector<SE3> motions;
  for (const Eigen::Matrix4d& m : motions_of(value, name))
    motions.push_back(SE3::from_matrix(m.topRows<3>()));
  return motions;
}

PoseSeries path_of(const py::handle& value, const std::string& name) {
  PoseSeries path;
  for (const Eigen::Matrix4d& m : motions_of(value, name))
    path.add(m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>());
  return path;
}

Matrix6d covariance_of(const py::handle& value, const std::string& name) {
  const py::array array = finite_numbers(value, name, {6, 6}, "(6, 6)");
  const Matrix6d C = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(
      static_cast<const double*>(array.data()));
  constexpr double rounding = 1e-6;
  const Vector6d sigma = C.diagonal().cwiseAbs().cwiseSqrt();
  Matrix6d correlation = Matrix6d::Zero();  // metres and radians are comparable in it
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double scale = sigma[i] * sigma[j];
      if (std::abs(C(i, j) - C(j, i)) > rounding * scale) {
        fail("{}: expected a symmetric matrix, got {:.6g} at [{}, {}] and {:.6g} at [{}, {}]", name, C(i, j),
             i, j, C(j, i), j, i);
      }
      if (C(i, j) != 0) correlation(i, j) = scale > 0 ? C(i, j) / scale : std::copysign(2, C(i, j));
    }
  }
  const double least = Eigen::SelfAdjointEigenSolver<Matrix6d>(correlation).eigenvalues()[0];
  if (least < -rounding)
    fail(
        "{}: expected a positive semidefinite matrix, got one whose correlation matrix has the eigenvalue "
        "{:.3g}",
        name, least);
  return C;
}

PairSelection selection_of(const std::string& delta) {
  try {
    return PairSelection::parse(delta);
  } catch (const Error&) {
    fail("delta: expected a number and a unit: 1f (frames), 10m, 5deg, 0.5rad or 2s, got '{}'", delta);
  }
}

py::array_t<int64_t> array_of(const std::vector<PosePair>& pairs) {
  const auto n = static_cast<py::ssize_t>(pairs.size());
  py::array_t<int64_t> out({n, py::ssize_t{2}});
  for (py::ssize_t i = 0; i < n; ++i) {
    out.mutable_at(i, 0) = pairs[static_cast<size_t>(i)].first;
    out.mutable_at(i, 1) = pairs[static_cast<size_t>(i)].second;
  }
  return out;
}

py::array_t<double> array_of(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::array_t<int> array_of(const std::vector<int>& values) {
  return py::array_t<int>(static_cast<py::ssize_t>(values.size()), values.data());
}

template <int n>
static py::array_t<double> square(const Eigen::Matrix<double, n, n>& matrix) {
  py::array_t<double> out({n, n});
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) out.mutable_at(i, j) = matrix(i, j);
  }
  return out;
}

py::array_t<double> array_of(const Eigen::Matrix4d& matrix) { return square<4>(matrix); }
py::array_t<double> array_of(const Matrix6d& matrix) { return square<6>(matrix); }

py::array_t<double> array_of(const PoseSeries& path) {
  py::array_t<double> out({static_cast<py::ssize_t>(path.size()), py::ssize_t{4}, py::ssize_t{4}});
  for (size_t i = 0; i < path.size(); ++i) {
    RowMajor4 pose = RowMajor4::Identity();
    if (!path.rotations.empty()) pose.topLeftCorner<3, 3>() = path.rotations[i];
    pose.topRightCorner<3, 1>() = path.positions_m[i];
    std::memcpy(out.mutable_data() + 16 * i, pose.data(), sizeof(double) * 16);
  }
  return out;
}

}  // namespace sextant
