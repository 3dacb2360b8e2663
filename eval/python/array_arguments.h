#pragma once

// Arrays of Python as arguments. What does not fit is an Error "NAME: expected ..., got ..." that says what
// to do; nothing is converted or copied behind the caller's back.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// `shape`: what is expected, -1 for any length; `in_words`: the same for messages, "(height, width)".
struct ExpectedArray {
  std::string type;  ///< as numpy names it: "float32"
  std::vector<pybind11::ssize_t> shape;
  std::string in_words;
};

/// C-contiguous, aligned, of that type, with at least one element along every axis.
pybind11::array checked_array(const pybind11::handle& value, const std::string& name,
                              const ExpectedArray& expected);

/// "nan at [3, 4] (and 11 more)": the places in an array for which `is_bad` holds; none: an empty text.
template <typename T, typename Bad>
std::string places_of(const pybind11::array& array, const Bad& is_bad);

/// (n, 3) or (n,) float64, finite.
pybind11::array finite_numbers(const pybind11::handle& value, const std::string& name,
                               std::vector<pybind11::ssize_t> shape, const std::string& in_words);

/// (n, 4, 4) float64: rigid motions. Throws Error where one is not finite, its last row is not 0 0 0 1, or
/// its rotation is off orthonormal by more than 0.01 or a reflection.
std::vector<Eigen::Matrix4d> motions_of(const pybind11::handle& value, const std::string& name);
std::vector<SE3> rigid_motions_of(const pybind11::handle& value, const std::string& name);
/// The same as a path; the rotations are the matrices as they are.
PoseSeries path_of(const pybind11::handle& value, const std::string& name);
Eigen::Matrix4d motion_of(const pybind11::handle& value, const std::string& name);

pybind11::array_t<double> array_of(const std::vector<double>& values);
pybind11::array_t<double> array_of(const Eigen::Matrix4d& matrix);
pybind11::array_t<double> array_of(const Matrix6d& matrix);

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

}  // namespace sextant
