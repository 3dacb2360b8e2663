#pragma once

// Columns of time, position and quaternion in a table, found by the names in its header:
//
//   time        t, time, stamp, timestamp, ..; its unit in brackets or at its end: s, ms, us, ns
//   position    x, tx, px, p_x, pos_x, p_RS_R_x, ..       in m
//   quaternion  qx, q_x, quat_x, q_RS_x, orientation.x, ..
//
//   covariance  Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 .. Pt33, as OpenVINS writes it (pose_covariance.h)
//
// A table without any of the four quaternion columns contains positions only. Other columns may be anywhere.
// Brackets contain units; case is ignored.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace sextant {

struct PoseColumns {
  size_t time = 0;
  double seconds_per_unit = 0;  ///< 0: not given by the header
  std::array<size_t, 3> position{};
  std::array<size_t, 4> quaternion{};  ///< x, y, z, w
  bool has_quaternion = true;
  std::optional<std::array<size_t, 12>> covariance = std::nullopt;  ///< Pr11 .. Pr33, Pt11 .. Pt33

  /// Returns true for the order time, x y z, and the quaternion with w last, or first.
  bool in_order(bool w_first) const;
};

/// Returns the columns; nullopt unless the header names each of the eight exactly once (for positions only:
/// each of the four), with as many names as the table has columns. Throws Error if the header gives positions
/// in another unit than metres; `place` begins the message.
std::optional<PoseColumns> columns_of(std::string_view header, size_t n_columns, const std::string& place);

/// Returns true if a header has as many columns as `names` ("a,b,c"), but other names or another order;
/// blanks, quotes and case are ignored.
bool header_contradicts(std::string_view header, std::string_view names);

/// Returns true if a header contains `names` ("a,b,c"), separated by blanks or commas, in another order.
bool header_reorders(std::string_view header, std::string_view names);

}  // namespace sextant
