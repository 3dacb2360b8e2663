#pragma once

// Streams a text file of numbers with one record per line: any size, a few MB of memory, about 25 ns per
// number.
//
//   NumberFile file(path, ' ');
//   while (file.next()) series.add(file.values()[1], ...);
//
// Lines and fields are those of datasets/codec/text_rows.h. Lines that begin with '#' are comments. If the
// first record does not begin with a number, it is a header, which header() returns. Every other field must
// be a finite number in C notation. Messages about a line start with "PATH:LINE: ".

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/datasets/codec/text_rows.h"

namespace sextant {

// ---- Conventions of recorded covariances, with R = R_world_body:
//
//   convention  order               position error in   rotation error
//   ros         position, rotation  world               world   R_true = exp(e) R      PoseWithCovariance
//   openvins    rotation, position  world               body    R_true = R exp(e)
//   gtsam       rotation, position  body                body    T_true = T exp(e)      Pose3's marginals

enum class CovarianceConvention { ros, openvins, gtsam };
constexpr Names<3> names_of(CovarianceConvention) { return {"ros", "openvins", "gtsam"}; }

/// Rules for reading a file that may be too large or unfinished.
struct ReadRules {
  std::optional<FileKind> kind = std::nullopt;  ///< nullopt: the default of the reader
  /// Leave out a last line without end of line, which may contain a truncated number.
  bool whole_lines = false;
  /// Convention of pose covariances; nullopt: determined by the number of values.
  std::optional<CovarianceConvention> covariance = std::nullopt;
};

class NumberFile {
 public:
  /// Separator determined by the first record: a comma if it contains one, otherwise blanks.
  static constexpr char either = '\0';

  /// Opens a file; `separator` as in for_each_field(), or `either`. Throws Error if the file cannot be read.
  NumberFile(const std::string& path, char separator, const ReadRules& rules = {});

  /// Reads fields that are no finite numbers as NaN or infinite values, of which require() throws those that
  /// are used.
  void allow_text() { allows_text_ = true; }
  /// Throws Error if value i of the record, or any value of it, is not a finite number.
  void require(size_t i) const;
  void require_all() const;

  /// Advances to the next record; returns false at the end. Throws Error on a value that is not a finite
  /// number, unless allow_text() was called, and on a header with a zero byte (a binary file).
  bool next();

  std::span<const double> values() const { return values_; }
  /// Returns value i of the record exactly if it is written as an integer that fits; otherwise nullopt. A
  /// double holds the ns since 1970 in steps of 256 only.
  std::optional<int64_t> integer(size_t i) const;
  /// Returns value i, a frame number or an id. Throws Error that calls it `what` unless it is a whole number
  /// from 0 to 1e9.
  int whole(size_t i, const char* what = "a frame number") const;
  int64_t line() const { return lines_.number(); }  ///< from 1
  bool is_cut() const { return lines_.is_cut(); }   ///< at the end: true if the last line was left out
  /// Returns the approximate number of records, judged by the first one; at most 2^20, since later ones may
  /// be longer.
  size_t expected_records() const;
  const std::string& path() const { return lines_.name(); }
  const std::string& header() const { return header_; }      ///< trimmed; may be empty
  const std::string& comments() const { return comments_; }  ///< comments read so far, at most 4 kB
  /// Returns the header, otherwise the last comment before the first record: the line that may contain column
  /// names.
  const std::string& column_names() const { return header_.empty() ? last_comment_ : header_; }
  char separator() const { return separator_; }

  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    lines_.fail_here(format, std::forward<Args>(args)...);
  }

 private:
  double parse(std::string_view field, size_t i) const;  // field of value i

  TextLines lines_;
  char separator_;
  bool allows_text_ = false;
  size_t line_bytes_ = 0;  // length of the current record
  int64_t records_ = 0;
  size_t n_values_ = 0;  // of the first record
  std::vector<double> values_;
  std::vector<std::string_view> fields_;  // valid until the next record is read
  std::string header_;
  std::string comments_;
  std::string last_comment_;  // before the first record
};

// ---- Columns of time, position and quaternion in a table, found by the names in its header:
//
//   time        t, time, stamp, timestamp, ..; its unit in brackets or at its end: s, ms, us, ns
//   position    x, tx, px, p_x, pos_x, p_RS_R_x, ..       in m
//   quaternion  qx, q_x, quat_x, q_RS_x, orientation.x, ..
//
//   covariance  Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 .. Pt33, as OpenVINS writes it (pose_collector.h)
//
// A table without any of the four quaternion columns contains positions only. Other columns may be anywhere.
// Rotations under other names (roll pitch yaw, q0 q1 q2 q3, rx ry rz rw, w i j k) are not read, since their
// order and unit are not known.
// Brackets contain units; case is ignored.

struct PoseColumns {
  size_t time = 0;
  double seconds_per_unit = 0;  ///< 0: not given by the header
  std::array<size_t, 3> position{};
  std::array<size_t, 4> quaternion{};  ///< x, y, z, w
  bool has_quaternion = true;
  std::string unread_rotation = {};  ///< names of columns that seem to be a rotation, "roll, pitch, yaw"
  std::optional<std::array<size_t, 12>> covariance = std::nullopt;  ///< Pr11 .. Pr33, Pt11 .. Pt33

  /// Returns true if the table begins with time, x y z and the four columns of the quaternion, in this order,
  /// with w first if `w_first`, otherwise with w last.
  bool in_order(bool w_first) const;
};

/// Returns the columns that `header` names; nullopt unless it has `n_columns` names and names each of the
/// eight columns (for positions only: of the four) exactly once. Throws Error if the header gives positions
/// in another unit than metres; `place` begins the message.
std::optional<PoseColumns> columns_of(std::string_view header, size_t n_columns, const std::string& place);

/// Returns the reason why columns_of() finds no columns in a header with several of their names, such as "its
/// header names x twice ('x', 'tx')"; empty for other headers, and if there is no reason.
std::string column_problem(std::string_view header, size_t n_columns);

/// Returns true if a header has as many columns as `names` ("a,b,c"), but other names or another order;
/// blanks, quotes and case are ignored.
bool header_contradicts(std::string_view header, std::string_view names);

/// Returns true if a header contains `names` ("a,b,c"), separated by blanks or commas, in another order.
bool header_reorders(std::string_view header, std::string_view names);

}  // namespace sextant
