#pragma once

// Access to the folder and the lines of object logs, for their readers (object_logs.h).

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/logs/pose_collector.h"

namespace sextant {

inline bool is_identity(const SE3& T) { return T.translation().isZero(0) && std::abs(T.rotation().w()) == 1; }

inline SE3 quaternion_pose(const NumberFile& file, size_t first, RepairLog& log) {
  return {Eigen::Quaterniond(quaternion_at(file, first + 3, log)), position_at(file, first)};
}

/// A folder of logs, restricted to the files that the request accepts.
class LogFolder {
 public:
  LogFolder(const std::string& path, const ObjectLogRequest& request) : path_(path), request_(request) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path, error)) {
      if (!request.accept || request.accept(entry.path())) names_.push_back(entry.path().filename());
    }
    if (error) fail("{}: cannot read this folder: {}", path, error.message());
    std::sort(names_.begin(), names_.end());
  }
  const std::string& path() const { return path_; }
  const std::vector<std::string>& names() const { return names_; }
  bool has(const std::string& name) const { return std::ranges::find(names_, name) != names_.end(); }
  const ObjectLogRequest& request() const { return request_; }
  NumberFile open(const std::string& name, char separator) const {
    return NumberFile((fs::path(path_) / name).string(), separator, request_.rules);
  }

 private:
  std::string path_;
  const ObjectLogRequest& request_;
  std::vector<std::string> names_;
};

/// Calls use(file, repairs) for each record of a file; repairs become warnings.
template <typename Use>
void for_each_record(const LogFolder& folder, const std::string& name, char separator, ObjectLog& out,
                     const Use& use) {
  RepairLog repairs;
  NumberFile file = folder.open(name, separator);
  while (file.next()) use(file, repairs);
  note_cut(file, repairs);
  for (std::string& text : repairs.warnings(file.path())) out.warnings.push_back(std::move(text));
}

/// Checks that the frames of each object in a file are ascending.
class FrameOrder {
 public:
  /// Records the frame of `key`, and in `lines`, if given, its line. Throws Error unless the frame is greater
  /// than the last one of the same id. `what` names the id in messages: "object", "label" or "camera".
  void check(const NumberFile& file, ObjectFrame key, const char* what, LogLines* lines = nullptr) {
    const auto [last, is_first] = last_.try_emplace(key.first, key.second);
    if (!is_first && key.second == last->second)
      file.fail_here("{} {} is given twice in frame {}", what, key.first, key.second);
    if (!is_first && key.second < last->second) {
      file.fail_here("{} {}: frame {} comes after frame {}: expected ascending frames: sort the lines", what,
                     key.first, key.second, last->second);
    }
    last->second = key.second;
    if (lines) lines->path = file.path(), lines->lines[key] = file.line();
  }

 private:
  std::map<int, int> last_;
};

/// Returns the pose of 12 or 16 values, row by row, from `first` on. Throws Error if a last row is not
/// 0 0 0 1, or if the rotation or the position is invalid (pose_collector.h).
inline SE3 matrix_pose(const NumberFile& file, size_t first, RepairLog& log) {
  const std::span<const double> v = file.values();
  if (v.size() == first + 16) {
    const auto last = v.subspan(first + 12, 4);
    constexpr double rounding = 1e-6;
    const bool is_transposed =
        std::abs(v[first + 3]) + std::abs(v[first + 7]) + std::abs(v[first + 11]) < rounding &&
        std::abs(last[0]) + std::abs(last[1]) + std::abs(last[2]) > rounding;
    if (std::abs(last[0]) > rounding || std::abs(last[1]) > rounding || std::abs(last[2]) > rounding ||
        std::abs(last[3] - 1) > rounding) {
      file.fail_here("the last row of the 4x4 matrix is {} {} {} {}, expected 0 0 0 1{}", last[0], last[1],
                     last[2], last[3],
                     is_transposed ? ": the matrix looks transposed (written column by column): transpose it"
                                   : ": write the matrix row by row");
    }
  }
  PoseSeries one;
  add_matrix(one, file, first, log);
  return one.pose(0);
}

// ---- The formats `motions` and `poses` of object_logs.h: one file per object.

/// Returns one log with all objects of the folder. Throws Error if the files contain no motion.
std::vector<ObjectLog> read_plain(const LogFolder& folder);

}  // namespace sextant
