#include "sextant/eval/external/trajectory_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <new>

#include "sextant/base/registry.h"
#include "sextant/eval/external/pose_collector.h"
#include "sextant/eval/external/vdo_xml.h"

namespace sextant {
namespace {

int frame_number(const NumberFile& file, size_t i) {
  const double value = file.values()[i];
  if (value != std::trunc(value) || value < 0 || value > 1e9)
    file.fail_here("expected a frame number for value {}, got {}", i + 1, value);
  return static_cast<int>(value);
}

constexpr size_t kMostPoses = 20'000'000;  // 2 GB in memory

/// The reader behind every text format: `add` puts one record of `n` values into the file's series.
class TextReader {
 public:
  TextReader(const std::string& path, char separator, const ReadRules& rules)
      : file_(path, separator, rules) {}

  /// `accepts(n)`: whether records may have n values; all must have as many as the first.
  template <typename Accepts, typename Add>
  TrajectoryFile read(const char* expected, const Accepts& accepts, const Add& add) {
    size_t n = 0;
    while (file_.next()) {
      const size_t count = file_.values().size();
      if (n == 0 && !accepts(count)) file_.fail_here("expected {}, got {} values", expected, count);
      if (n == 0) result_.poses.reserve(std::min(file_.expected_records(), kMostPoses));
      if (result_.poses.size() == kMostPoses)
        file_.fail_here("more than {} poses: cut the recording into parts, or thin it out", kMostPoses);
      if (n != 0 && count != n)
        file_.fail_here("expected {} values as in the lines before, got {}", n, count);
      n = count;
      add(file_, result_, log_);
    }
    note_cut(file_, log_);
    if (result_.poses.empty()) fail("{}: holds no pose: expected lines of {}", file_.path(), expected);
    sort_and_unite(result_.poses, result_.truth ? &*result_.truth : nullptr, log_);
    result_.warnings = log_.warnings(file_.path());
    result_.comments = file_.comments() + file_.header();
    std::transform(result_.comments.begin(), result_.comments.end(), result_.comments.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return std::move(result_);
  }

 private:
  NumberFile file_;
  TrajectoryFile result_;
  RepairLog log_;
};

TrajectoryFile read_tum(const std::string& path, const ReadRules& rules) {
  return TextReader(path, ' ', rules).read(
      "t tx ty tz qx qy qz qw", [](size_t n) { return n == 8; },
      [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
        out.poses.stamps_s.push_back(file.values()[0]);
        out.poses.add(quaternion_at(file, 4, false, log), position_at(file, 1));
      });
}

TrajectoryFile read_kitti(const std::string& path, const ReadRules& rules) {
  return TextReader(path, ' ', rules).read(
      "12 values of [R|t] row by row, or a frame number and these",
      [](size_t n) { return n == 12 || n == 13; },
      [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
        const size_t first = file.values().size() - 12;
        if (first == 1) out.poses.frames.push_back(frame_number(file, 0));
        add_matrix(out.poses, file, first, log);
      });
}

TrajectoryFile read_vdo(const std::string& path, const ReadRules& rules) {
  return TextReader(path, ' ', rules).read(
      "a frame number and 16 values of a 4x4 pose", [](size_t n) { return n == 17; },
      [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
        const auto v = file.values();
        if (v[13] != 0 || v[14] != 0 || v[15] != 0 || v[16] != 1)
          file.fail_here("expected 0 0 0 1 as the last row of the pose, got {} {} {} {}", v[13], v[14], v[15],
                         v[16]);
        out.poses.frames.push_back(frame_number(file, 0));
        add_matrix(out.poses, file, 1, log);
      });
}

TrajectoryFile read_euroc(const std::string& path, const ReadRules& rules) {
  return TextReader(path, ',', rules).read(
      "t[ns],px,py,pz,qw,qx,qy,qz[,...]", [](size_t n) { return n >= 8; },
      [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
        constexpr double kLeast_ns = 1e6;  // below: seconds, or a frame number
        const double t_ns = file.values()[0];
        if (t_ns != 0 && std::abs(t_ns) < kLeast_ns)
          file.fail_here("time stamp {} is below {} ns: expected nanoseconds", t_ns, kLeast_ns);
        out.poses.stamps_s.push_back(t_ns / 1e9);
        out.poses.add(quaternion_at(file, 4, true, log), position_at(file, 1));
      });
}

TrajectoryFile read_dynosam(const std::string& path, const ReadRules& rules) {
  return TextReader(path, ',', rules).read(
      "frame_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw",
      [](size_t n) { return n == 15; },
      [](const NumberFile& file, TrajectoryFile& out, RepairLog& log) {
        if (!out.truth) out.truth.emplace();
        for (PoseSeries* series : {&out.poses, &*out.truth}) {
          const size_t first = series == &out.poses ? 1 : 8;
          series->frames.push_back(frame_number(file, 0));
          series->add(quaternion_at(file, first + 3, false, log), position_at(file, first));
        }
      });
}

TrajectoryFile read_vdo_xml(const std::string& path, const ReadRules& rules) {
  RepairLog log;
  std::error_code error;
  const uint64_t bytes = std::filesystem::file_size(path, error);
  if (!error) check_size(path, bytes, rules);
  TrajectoryFile out;
  out.truth.emplace();
  read_vdo_frontend_xml(path, out.poses, *out.truth, log);
  sort_and_unite(out.poses, &*out.truth, log);
  out.warnings = log.warnings(path);
  return out;
}

const std::vector<TrajectoryFormat>& table() {
  static const std::vector<TrajectoryFormat> formats = {
      {"tum", "t tx ty tz qx qy qz qw", read_tum},
      {"kitti", "12 values of [R|t], or a frame number and these", read_kitti},
      {"euroc", "t[ns],px,py,pz,qw,qx,qy,qz[,...]", read_euroc},
      {"vdo", "frame number and 16 values of a 4x4 pose", read_vdo},
      {"dynosam", "DynOSAM camera_pose_log.csv, with its truth", read_dynosam},
      {"vdo_xml", "VDO-SLAM front end, boost XML, with its truth", read_vdo_xml},
  };
  return formats;
}

}  // namespace

std::span<const TrajectoryFormat> trajectory_formats() { return table(); }

std::string detect_trajectory_format(const std::string& path, const ReadRules& rules) {
  NumberFile blanks(path, ' ', rules);
  std::string problem;
  try {
    if (blanks.next()) {
      if (blanks.header().starts_with("<?xml") || blanks.header().starts_with("<!DOCTYPE")) return "vdo_xml";
      switch (blanks.values().size()) {
        case 8:
          return "tum";
        case 12:
        case 13:
          return "kitti";
        case 17:
          return "vdo";
        default:
          problem = fmt::format("its first record has {} values", blanks.values().size());
      }
    } else {
      problem = "it holds no record";
    }
  } catch (const Error& error) {
    problem = error.what();
  }
  if (blanks.header().starts_with("<?xml")) return "vdo_xml";
  try {
    NumberFile commas(path, ',', rules);
    if (commas.next() && commas.values().size() >= 8) {
      const bool dynosam = commas.values().size() == 15 && commas.header().find("gt_tx") != std::string::npos;
      return dynosam ? "dynosam" : "euroc";
    }
  } catch (const Error&) {  // told below
  }
  fail(
      "{}: cannot tell the format of this trajectory ({}); give --format tum, kitti, euroc, vdo, dynosam or "
      "vdo_xml",
      path, problem);
}

TrajectoryFile read_trajectory(const std::string& path, const std::string& format, const ReadRules& rules) {
  const std::string name =
      format.empty() || format == "auto" ? detect_trajectory_format(path, rules) : format;
  try {
    TrajectoryFile file = find_entry(trajectory_formats(), name, "trajectory format").read(path, rules);
    file.format = name;
    return file;
  } catch (const std::bad_alloc&) {
    fail("{}: does not fit into memory (104 bytes a pose)", path);
  }
}

std::string encode_tum(const PoseSeries& poses) {
  std::string out;
  for (size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Quaterniond q = poses.pose(i).rotation();
    const Eigen::Vector3d& p = poses.positions_m[i];
    const double t = !poses.stamps_s.empty() ? poses.stamps_s[i]
                     : !poses.frames.empty() ? poses.frames[i]
                                             : static_cast<double>(i);
    fmt::format_to(std::back_inserter(out),
                   "{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", t, p[0], p[1], p[2],
                   q.x(), q.y(), q.z(), q.w());
  }
  return out;
}

}  // namespace sextant
