#include "sextant/eval/logs/object_log_files.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <limits>

namespace sextant {

namespace {

/// Meaning of the first value of a line; row: lines have no such value, and row i belongs to frame i.
enum class Key { frame, time, row };

struct Row {
  double key = 0;
  int64_t line = 0;
  SE3 pose;
};

struct PlainFile {
  std::string path;
  Key key = Key::row;
  bool whole_numbers = true;  ///< all keys are
  std::vector<Row> rows;
  std::vector<PoseCovariance> covariances;  ///< of the rows; may be empty
};

PlainFile read_rows(const LogFolder& folder, const std::string& name, ObjectLog& out) {
  PlainFile file;
  PoseSeries covered;  // the rows with a covariance
  for_each_record(folder, name, NumberFile::either, out, [&](const NumberFile& lines, RepairLog& repairs) {
    const size_t n = lines.values().size();
    Row row{lines.values()[0], lines.line(), {}};
    const bool has_covariance = n > 8 && is_covariance_size(n - 8), tum = n == 8 || has_covariance;
    if (tum) {
      row.pose = quaternion_pose(lines, 1, repairs);
    } else if (n == 13 || n == 17) {
      row.pose = matrix_pose(lines, 1, repairs);
    } else if (n == 12 || n == 16) {
      row.key = static_cast<double>(file.rows.size());
      row.pose = matrix_pose(lines, 0, repairs);
    } else {
      lines.fail_here(
          "expected a frame and 12 or 16 values of a matrix, or t x y z qx qy qz qw and optionally 12, 21 or "
          "36 values of a covariance, got {} values",
          n);
    }
    const Key key = tum ? Key::time : n == 12 || n == 16 ? Key::row : Key::frame;
    if (!file.rows.empty() && key != file.key)
      lines.fail_here("this line has another format than the lines before: write all lines in one format");
    if (!file.rows.empty() && !(row.key > file.rows.back().key)) {
      lines.fail_here("{} {} comes after {}: expected ascending frames or times, each once",
                      tum ? "time" : "frame", row.key, file.rows.back().key);
    }
    file.key = key;
    file.whole_numbers = file.whole_numbers && row.key == std::trunc(row.key);
    file.rows.push_back(row);
    if (!has_covariance) return;
    covered.add(row.pose);
    covered.lines.push_back(static_cast<int>(row.line));
    add_covariance(covered, lines.values().subspan(8), folder.request().rules.covariance, lines.path(),
                   lines.line());
  });
  file.path = (std::filesystem::path(folder.path()) / name).string();
  if (!covered.empty()) {
    if (covered.size() != file.rows.size())
      fail("{}: {} of {} rows have covariances: expected one in each row, or none", file.path, covered.size(),
           file.rows.size());
    RepairLog repairs;
    finish_covariances(covered, file.path, repairs);
    for (std::string& text : repairs.warnings(file.path)) out.warnings.push_back(std::move(text));
    file.covariances = std::move(covered.covariances);
  }
  return file;
}

/// The column of the time holds frame numbers if it holds whole numbers in all files of a log: a single
/// motion may well be at a whole second. Throws Error if the whole numbers of a file are no times of the
/// other files.
void read_whole_times_as_frames(std::vector<PlainFile>& files) {
  std::vector<PlainFile*> whole;
  const PlainFile* other = nullptr;
  double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;
  for (PlainFile& file : files) {
    if (file.key != Key::time) continue;
    if (file.whole_numbers) {
      whole.push_back(&file);
      continue;
    }
    other = &file;
    first_s = std::min(first_s, file.rows.front().key);
    last_s = std::max(last_s, file.rows.back().key);
  }
  for (PlainFile* file : whole) {
    if (other == nullptr) file->key = Key::frame;
    const double first = file->rows.front().key, last = file->rows.back().key;
    if (other != nullptr && (first < first_s - 1 || last > last_s + 1)) {
      fail(
          "{}: its first column holds whole numbers from {} to {}, which are no times of {} and the other "
          "files, {} to {} s: write the time in s, or the frame number, in all files",
          file->path, first, last, other->path, first_s, last_s);
    }
  }
}

/// Returns the rate of the frames in Hz, 1 / the smallest step between the times of a file, rounded to a
/// whole number if that is within 0.1 %; nullopt if no file has two times.
std::optional<double> rate_of(const std::vector<PlainFile>& files) {
  double least_s = std::numeric_limits<double>::infinity();
  for (const PlainFile& file : files) {
    if (file.key != Key::time) continue;
    for (size_t i = 1; i < file.rows.size(); ++i)
      least_s = std::min(least_s, file.rows[i].key - file.rows[i - 1].key);
  }
  if (!std::isfinite(least_s)) return std::nullopt;
  const double rate = 1 / least_s;
  // Times are written with a few digits.
  const double rounded = std::round(rate);
  return rounded > 0 && std::abs(rate - rounded) < 1e-3 * rate ? rounded : rate;
}

constexpr double largest_frame = 1e9;

/// Makes the first time of all files the time of frame 0 if frames that are counted from time 0 have too
/// large numbers, as those of Unix time.
void count_frames_from_first_time(double rate_hz, std::vector<PlainFile>& files,
                                  std::vector<std::string>& warnings) {
  double first_s = std::numeric_limits<double>::infinity();
  for (const PlainFile& file : files)
    if (file.key == Key::time) first_s = std::min(first_s, file.rows.front().key);
  if (!std::isfinite(first_s) || first_s * rate_hz <= largest_frame) return;
  for (PlainFile& file : files) {
    if (file.key != Key::time) continue;
    for (Row& row : file.rows) row.key -= first_s;
  }
  warnings.push_back(fmt::format("the times begin at {:.6f} s, which is taken as frame 0", first_s));
}

/// Calls use(frame, row) for each row. Throws Error if a time is more than a quarter of a step away from the
/// nearest frame, or if two rows belong to the same frame.
template <typename Use>
void for_each_frame(const PlainFile& file, double rate_hz, const Use& use) {
  std::optional<int> last;
  for (const Row& row : file.rows) {
    const double at = file.key == Key::time ? row.key * rate_hz : row.key;
    const double frame = std::round(at);
    const double nearest = file.key == Key::time ? 0.25 : 0;
    if (!(std::abs(at - frame) <= nearest) || !(frame >= 0) || frame > largest_frame) {
      fail("{}:{}: {} {} does not belong to any frame{}", file.path, row.line,
           file.key == Key::time ? "time" : "frame", row.key,
           file.key == Key::time
               ? fmt::format(" at {:.6g} Hz: give --rate, or frame numbers in the first column", rate_hz)
               : ": expected a whole number from 0 to 1e9");
    }
    if (last == static_cast<int>(frame)) {
      fail("{}:{}: frame {} is given twice{}", file.path, row.line, frame,
           file.key == Key::time ? fmt::format(" at {:.6g} Hz: give --rate", rate_hz) : ": keep one line");
    }
    last = static_cast<int>(frame);
    use(*last, row);
  }
}

struct ObjectFile {
  std::string name;
  int id = 0;
  bool is_truth = false;
};

/// Parses "obj_3_motion.txt", "obj_3.tum", "obj_3_gt.tum", "object_3_pose_gt.txt", for the kind "motion" or
/// "pose".
std::optional<ObjectFile> object_file(const std::string& name, std::string_view kind) {
  std::string_view rest = name;
  if (rest.starts_with("object_"))
    rest.remove_prefix(7);
  else if (rest.starts_with("obj_"))
    rest.remove_prefix(4);
  else
    return std::nullopt;
  ObjectFile file{name};
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), file.id);
  if (error != std::errc() || file.id < 0 || file.id > 1'000'000'000) return std::nullopt;
  rest.remove_prefix(static_cast<size_t>(end - rest.data()));
  const size_t dot = rest.rfind('.');
  if (dot == std::string_view::npos) return std::nullopt;
  rest = rest.substr(0, dot);
  if (rest.ends_with("_gt")) {
    file.is_truth = true;
    rest.remove_suffix(3);
  }
  const std::string plural = fmt::format("_{}s", kind), singular = fmt::format("_{}", kind);
  if (!rest.empty() && rest != singular && rest != plural) return std::nullopt;
  return file;
}

/// Returns the first of `names` that is a file of the folder; empty if there is none.
std::string first_of(const LogFolder& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (folder.has(name)) return name;
  }
  return "";
}

}  // namespace

std::vector<ObjectLog> read_plain(const LogFolder& folder) {
  const bool poses = folder.request().format == LogFormat::poses;
  ObjectLog log;
  log.holds_poses_only = poses;
  log.estimator = std::filesystem::path(folder.path()).lexically_normal().filename().string();
  if (log.estimator.empty())
    log.estimator = std::filesystem::path(folder.path()).lexically_normal().parent_path().filename().string();
  std::vector<ObjectFile> names;
  std::vector<PlainFile> files;
  for (const std::string& name : folder.names()) {
    const auto found = object_file(name, poses ? "pose" : "motion");
    if (!found) continue;
    for (const ObjectFile& other : names) {
      if (other.id == found->id && other.is_truth == found->is_truth)
        fail("{}: both {} and {} are of object {}: keep one", folder.path(), other.name, name, found->id);
    }
    files.push_back(read_rows(folder, name, log));
    if (!poses && files.back().key == Key::row && !files.back().rows.empty()) {
      fail("{}:{}: expected a frame number before the matrix: a motion without one belongs to no frame",
           files.back().path, files.back().rows.front().line);
    }
    names.push_back(*found);
  }
  const size_t n_objects = files.size();
  const std::string camera = first_of(folder, {"est_camera_tum.txt", "camera.txt", "camera.tum"}),
                    true_camera = first_of(folder, {"gt_camera_tum.txt", "camera_gt.txt", "camera_gt.tum"});
  for (const std::string& name : {camera, true_camera})
    files.push_back(name.empty() ? PlainFile() : read_rows(folder, name, log));
  read_whole_times_as_frames(files);
  log.rate_hz = rate_of(files);
  const double rate_hz = folder.request().rate_hz.value_or(log.rate_hz.value_or(10));
  count_frames_from_first_time(rate_hz, files, log.warnings);

  std::map<ObjectFrame, SE3> motions, truth;
  for (size_t i = 0; i < n_objects; ++i) {
    const int id = names[i].id;
    LogLines& lines = poses ? log.pose_lines : log.motion_lines;
    for_each_frame(files[i], rate_hz, [&](int frame, const Row& row) {
      const ObjectFrame key(id, frame);
      if (names[i].is_truth) {
        lines.object_path[id] = files[i].path;
        lines.lines[key] = row.line;
        if (is_identity(row.pose) && !poses)
          log.warnings.push_back(lines.at(key) + ": the truth is exactly the identity: treated as missing");
        else
          (poses ? log.true_poses : truth).emplace(key, row.pose);
      } else {
        (poses ? log.poses : motions).emplace(key, row.pose);
        if (files[i].covariances.empty()) return;
        LogCovariances& covariances = poses ? log.pose_covariances : log.motion_covariances;
        const auto at = static_cast<size_t>(&row - files[i].rows.data());
        covariances.entries.emplace(
            key, LogCovariances::Entry{files[i].covariances[at], static_cast<int>(row.line)});
        covariances.paths[id] = files[i].path;
      }
    });
  }
  for (const auto& [key, pose] : log.poses) {  // only in format poses
    if (const auto H = world_step(log.poses, key)) motions.emplace(key, *H);
  }
  for (const auto& [key, pose] : log.true_poses) {
    if (const auto H = world_step(log.true_poses, key)) truth.emplace(key, *H);
  }
  for (const auto& [key, motion] : motions) log.motions[key].estimate = motion;
  for (const auto& [key, motion] : truth) log.add_truth(key, motion);
  for_each_frame(files[n_objects], rate_hz,
                 [&](int frame, const Row& row) { log.camera.set(frame, row.pose); });
  for_each_frame(files[n_objects + 1], rate_hz, [&](int frame, const Row& row) {
    log.true_camera.set(frame, row.pose);
    log.camera_lines.path = files[n_objects + 1].path;
    log.camera_lines.lines[{0, frame}] = row.line;
  });
  if (log.motions.empty()) {
    fail("{}: holds no {}: expected files obj_<id>{}.txt", folder.path(),
         poses ? "poses of an object in two successive frames" : "motions of objects",
         poses ? "_pose" : "_motion");
  }
  return {log};
}

}  // namespace sextant
