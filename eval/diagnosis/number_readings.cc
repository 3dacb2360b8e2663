#include "sextant/eval/diagnosis/number_readings.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "sextant/geometry/axes.h"

namespace sextant {
namespace {

std::vector<NumberReading> unit_readings(const std::string& translations) {
  const auto times = [](double factor) {
    return [factor](const SE3& T) { return SE3(T.rotation(), factor * T.translation()); };
  };
  const std::string look_like = "the " + translations + " look like ", are = "the " + translations + " are ";
  return {
      {"centimetres", look_like + "centimetres, not metres", "divide them by 100", times(0.01)},
      {"millimetres", look_like + "millimetres, not metres", "divide them by 1000", times(0.001)},
      {"too_small_100", are + "100 times too small", "multiply them by 100", times(100)},
      {"too_small_1000", are + "1000 times too small (kilometres?)", "multiply them by 1000", times(1000)}};
}

}  // namespace

std::vector<NumberReading> rotation_readings(const std::string& translations) {
  using Q = Eigen::Quaterniond;
  const auto turned = [](Q (*change)(const Q&)) {
    return [change](const SE3& T) { return SE3(change(T.rotation()), T.translation()); };
  };
  return {
      {"quaternion_w_first", "the quaternions look written w first (w x y z), read as x y z w",
       "reorder the columns to qx,qy,qz,qw",
       turned([](const Q& q) { return Q(q.x(), q.y(), q.z(), q.w()); })},
      {"quaternion_w_last", "the quaternions look written w last (x y z w), read as w x y z",
       "reorder the columns", turned([](const Q& q) { return Q(q.z(), q.w(), q.x(), q.y()); })},
      {"transposed", "the rotations look transposed (inverse rotations with the right " + translations + ")",
       "transpose each rotation", turned([](const Q& q) { return Q(q.conjugate()); })}};
}

std::string mirror_remedy(int axis) {
  constexpr std::string_view xyz = "xyz";
  return fmt::format("negate {}, q{} and q{} in each line", xyz[static_cast<size_t>(axis)], xyz[axis == 0],
                     xyz[axis < 2 ? 2 : 1]);
}

std::vector<NumberReading> number_readings(const std::string& translations, double price_of_axes) {
  std::vector<NumberReading> out = unit_readings(translations);
  std::ranges::move(rotation_readings(translations), std::back_inserter(out));
  for (const Axes axes : {Axes::opengl, Axes::ned, Axes::flu}) {
    const SE3 C(Eigen::Quaterniond(opencv_from_axes(axes)), Eigen::Vector3d::Zero());
    out.push_back({fmt::format("axes_{}", to_string(axes)),
                   fmt::format("the values look like those in {} axes, not in opencv's", to_string(axes)),
                   "write C P inverse(C) with the rotation C from these axes to opencv's",
                   [C](const SE3& P) { return C * P * C.inverse(); }, price_of_axes});
  }
  // In the plane of a road a mirrored motion is like an inverse one or one in other axes, which are cheaper.
  constexpr double price_of_mirror = 0.6;
  for (const int axis : {0, 1, 2}) {
    Eigen::Vector3d sign = Eigen::Vector3d::Ones();
    sign[axis] = -1;
    const char a = "xyz"[axis];
    out.push_back({fmt::format("mirrored_{}", a),
                   fmt::format("the values look mirrored: their {} axes point the opposite way (left-handed "
                               "axes)",
                               a),
                   mirror_remedy(axis),
                   [sign](const SE3& T) {
                     Eigen::Quaterniond q = T.rotation();
                     q.vec() = -sign.cwiseProduct(q.vec());  // M R M, with M the mirror
                     return SE3(q, sign.cwiseProduct(T.translation()));
                   },
                   price_of_mirror});
  }
  return out;
}

}  // namespace sextant
