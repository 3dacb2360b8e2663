#include "sextant/eval/logs/trajectory_files.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <new>

#include "sextant/base/error.h"
#include "sextant/base/names.h"
#include "sextant/eval/logs/pose_collector.h"
#include "sextant/eval/logs/trajectory_bytes.h"
#include "sextant/eval/logs/trajectory_message.h"
#include "sextant/eval/logs/trajectory_readers.h"

namespace sextant {
namespace {

/// Reader of all text formats: `add` appends one record of `n` values to the file's series.
class TextReader {
 public:
  TextReader(const std::string& path, char separator, const ReadRules& rules)
      : file_(path, separator, rules) {}

  /// Records may contain text in values that `add` does not require().
  TextReader& allow_text() {
    file_.allow_text();
    return *this;
  }

  /// `accepts(n, separator)` returns true if records may have n values; all must have as many as the first
  /// one.
  template <typename Accepts, typename Add>
  TrajectoryFile read(const char* expected, const Accepts& accepts, const Add& add) {
    size_t n = 0;
    while (file_.next()) {
      const size_t count = file_.values().size();
      if (n == 0 && !accepts(count, file_.separator())) {
        file_.require_all();
        file_.fail_here("expected {}, got {} values", expected, count);
      }
      if (n == 0) result_.poses.reserve(std::min(file_.expected_records(), most_poses_of_file));
      if (result_.poses.size() == most_poses_of_file)
        file_.fail_here("more than {} poses: cut the recording into parts, or thin it out",
                        most_poses_of_file);
      if (n != 0 && count != n)
        file_.fail_here("expected {} values as in the lines before, got {}", n, count);
      n = count;
      add(file_, result_, log_);
      result_.poses.lines.push_back(static_cast<int>(file_.line()));
      if (result_.truth) result_.truth->lines.push_back(static_cast<int>(file_.line()));
    }
    note_cut(file_, log_);
    if (result_.poses.empty()) fail("{}: holds no pose: expected lines of {}", file_.path(), expected);
    finish_covariances(result_.poses, file_.path(), log_);
    check_order(result_.poses, file_.path());
    result_.warnings = log_.warnings(file_.path());
    result_.comments = lower_case(file_.comments() + file_.header());
    return std::move(result_);
  }

 private:
  NumberFile file_;
  TrajectoryFile result_;
  RepairLog log_;
};

/// The formats tum, tum_ns, euroc, table and positions: time, position and (except positions) quaternion, in
/// the columns named by a header or otherwise in the format's own order.
struct StampedFormat {
  const char* name;
  const char* expected;
  std::optional<bool> w_first;  ///< nullopt: only determined by the header
  double seconds_per_unit;      ///< 0: determined by the header
  bool has_quaternion = true;
};
constexpr StampedFormat tum = {"tum", "t tx ty tz qx qy qz qw", false, 1};
constexpr StampedFormat tum_ns = {"tum_ns", "t[ns] tx ty tz qx qy qz qw", false, 1e-9};
constexpr StampedFormat euroc = {"euroc", "t[ns],px,py,pz,qw,qx,qy,qz[,...]", true, 1e-9};
constexpr StampedFormat table_format = {"table", "a header that names time, x y z, qx qy qz qw", std::nullopt,
                                        0};
constexpr StampedFormat positions = {"positions", "t x y z", std::nullopt, 1, false};

/// From here on stamps can only be nanoseconds: as microseconds they would be after the year 5000.
constexpr double only_nanoseconds = 1e17;

std::optional<PoseColumns> named_columns(const NumberFile& file) {
  return columns_of(file.column_names(), file.values().size(),
                    fmt::format("{}:{}", file.path(), file.line()));
}

/// Determines the columns of a table: by the header or, if it names none, by the format. Throws Error if the
/// header contradicts the format.
PoseColumns columns_in(const NumberFile& file, const StampedFormat& format) {
  const auto named = named_columns(file);
  if (!named) {
    if (!format.has_quaternion) return {0, format.seconds_per_unit, {1, 2, 3}, {}, false};
    if (!format.w_first) {
      const std::string problem = column_problem(file.column_names(), file.values().size());
      file.fail_here("expected {}{}{}", format.expected, problem.empty() ? "" : ": ", problem);
    }
    if (*format.w_first) return {0, format.seconds_per_unit, {1, 2, 3}, {5, 6, 7, 4}};
    return {0, format.seconds_per_unit, {1, 2, 3}, {4, 5, 6, 7}};
  }
  PoseColumns columns = *named;
  if (format.w_first && !columns.in_order(*format.w_first)) {
    file.fail_here(
        "the header names other columns than {}, {}: give the "
        "format as table, or delete a header that is wrong",
        format.name, format.expected);
  }
  if (columns.seconds_per_unit == 0) columns.seconds_per_unit = format.seconds_per_unit;
  if (columns.seconds_per_unit == 0 && std::abs(file.values()[columns.time]) >= only_nanoseconds)
    columns.seconds_per_unit = 1e-9;
  if (columns.seconds_per_unit == 0 && file.separator() != ',') columns.seconds_per_unit = 1;
  if (columns.seconds_per_unit == 0) {
    file.fail_here(
        "the header does not give the unit of time: write it behind the name, as 'timestamp [s]' or [ns]{}",
        columns.in_order(false)  ? ", or give --format tum (s) or tum_ns"
        : columns.in_order(true) ? ", or give --format euroc (ns)"
                                 : "");
  }
  if (!format.has_quaternion && columns.has_quaternion)
    file.fail_here("the header names a quaternion, but the format is positions: give --format table");
  if (format.has_quaternion && format.seconds_per_unit > 0 &&
      columns.seconds_per_unit != format.seconds_per_unit) {
    file.fail_here(
        "the header gives another unit of time than {}, {}: give "
        "the format as table, or delete a header that is wrong",
        format.name, format.expected);
  }
  return columns;
}

/// Throws Error if a value of the current line that a format reads is not a finite number. Tables may contain
/// text in other columns.
void require_used(const NumberFile& file, const PoseColumns& columns) {
  file.require(columns.time);
  for (const size_t i : columns.position) file.require(i);
  if (!columns.has_quaternion) return;
  for (const size_t i : columns.quaternion) file.require(i);
  if (!columns.covariance) return;
  for (const size_t i : *columns.covariance) file.require(i);
}

/// Returns the time stamp of the current line in s. `before_s`: the stamps of the lines before.
double stamp_at(const NumberFile& file, const PoseColumns& columns, const std::vector<double>& before_s) {
  constexpr double latest_s = 1e11, least_ns = 1e6;
  const double t = file.values()[columns.time];
  if (columns.seconds_per_unit == 1e-9 && t != 0 && std::abs(t) < least_ns)  // seconds, or a frame number
    file.fail_here("time stamp {} is below {} ns: expected nanoseconds", t, least_ns);
  // A division, because 1e-9 has no exact double.
  const double t_s = columns.seconds_per_unit == 1 ? t : t / std::round(1 / columns.seconds_per_unit);
  if (!(std::abs(t_s) <= latest_s)) {
    const double epochs = std::abs(t) / 1.7e9;  // of the present time in s
    if (epochs > 1e8)
      file.fail_here(
          "time stamp {} is too large for seconds: it seems to be in ns: give --format tum_ns or euroc", t);
    const char* unit = epochs > 1e5 ? "us" : "ms";
    // Stamps that do not count from 1970: poses are at most some seconds apart.
    constexpr double longest_step_s = 3;
    const double step = before_s.empty() ? 0 : std::abs(t_s - before_s.back());
    if (step > longest_step_s * 1e6) {
      unit = "ns";
    } else if (step > longest_step_s * 1e3) {
      unit = "us";
    }
    file.fail_here(
        "time stamp {} is too large for seconds: it seems to be in {}; write a header with the unit above "
        "the first line, such as '# t [{}] tx ty tz qx qy qz qw'",
        t, unit, unit);
  }
  return t_s;
}

TrajectoryFile read_stamped(const std::string& path, const StampedFormat& format, const ReadRules& rules) {
  PoseColumns columns;
  size_t n_records = 0;
  bool is_named = false;
  return TextReader(path, NumberFile::either, rules)
      .allow_text()
      .read(
          format.expected,
          [&](size_t n, char separator) {
            if (!format.has_quaternion) return n >= 4;
            const bool any = separator == ',' || !format.w_first;
            return any ? n >= (format.w_first ? 8 : 4) : n == 8 || (n > 8 && is_covariance_size(n - 8));
          },
          [&](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
            if (n_records++ == 0) {
              is_named = named_columns(file).has_value();
              if (!is_named) file.require_all();
              columns = columns_in(file, format);
              if (format.has_quaternion && !columns.unread_rotation.empty()) {
                constexpr int64_t whole_file = 0;
                log.note(fmt::format("the columns {} are not read, only positions: write rotations as "
                                     "quaternions qx, qy, qz, qw (or give --format positions)",
                                     columns.unread_rotation),
                         whole_file);
              }
            }
            if (is_named) {
              require_used(file, columns);
            } else {
              file.require_all();
            }
            const auto v = file.values();
            const auto& [x, y, z] = columns.position;
            const auto& [qx, qy, qz, qw] = columns.quaternion;
            const Eigen::Vector3d p(v[x], v[y], v[z]);
            out.poses.stamps_s.push_back(stamp_at(file, columns, out.poses.stamps_s));
            check_position(p, file.path(), file.line());
            if (!columns.has_quaternion) return out.poses.positions_m.push_back(p);
            out.poses.add(checked_rotation({v[qw], v[qx], v[qy], v[qz]}, file.path(), file.line(), log), p);
            if (columns.covariance) {
              std::array<double, 12> numbers{};
              for (size_t k = 0; k < numbers.size(); ++k) numbers[k] = v[(*columns.covariance)[k]];
              add_covariance(out.poses, numbers, rules.covariance, file.path(), file.line());
            } else if (format.w_first == false && v.size() > 8 && is_covariance_size(v.size() - 8)) {
              file.require_all();
              add_covariance(out.poses, v.subspan(8), rules.covariance, file.path(), file.line());
            }
          });
}

TrajectoryFile read_kitti(const std::string& path, const ReadRules& rules) {
  return TextReader(path, ' ', rules)
      .read(
          "12 values of [R|t] row by row, or a frame number and these",
          [](size_t n, char) { return n == 12 || n == 13; },
          [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
            const size_t first = file.values().size() - 12;
            if (first == 1) out.poses.frames.push_back(file.whole(0));
            add_matrix(out.poses, file, first, log);
          });
}

/// Reads lines of seven values without a time: poses have neither stamps nor frame numbers.
TrajectoryFile read_tartanair(const std::string& path, const ReadRules& rules) {
  static constexpr const char* columns = "tx,ty,tz,qx,qy,qz,qw";
  return TextReader(path, NumberFile::either, rules)
      .read(
          "tx ty tz qx qy qz qw without a time (7 values)", [](size_t n, char) { return n == 7; },
          [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
            if (out.poses.empty() && header_reorders(file.column_names(), columns))
              file.fail_here("the header has the columns in another order than {}: reorder them", columns);
            out.poses.add(quaternion_at(file, 3, log), position_at(file, 0));
          });
}

TrajectoryFile read_vdo(const std::string& path, const ReadRules& rules) {
  return TextReader(path, ' ', rules)
      .read(
          "a frame number and 16 values of a 4x4 pose", [](size_t n, char) { return n == 17; },
          [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
            const auto v = file.values();
            if (v[13] != 0 || v[14] != 0 || v[15] != 0 || v[16] != 1)
              file.fail_here("expected 0 0 0 1 as the last row of the pose, got {} {} {} {}", v[13], v[14],
                             v[15], v[16]);
            out.poses.frames.push_back(file.whole(0));
            add_matrix(out.poses, file, 1, log);
          });
}

TrajectoryFile read_dynosam(const std::string& path, const ReadRules& rules) {
  static constexpr const char* dynosam_columns =
      "frame_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw";
  return TextReader(path, ',', rules)
      .read(
          dynosam_columns, [](size_t n, char) { return n == 15; },
          [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
            if (!out.truth) {
              out.truth.emplace();
              if (header_contradicts(file.header(), dynosam_columns))
                file.fail_here("the header names other columns than {}, or another order", dynosam_columns);
            }
            for (PoseSeries* series : {&out.poses, &*out.truth}) {
              const size_t first = series == &out.poses ? 1 : 8;
              series->frames.push_back(file.whole(0));
              series->add(quaternion_at(file, first + 3, log), position_at(file, first));
            }
          });
}

TrajectoryFile read_vdo_xml(const std::string& path, const ReadRules& rules) {
  RepairLog log;
  TrajectoryFile out;
  out.truth.emplace();
  read_vdo_frontend_xml(path, rules.kind.value_or(data_file), out.poses, *out.truth, log);
  sort_and_unite(out.poses, &*out.truth, log);
  out.warnings = log.warnings(path);
  return out;
}

template <const StampedFormat& format>
TrajectoryFile read_as(const std::string& path, const ReadRules& rules) {
  return read_stamped(path, format, rules);
}

template <auto read>
TrajectoryFile read_recording(const std::string& path, const ReadRules& rules) {
  const TopicPath split = split_topic(path);
  ByteSource bytes(split.file, rules.kind.value_or(recording_file));
  return read(bytes, split.topic, rules);
}

const std::vector<TrajectoryFormat>& table() {
  static const std::vector<TrajectoryFormat> formats = {
      {"tum", "t tx ty tz qx qy qz qw, with blanks or commas", read_as<tum>},
      {"tum_ns", "as tum with t in ns, as ORB-SLAM3 writes it", read_as<tum_ns>},
      {"positions", "t x y z without rotations, as of GNSS or a prism", read_as<positions>},
      {"kitti", "12 values of [R|t], or a frame number and these", read_kitti, false},
      {"euroc", "t[ns],px,py,pz,qw,qx,qy,qz[,...]", read_as<euroc>},
      {"table", "columns in any order, by the names in the header", read_as<table_format>},
      {"tartanair", "tx ty tz qx qy qz qw without a time, as pose_left.txt", read_tartanair},
      {"vdo", "frame number and 16 values of a 4x4 pose", read_vdo, false},
      {"dynosam", "DynOSAM camera_pose_log.csv, with its truth", read_dynosam},
      {"vdo_xml", "VDO-SLAM front end, boost XML, with its truth", read_vdo_xml, false},
      {"bag", "ROS 1 bag, FILE:/TOPIC", read_recording<read_bag>},
      {"mcap", "MCAP, FILE:/TOPIC", read_recording<read_mcap>},
      {"rosbag2", "rosbag2 of SQLite (.db3), FILE:/TOPIC", read_recording<read_rosbag2>},
  };
  return formats;
}

constexpr const char* known_columns =
    "; known are names like time, timestamp or t [s]; x, tx or position.x; qx, q_x or orientation.x";

/// Returns the text formats that fit the first record of a file and the names of its columns.
FittingFormats formats_of_record(const NumberFile& file) {
  const size_t n = file.values().size();
  const bool commas = file.separator() == ',';
  if (commas && n == 15 && file.header().find("gt_tx") != std::string::npos) return {{"dynosam"}, ""};
  if (const auto named = named_columns(file)) {
    const bool only_ns = std::abs(file.values()[named->time]) >= only_nanoseconds;
    const bool ns = named->seconds_per_unit == 1e-9 || (named->seconds_per_unit == 0 && only_ns);
    const bool s = named->seconds_per_unit == 1 || (named->seconds_per_unit == 0 && !commas);
    const bool plain = n == 8 || (n > 8 && is_covariance_size(n - 8));
    if (named->in_order(false) && (plain || commas) && (ns || s)) return {{ns ? "tum_ns" : "tum"}, ""};
    if (named->in_order(true) && commas && ns) return {{"euroc"}, ""};
    return {{"table"}, ""};
  }
  file.require_all();
  if (commas && n >= 8) {
    if (std::string problem = column_problem(file.column_names(), n); !problem.empty())
      return {{}, problem + known_columns};
  }
  if (commas && n >= 8)
    return {{"euroc", "tum"},
            "its columns have no header with a name each, so it may be euroc "
            "(t in ns, quaternion w first) or tum (t in s, quaternion w last)"};
  if (n == 4) return {{"positions"}, ""};
  if (!commas && (n == 8 || (n > 8 && is_covariance_size(n - 8))))
    return {{std::abs(file.values()[0]) >= only_nanoseconds ? "tum_ns" : "tum"}, ""};
  if (!commas && (n == 12 || n == 13)) return {{"kitti"}, ""};
  if (!commas && n == 17) return {{"vdo"}, ""};
  if (n == 7) return {{"tartanair"}, ""};
  return {{}, fmt::format("its first record has {} values", n)};
}

}  // namespace

std::span<const TrajectoryFormat> trajectory_formats() { return table(); }

FittingFormats fitting_formats(const std::string& path, const ReadRules& rules) {
  const TopicPath split = split_topic(path);
  ByteSource bytes(split.file);
  const std::string_view start = bytes.view(0, std::min<uint64_t>(bytes.size(), 16));
  if (is_bag(start)) return {{"bag"}, ""};
  if (is_mcap(start)) return {{"mcap"}, ""};
  if (is_rosbag2(start)) return {{"rosbag2"}, ""};
  if (!split.topic.empty())
    fail("{}: only recordings (.bag, .mcap, .db3) have topics: give the file alone", path);
  NumberFile file(path, NumberFile::either, rules);
  file.allow_text();
  FittingFormats fitting;
  try {
    if (file.next())
      fitting = formats_of_record(file);
    else
      fitting.problem = "it contains no record";
  } catch (const Error& error) {
    fitting.problem = error.what();
  }
  if (file.header().starts_with("<?xml") || file.header().starts_with("<!DOCTYPE")) return {{"vdo_xml"}, ""};
  return fitting;
}

std::string detect_trajectory_format(const std::string& path, const ReadRules& rules) {
  const FittingFormats fitting = fitting_formats(path, rules);
  if (fitting.names.size() == 1) return fitting.names.front();
  if (fitting.names.size() > 1) {
    fail(
        "{}: {}: give --format {} (or --ref-format, --est-format), "
        "or write a header such as 't [s],tx,ty,tz,qx,qy,qz,qw'",
        path, fitting.problem, fmt::join(fitting.names, " or "));
  }
  std::vector<std::string> names;
  for (const TrajectoryFormat& f : trajectory_formats()) names.push_back(f.name);
  fail(
      "{}: cannot determine the format of this trajectory ({}); give --format, one of "
      "{}",
      path, fitting.problem, fmt::join(names, ", "));
}

TrajectoryFile read_trajectory(const std::string& path, const std::string& format, const ReadRules& rules) {
  const std::string name =
      format.empty() || format == "auto" ? detect_trajectory_format(path, rules) : format;
  try {
    const TrajectoryFormat& entry = find_entry(trajectory_formats(), name, "trajectory format");
    TrajectoryFile file = entry.read(path, rules);
    file.format = name;
    file.has_quaternions = entry.has_quaternions;
    return file;
  } catch (const std::bad_alloc&) {
    fail("{}: does not fit into memory (104 bytes per pose): cut the recording into parts", path);
  }
}

TrajectoryFile decode_trajectory(std::string_view bytes, const std::string& format,
                                 const std::string& topic) {
  ByteSource source(bytes, "bytes");
  if (format == "bag") return read_bag(source, topic);
  if (format == "mcap") return read_mcap(source, topic);
  if (format == "rosbag2") return read_rosbag2(source, topic);
  const MemoryFile file(bytes);
  return read_trajectory(file.path(), format);
}

std::string encode_tum(const PoseSeries& poses, std::span<const double> times) {
  SEXTANT_CHECK(times.empty() || times.size() == poses.size());
  std::string out;
  for (size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d& p = poses.positions_m[i];
    const double t = !times.empty()            ? times[i]
                     : !poses.stamps_s.empty() ? poses.stamps_s[i]
                     : !poses.frames.empty()   ? poses.frames[i]
                                               : static_cast<double>(i);
    fmt::format_to(std::back_inserter(out), "{:.17g} {:.17g} {:.17g} {:.17g}", t, p[0], p[1], p[2]);
    if (poses.has_rotations()) {
      const Eigen::Quaterniond q = poses.pose(i).rotation();
      fmt::format_to(std::back_inserter(out), " {:.17g} {:.17g} {:.17g} {:.17g}", q.x(), q.y(), q.z(), q.w());
    }
    out.push_back('\n');
  }
  return out;
}

}  // namespace sextant
