#pragma once

// Checks of Python arrays that are passed as arguments. An unsuitable array throws Error "NAME: expected ...,
// got ..."; where a conversion would help, the message names the call. Arrays are never converted implicitly.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstring>
#include <string>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/geometry/trajectory.h"
#include "sextant/measurement/image.h"
#include "sextant/metrics/trajectory_errors.h"

namespace sextant {

/// Expected type and shape of an array. `shape`: -1 for any length; `in_words`: the shape in messages,
/// "(height, width)".
struct ExpectedArray {
  std::string type;  ///< name in numpy: "float32"
  std::vector<pybind11::ssize_t> shape;
  std::string in_words;
};

/// Returns a C-contiguous, aligned array of the expected type, with at least one element along every axis.
pybind11::array checked_array(const pybind11::handle& value, const std::string& name,
                              const ExpectedArray& expected);

/// Describes the elements of an array for which `is_bad` is true: the first one with its indices, and the
/// number of the others, as "nan at [3, 4] and 11 more"; empty if there are none.
template <typename T, typename Bad>
std::string places_of(const pybind11::array& array, const Bad& is_bad);

/// Returns a float64 array of this shape (ExpectedArray) in which all numbers are finite.
pybind11::array finite_numbers(const pybind11::handle& value, const std::string& name,
                               std::vector<pybind11::ssize_t> shape, const std::string& in_words);

/// Returns the rigid motions of a float64 array (n, 4, 4). Throws Error if one is not finite, its last row is
/// not 0 0 0 1, or its rotation part R is a reflection or an entry of R'R - I exceeds 0.01.
std::vector<Eigen::Matrix4d> motions_of(const pybind11::handle& value, const std::string& name);
std::vector<SE3> rigid_motions_of(const pybind11::handle& value, const std::string& name);
/// Returns the motions as a path whose rotations are the unchanged matrices.
PoseSeries path_of(const pybind11::handle& value, const std::string& name);
/// Parses "10m" and similar texts; the program's flag for it is --rpe.
PairSelection selection_of(const std::string& delta);
/// Returns the rigid motion of a float64 array (4, 4).
SE3 rigid_motion_of(const pybind11::handle& value, const std::string& name);
/// Returns a covariance (6, 6), which may be singular. Throws Error if it is not symmetric, to 1e-6 of the
/// standard deviations, or has a negative eigenvalue.
Matrix6d covariance_of(const pybind11::handle& value, const std::string& name);

pybind11::array_t<double> array_of(const std::vector<double>& values);
pybind11::array_t<int> array_of(const std::vector<int>& values);
pybind11::array_t<int64_t> array_of(const std::vector<PosePair>& pairs);
pybind11::array_t<double> array_of(const Eigen::Matrix4d& matrix);
pybind11::array_t<double> array_of(const Matrix6d& matrix);
/// Returns the poses as an array (n, 4, 4). Rotations are the matrices as read, identities if the path has
/// positions only.
pybind11::array_t<double> array_of(const PoseSeries& path);
/// Returns the pixels as an array (height, width), or (height, width, k) for pixels of k numbers.
template <typename Number, typename Pixel>
pybind11::array_t<Number> array_of(const Image<Pixel>& image);

// ---- implementation

template <typename T, typename Bad>
std::string places_of(const pybind11::array& array, const Bad& is_bad) {
  const T* values = static_cast<const T*>(array.data());
  const auto n = static_cast<size_t>(array.size());
  size_t count = 0, first = 0;
  for (size_t i = 0; i < n; ++i) {
    if (!is_bad(values[i])) continue;
    if (count++ == 0) first = i;
  }
  if (count == 0) return "";
  std::string place;
  size_t rest = first;
  for (auto axis = array.ndim(); axis-- > 0;) {
    const auto length = static_cast<size_t>(array.shape(axis));
    place = fmt::format("{}{}{}", rest % length, place.empty() ? "" : ", ", place);
    rest /= length;
  }
  return fmt::format("{} at [{}]{}", values[first], place,
                     count > 1 ? fmt::format(" and {} more", count - 1) : std::string());
}

template <typename Number, typename Pixel>
pybind11::array_t<Number> array_of(const Image<Pixel>& image) {
  static_assert(sizeof(Pixel) % sizeof(Number) == 0);
  std::vector<pybind11::ssize_t> shape = {image.height(), image.width()};
  if (sizeof(Pixel) > sizeof(Number)) shape.push_back(sizeof(Pixel) / sizeof(Number));
  pybind11::array_t<Number> out(shape);
  std::memcpy(out.mutable_data(), image.data(), image.size() * sizeof(Pixel));
  return out;
}

}  // namespace sextant
