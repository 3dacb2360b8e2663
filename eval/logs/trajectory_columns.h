#pragma once

// Which columns of a table hold time, position and quaternion, from the names in its header:
//
//   time        t, time, stamp, timestamp, ..; its unit in brackets or at its end: s, ms, us, ns
//   position    x, tx, px, p_x, pos_x, p_RS_R_x, ..       in m
//   quaternion  qx, q_x, quat_x, q_RS_x, orientation.x, ..
//
//   covariance  Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 .. Pt33, as OpenVINS writes it (pose_covariance.h)
//
// A table without any of the four quaternion columns holds positions alone. Other columns may stand anywhere.
// Brackets hold units, cases do not matter.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace sextant {

struct PoseColumns {
  size_t time = 0;
  double seconds_per_unit = 0;  ///< 0: the header does not say
  std::array<size_t, 3> position{};
  std::array<size_t, 4> quaternion{};  ///< x, y, z, w
  bool has_quaternion = true;
  std::optional<std::array<size_t, 12>> covariance = std::nullopt;  ///< Pr11 .. Pr33, Pt11 .. Pt33

  /// time, x y z, then the quaternion with w last, or first.
  bool in_order(bool w_first) const;
};

/// Empty when the header does not name each of the eight once (of positions alone each of the four), or has
/// another number of names than the table has columns. Throws Error where it says that positions are not in
/// metres; `place` begins the message.
std::optional<PoseColumns> columns_of(std::string_view header, size_t n_columns, const std::string& place);

/// Whether a header names as many columns as `names` ("a,b,c"), but others or in another order; blanks,
/// quotes and cases do not matter.
bool header_contradicts(std::string_view header, std::string_view names);

/// Whether a header has the names of `names` ("a,b,c"), separated by blanks or commas, in another order.
bool header_reorders(std::string_view header, std::string_view names);

}  // namespace sextant
