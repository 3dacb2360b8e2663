#include "sextant/eval/external/external_results.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/external/trajectory_files.h"
#include "sextant/metrics/pose_change.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

struct Match {
  fs::path path;
  std::string star;  ///< what the * stands for
};

/// Files of `folder` called `pattern`, which may hold one *; in order of name.
std::vector<Match> matches(const fs::path& folder, const std::string& pattern) {
  const fs::path wanted = folder / pattern;
  const std::string name = wanted.filename().string();
  const size_t star = name.find('*');
  std::vector<Match> found;
  if (star == std::string::npos) {
    if (fs::is_regular_file(wanted)) found.push_back({wanted, ""});
    return found;
  }
  const std::string front = name.substr(0, star), back = name.substr(star + 1);
  if (!fs::is_directory(wanted.parent_path())) return found;
  for (const auto& entry : fs::directory_iterator(wanted.parent_path())) {
    const std::string file = entry.path().filename().string();
    if (!entry.is_regular_file() || file.size() < front.size() + back.size()) continue;
    if (!file.starts_with(front) || !file.ends_with(back)) continue;
    found.push_back({entry.path(), file.substr(front.size(), file.size() - front.size() - back.size())});
  }
  std::ranges::sort(found, {}, &Match::path);
  return found;
}

/// One poses or motions of a file, by frame of the sequence.
std::map<int, SE3> by_frame(const TrajectoryFile& file, const FrameNumbers& numbers, const std::string& path,
                            ExternalResults& out) {
  std::map<int, SE3> poses;
  for (size_t i = 0; i < file.poses.size(); ++i) {
    try {
      const int frame = !file.poses.frames.empty()     ? numbers.of_number(file.poses.frames[i])
                        : !file.poses.stamps_s.empty() ? numbers.of_time(file.poses.stamps_s[i])
                                                       : numbers.of_row(i);
      if (!poses.emplace(frame, file.poses.pose(i)).second)
        out.notes.push_back(fmt::format("{}: frame {} is there twice: the first counts", path, frame));
    } catch (const Error& error) {
      fail("{}: pose {}: {}", path, i + 1, error.what());
    }
  }
  for (const std::string& warning : file.warnings) out.notes.push_back(warning);
  return poses;
}

class Reader {
 public:
  Reader(const ExternalConfig& config, const fs::path& output, const FrameNumbers& numbers,
         const SequenceTruth& truth, bool finished, ExternalResults& out)
      : config_(config), output_(output), numbers_(numbers), truth_(truth), finished_(finished), out_(out) {}

  void read_camera() {
    const std::vector<Match> files = matches(output_, config_.camera.file);
    if (files.empty()) {
      out_.problems.push_back(
          fmt::format("{}: the program has not written this file", (output_ / config_.camera.file).string()));
      return;
    }
    if (files.size() > 1) {
      fail("{}: {} files match, such as {} and {}: expected one", (output_ / config_.camera.file).string(),
           files.size(), files.front().path.filename().string(), files.back().path.filename().string());
    }
    cut_unfinished_line(files.front().path);
    const std::string path = files.front().path.string();
    for (const auto& [frame, pose] :
         by_frame(read_trajectory(path, config_.camera.format), numbers_, path, out_))
      out_.camera.set(frame, config_.camera.inverse ? pose.inverse() : pose);
  }

  void read_objects() {
    const ExternalObjects& objects = config_.objects;
    if (objects.format == "motions" || objects.format == "poses") {
      for (const Match& file : matches(output_, objects.files)) read_object(file);
    } else if (objects.format != "none") {
      read_logs();
    }
    if (objects.ids == "overlap") match_ids();
  }

 private:
  void cut_unfinished_line(const fs::path& path) const {
    if (finished_) return;
    const std::string text = read_file(path);
    if (text.empty() || text.back() == '\n') return;
    fs::resize_file(path, text.rfind('\n') + 1);  // npos + 1 = 0
    out_.notes.push_back(fmt::format("{}: its last line is not finished: left out", path.string()));
  }

  void read_object(const Match& file) {
    const std::string path = file.path.string();
    int id = 0;
    const char* end = file.star.data() + file.star.size();
    if (const auto [stop, error] = std::from_chars(file.star.data(), end, id);
        error != std::errc() || stop != end) {
      fail("{}: expected a number in place of the * of '{}', got '{}'", path, config_.objects.files,
           file.star);
    }
    cut_unfinished_line(file.path);
    const TrajectoryFile read = read_trajectory(path);
    const std::map<int, SE3> poses = by_frame(read, numbers_, path, out_);
    if (config_.objects.format == "motions") {
      if (read.poses.frames.empty() && read.poses.stamps_s.empty())
        fail("{}: expected a frame number or time stamp in each line of a file of motions", path);
      for (const auto& [frame, motion] : poses) add(id, frame, motion, config_.objects.frame);
      return;
    }
    for (const auto& [frame, pose] : poses) {
      const auto before = poses.find(frame - 1);
      if (before != poses.end()) add(id, frame, pose * before->second.inverse(), "world");
    }
  }

  void read_logs() {
    for (const auto& entry : fs::directory_iterator(output_)) {
      if (entry.is_regular_file()) cut_unfinished_line(entry.path());
    }
    const std::vector<ObjectLog> logs = read_object_logs(output_.string(), config_.objects.format);
    if (logs.size() > 1)
      fail("{}: holds logs of {} modules: expected those of one", output_.string(), logs.size());
    out_.notes.insert(out_.notes.end(), logs.front().warnings.begin(), logs.front().warnings.end());
    for (const auto& [key, motion] : logs.front().motions) {
      add(key.first, numbers_.of_number(key.second), motion.estimate,
          logs.front().frame == MotionFrame::world ? "world" : "body");
    }
  }

  /// A motion to current camera coordinates; one that needs a pose which is not known is left out.
  void add(int id, int frame, const SE3& motion, const std::string& coordinates) {
    std::optional<SE3> X;
    if (coordinates == "camera") X = motion;
    const std::optional<SE3> before = out_.camera.pose(frame - 1), after = out_.camera.pose(frame);
    if (coordinates == "world" && before && after) X = after->inverse() * motion * *before;
    const ObjectTruth* object = truth_.find(frame - 1, id + config_.objects.id_offset);
    if (coordinates == "body" && before && after && object != nullptr) {
      const SE3& L = object->T_camera_object;
      X = after->inverse() * *before * L * motion * L.inverse();
    }
    if (X) out_.motions.emplace(ObjectFrame(id + config_.objects.id_offset, frame), *X);
  }

  /// The program's ids to those of the masks. Motions are compared in the true world.
  void match_ids() {
    ObjectLog log;
    for (const auto& [key, X] : out_.motions) {
      const auto before = truth_.camera.pose(key.second - 1), after = truth_.camera.pose(key.second);
      if (before && after) log.motions[key].estimate = world_motion(*before, *after, X);
    }
    take_truth(log, truth_);
    out_.notes.insert(out_.notes.end(), log.warnings.begin(), log.warnings.end());
    out_.motions.clear();
    for (const auto& [key, motion] : log.motions) {
      const auto before = truth_.camera.pose(key.second - 1), after = truth_.camera.pose(key.second);
      if (motion.truth) out_.motions[key] = after->inverse() * motion.estimate * *before;
    }
  }

  const ExternalConfig& config_;
  const fs::path& output_;
  const FrameNumbers& numbers_;
  const SequenceTruth& truth_;
  bool finished_;
  ExternalResults& out_;
};

}  // namespace

int FrameNumbers::of_number(int number) const {
  const int frame = number - in_results + first;
  if (frame < first || frame > last) {
    fail("frame {} is not among {} to {} of the input; if the program counts otherwise, give first_frame",
         number, in_results, in_results + last - first);
  }
  return frame;
}

int FrameNumbers::of_time(double t_s) const {
  constexpr double nearest = 0.25;  // of a frame
  const double at = t_s * rate_hz - in_files;
  const double rounded = std::round(at);
  if (!(std::abs(at - rounded) <= nearest && rounded >= 0 && rounded <= last - first)) {
    fail("time {} s is that of no frame: the input has {} to {} s in steps of {} s", t_s, in_files / rate_hz,
         (in_files + last - first) / rate_hz, 1 / rate_hz);
  }
  return first + static_cast<int>(rounded);
}

int FrameNumbers::of_row(size_t row) const {
  if (row > static_cast<size_t>(last - first)) {
    fail("the input has only {} frames: poses without frame number or time stamp are one a frame",
         last - first + 1);
  }
  return first + static_cast<int>(row);
}

ExternalResults read_external_results(const ExternalConfig& config, const fs::path& output,
                                      const FrameNumbers& numbers, const SequenceTruth& truth,
                                      bool finished) {
  ExternalResults out;
  Reader reader(config, output, numbers, truth, finished, out);
  try {
    reader.read_camera();
  } catch (const Error& error) {
    out.camera_unreadable = true;
    out.problems.emplace_back(error.what());
  }
  try {
    reader.read_objects();
  } catch (const Error& error) {
    out.objects_unreadable = true;
    out.motions.clear();
    out.problems.emplace_back(error.what());
  }
  return out;
}

}  // namespace sextant
