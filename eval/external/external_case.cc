#include "sextant/eval/external/external_case.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/logs/number_file.h"
#include "sextant/eval/logs/object_association.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {

CaseFolder::CaseFolder(const fs::path& folder, Keep keep) : keep_(keep) {
  if (folder.empty()) {
    path_ = scratch_.emplace("sextant_case_").path();
  } else {
    path_ = fs::absolute(folder).lexically_normal();
    fs::remove_all(path_);  // left by an interrupted run
    // OUT/external/CASE
    const fs::path cases = path_.parent_path();
    fs::create_directories(cases.parent_path());
    make_folder_below(cases.parent_path(), cases.filename() / path_.filename());
  }
  fs::create_directory(output());
}

CaseFolder::~CaseFolder() {
  std::error_code ignored;
  if (keep_ != Keep::all) fs::remove_all(input(), ignored);
  if (keep_ != Keep::all && keep_ != Keep::output) fs::remove_all(output(), ignored);
}

void write_case(const ProcessOutcome& outcome, const fs::path& folder) {
  write_file(folder / "case.json", json_line(write_options(outcome)) + "\n");
}

ProcessOutcome read_case(const fs::path& folder) {
  const fs::path path = folder / "case.json";
  if (!fs::exists(path)) fail("{}: does not exist: expected the folder of a finished case", path.string());
  if (!fs::is_directory(folder / "output"))
    fail("{}: does not exist: outputs are kept with \"keep\" output or all", (folder / "output").string());
  return options_from<ProcessOutcome>(path);
}

std::string last_line(const fs::path& path) {
  constexpr std::streamoff most = 4096;
  constexpr size_t shown = 200;
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = in.tellg();
  in.seekg(std::max<std::streamoff>(0, size - most));
  std::string line, last;
  while (std::getline(in, line)) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  }
  while (!last.empty() && (last.back() == '\r' || last.back() == ' ')) last.pop_back();
  std::ranges::replace_if(
      last, [](char c) { return c < ' ' || c > '~'; }, '?');
  return last.size() <= shown ? last : "..." + last.substr(last.size() - shown);
}

NoisySequence::NoisySequence(const Sequence& base, Noise noise, uint64_t seed, const ShownSequence& shown)
    : base_(base),
      noise_(std::move(noise)),
      draws_(seed, base.info().dataset, base.info().sequence),
      info_(base.info()),
      shift_(shown.from_zero ? base.info().first_frame : 0),
      zero_last_flow_(shown.zero_last_flow) {
  info_.exact = {};
  info_.times_s.clear();  // frames are at number / rate
  info_.first_frame -= shift_;
  info_.last_frame -= shift_;
  if (!shown.truth) return;
  truth_.camera_step_floor_m = base.truth().camera_step_floor_m;
  for (const auto& [frame, pose] : base.truth().camera.poses()) truth_.camera.set(frame - shift_, pose);
  for (const auto& [frame, objects] : base.truth().objects) truth_.objects[frame - shift_] = objects;
}

Frame NoisySequence::read(int frame, Channels channels) const {
  Channels needed = channels;
  // the noise depends on the body
  needed.mask = channels.mask || (!noise_.none() && (channels.flow || channels.backward_flow));
  Frame out = base_.read(frame + shift_, needed);
  if (!noise_.none()) out = noise_.apply(std::move(out), info_.camera, draws_).frame;
  if (!channels.mask) out.mask = {};
  out.index = frame;
  if (channels.flow && zero_last_flow_ && frame == info_.last_frame && out.flow.empty())
    out.flow = Image<Flow>(info_.width, info_.height, {0, 0});
  return out;
}

namespace {

struct Match {
  fs::path path;
  std::string star;  ///< the text matched by the *
};

/// The readable files of a result folder, and the rules for reading them.
class Files {
 public:
  Files(const ResultFolder& folder, std::vector<std::string>& notes)
      : folder_(folder),
        root_(fs::canonical(folder.path.parent_path()) / folder.path.filename()),
        notes_(notes) {}

  std::string path(const std::string& name) const { return (folder_.path / name).string(); }

  /// Returns the files that match `pattern`, which may contain one *, ordered by name.
  std::vector<Match> matches(const std::string& pattern) const {
    const fs::path wanted = folder_.path / pattern;
    const std::string name = wanted.filename().string();
    const size_t star = name.find('*');
    std::vector<Match> found;
    if (star == std::string::npos) {
      if (accepts(wanted)) found.push_back({wanted, ""});
      return found;
    }
    const std::string front = name.substr(0, star), back = name.substr(star + 1);
    if (!fs::is_directory(wanted.parent_path())) return found;
    for (const auto& entry : fs::directory_iterator(wanted.parent_path())) {
      const std::string file = entry.path().filename().string();
      if (file.size() < front.size() + back.size()) continue;
      if (!file.starts_with(front) || !file.ends_with(back) || !accepts(entry.path())) continue;
      found.push_back({entry.path(), file.substr(front.size(), file.size() - front.size() - back.size())});
    }
    std::ranges::sort(found, {}, &Match::path);
    return found;
  }

  /// Returns true for a file of this folder; a link to a file elsewhere is noted.
  bool accepts(const fs::path& path) const {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return false;
    const fs::path real = fs::canonical(path, error);
    if (!error && std::ranges::mismatch(root_, real).in1 == root_.end()) return true;
    notes_.push_back(fmt::format("{}: leads to a file outside {{output}}: ignored", path.string()));
    return false;
  }

  ReadRules rules(const FileKind& kind) const { return {kind, !folder_.finished}; }

 private:
  const ResultFolder& folder_;
  fs::path root_;
  std::vector<std::string>& notes_;
};

/// Returns the poses or motions of a file by frame of the sequence.
std::map<int, SE3> by_frame(const TrajectoryFile& file, const FrameNumbers& numbers, const std::string& path,
                            ExternalResults& out) {
  std::map<int, SE3> poses;
  for (size_t i = 0; i < file.poses.size(); ++i) {
    try {
      const int frame = !file.poses.frames.empty()     ? numbers.of_number(file.poses.frames[i])
                        : !file.poses.stamps_s.empty() ? numbers.of_time(file.poses.stamps_s[i])
                                                       : numbers.of_row(i);
      if (!poses.emplace(frame, file.poses.pose(i)).second)
        out.notes.push_back(fmt::format("{}: frame {} is repeated: the first one is used", path, frame));
    } catch (const Error& error) {
      fail("{}: pose {}: {}", path, i + 1, error.what());
    }
  }
  for (const std::string& warning : file.warnings) out.notes.push_back(warning);
  return poses;
}

bool is_unnumbered(const TrajectoryFile& file) {
  return file.poses.frames.empty() && file.poses.stamps_s.empty();
}

constexpr int64_t largest_id = 1'000'000'000;  // the sum of two fits into an int

/// Returns the number in `text` if it is in the range of ids; nullopt if it is not a number.
std::optional<int64_t> id_in(const std::string& text) {
  const size_t sign = text.starts_with('-') ? 1 : 0;
  if (!is_digits(std::string_view(text).substr(sign))) return std::nullopt;
  const int64_t beyond = (sign == 1 ? -2 : 2) * largest_id;
  return std::clamp(whole_number<int64_t>(text).value_or(beyond), -2 * largest_id, 2 * largest_id);
}

/// Returns true if rows without frame numbers end before the last frame although the program ended normally:
/// a program that leaves out a frame shifts all later rows by one frame.
bool misses_rows(size_t n_rows, const ResultFolder& folder) {
  return folder.finished && n_rows < folder.numbers.n_frames();
}

std::string taken_as_first_frames(const std::string& what, size_t n_rows, const std::string& path,
                                  const ResultFolder& folder) {
  return fmt::format(
      "{} of {} of {} frames: {} has no frame numbers, so its rows are taken as the first {} frames; write a "
      "frame number before each row if the program leaves out frames",
      what, n_rows, folder.numbers.n_frames(), path, n_rows);
}

class Reader {
 public:
  Reader(const ExternalResultSet& set, const ResultFolder& folder, const SequenceTruth& truth,
         ExternalResults& out)
      : set_(set), folder_(folder), truth_(truth), out_(out), files_(folder, out.notes) {}

  void read_camera() {
    const std::string& name = set_.camera.file;
    const std::vector<Match> found = files_.matches(name);
    if (found.empty()) {
      out_.problems.push_back(fmt::format("{}: the program did not write this file", files_.path(name)));
      return;
    }
    if (found.size() > 1) {
      fail("{}: {} files match, such as {} and {}: expected one", files_.path(name), found.size(),
           found.front().path.filename().string(), found.back().path.filename().string());
    }
    const std::string path = found.front().path.string();
    const TrajectoryFile file = read_trajectory(path, set_.camera.format, files_.rules(pose_file));
    out_.camera_has_quaternions = file.has_quaternions;
    for (const auto& [frame, pose] : by_frame(file, folder_.numbers, path, out_))
      out_.camera.set(frame, set_.camera.inverse ? pose.inverse() : pose);
    if (is_unnumbered(file) && misses_rows(file.poses.size(), folder_))
      out_.problems.push_back(taken_as_first_frames("camera poses", file.poses.size(), path, folder_));
  }

  void read_objects() {
    const ExternalObjects& objects = set_.objects;
    if (objects.format == ObjectsFormat::motions)
      out_.declared_frame = from_name<MotionFrame>(to_string(objects.frame), "frame");
    if (objects.format == ObjectsFormat::motions || objects.format == ObjectsFormat::poses) {
      for (const Match& file : files_.matches(objects.files)) read_object(file);
    } else if (objects.format != ObjectsFormat::none) {
      read_logs();
    }
    if (objects.ids == ObjectsIds::overlap) match_ids();
  }

 private:
  /// Returns `id` + id_offset: the id in the masks or, if ids are matched by overlap, one that is not matched
  /// yet. If it is out of range, reports a problem and returns nullopt.
  std::optional<int> mask_id(int64_t id, const std::string& where) {
    const int64_t least = set_.objects.ids == ObjectsIds::overlap ? 0 : 1;
    const int64_t own = id + set_.objects.id_offset;
    if (own >= least && own <= largest_id) return static_cast<int>(own);
    if (refused_.insert(id).second) {
      out_.problems.push_back(
          fmt::format("{}: object {} with id_offset {} is left out: expected an id from {} to {}", where, id,
                      set_.objects.id_offset, least, largest_id));
    }
    return std::nullopt;
  }

  void read_object(const Match& file) {
    const std::string path = file.path.string();
    const std::optional<int64_t> number = id_in(file.star);
    if (!number) {
      out_.notes.push_back(fmt::format("{}: '{}' in place of the * of '{}' is not a number: skipped", path,
                                       file.star, set_.objects.files));
      return;
    }
    const std::optional<int> id = mask_id(*number, path);
    if (!id) return;
    const auto [first, is_first] = file_of_.emplace(*id, file.path);
    try {
      if (!is_first) {
        fail("{}: is a file of object {}, as is {}: expected one file for each object", path, *id,
             first->second.filename().string());
      }
      read_object(path, *id);
    } catch (const Error& error) {
      out_.unreadable.insert(*id);
      for (auto* motions : {&out_.motions, &in_body_})
        std::erase_if(*motions, [&](const auto& motion) { return motion.first.first == *id; });
      out_.problems.emplace_back(error.what());
    }
  }

  void read_object(const std::string& path, int id) {
    const TrajectoryFile read = read_trajectory(path, "auto", files_.rules(pose_file));
    if (!read.has_quaternions) out_.motions_have_quaternions = false;
    const std::map<int, SE3> poses = by_frame(read, folder_.numbers, path, out_);
    if (set_.objects.format == ObjectsFormat::motions) {
      if (is_unnumbered(read))
        fail("{}: expected a frame number or time stamp in each line of a file of motions", path);
      for (const auto& [frame, motion] : poses) add(id, frame, motion, out_.declared_frame);
      return;
    }
    // Objects often appear after the first frame, so that rows without numbers may belong to any frames.
    if (is_unnumbered(read) && misses_rows(read.poses.size(), folder_)) {
      fail(
          "{}: expected a frame number or time stamp in each line of a file of poses with {} rows for {} "
          "frames",
          path, read.poses.size(), folder_.numbers.n_frames());
    }
    for (const auto& [frame, pose] : poses) {
      const auto before = poses.find(frame - 1);
      if (before != poses.end()) add(id, frame, pose * before->second.inverse(), MotionFrame::world);
    }
  }

  void read_logs() {
    const std::string folder = folder_.path.string();
    const std::vector<ObjectLog> logs = read_object_logs(
        folder, {.format = set_.objects.format == ObjectsFormat::vdo ? LogFormat::vdo : LogFormat::dynosam,
                 .stage = set_.objects.stage,
                 .rules = files_.rules(log_file),
                 .accept = [&](const fs::path& path) { return files_.accepts(path); }});
    if (logs.size() > 1)
      fail("{}: holds logs of {} modules: expected logs of one module", folder, logs.size());
    out_.notes.insert(out_.notes.end(), logs.front().warnings.begin(), logs.front().warnings.end());
    out_.declared_frame = logs.front().frame;
    out_.motions_have_quaternions = set_.objects.format != ObjectsFormat::vdo;
    for (const auto& [key, motion] : logs.front().motions) {
      const std::optional<int> id = mask_id(key.first, folder);
      if (!id) continue;
      add(*id, folder_.numbers.of_number(key.second), motion.estimate, out_.declared_frame);
    }
  }

  /// Converts a motion to current camera coordinates; it is left out if a required pose is unknown.
  void add(int id, int frame, const SE3& motion, MotionFrame coordinates) {
    if (coordinates == MotionFrame::body &&
        set_.objects.ids == ObjectsIds::overlap) {  // the matching body is not known yet
      in_body_.emplace(ObjectFrame(id, frame), motion);
      return;
    }
    std::optional<SE3> X;
    if (coordinates == MotionFrame::camera) X = motion;
    const std::optional<SE3> before = out_.camera.pose(frame - 1), after = out_.camera.pose(frame);
    if (coordinates == MotionFrame::world && before && after) X = after->inverse() * motion * *before;
    if (coordinates == MotionFrame::body) X = from_body(id, frame, motion);
    if (X) out_.motions.emplace(ObjectFrame(id, frame), *X);
    if (!X && out_.camera_unreadable && set_.objects.ids != ObjectsIds::overlap) out_.unreadable.insert(id);
  }

  std::optional<SE3> from_body(int id, int frame, const SE3& motion) const {
    const std::optional<SE3> before = out_.camera.pose(frame - 1), after = out_.camera.pose(frame);
    const ObjectTruth* object = truth_.find(frame - 1, id);
    if (!before || !after || object == nullptr) return std::nullopt;
    const SE3& L = object->T_camera_object;
    return after->inverse() * *before * L * motion * L.inverse();
  }

  /// Maps the program's ids to the ids of the masks. Motions are compared in the true world, or in the body
  /// frame.
  void match_ids() {
    ObjectLog log;
    const bool in_body = !in_body_.empty();
    log.frame = in_body ? MotionFrame::body : MotionFrame::world;
    for (const auto& [key, motion] : in_body_) log.motions[key].estimate = motion;
    for (const auto& [key, X] : out_.motions) {
      const auto before = truth_.camera.pose(key.second - 1), after = truth_.camera.pose(key.second);
      if (before && after) log.motions[key].estimate = world_motion(*before, *after, X);
    }
    take_truth(log, truth_);
    out_.notes.insert(out_.notes.end(), log.warnings.begin(), log.warnings.end());
    out_.motions.clear();
    for (const auto& [key, motion] : log.motions) {
      if (!motion.truth) continue;
      if (in_body) {
        if (const auto X = from_body(key.first, key.second, motion.estimate)) out_.motions[key] = *X;
      } else {
        const auto before = truth_.camera.pose(key.second - 1), after = truth_.camera.pose(key.second);
        out_.motions[key] = after->inverse() * motion.estimate * *before;
      }
    }
  }

  const ExternalResultSet& set_;
  const ResultFolder& folder_;
  const SequenceTruth& truth_;
  ExternalResults& out_;
  Files files_;
  std::set<int64_t> refused_;
  std::map<int, fs::path> file_of_;     ///< the first file of each object
  std::map<ObjectFrame, SE3> in_body_;  ///< motions in the body frame of ids that are not matched yet
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
  constexpr double nearest = 0.25;  // of a frame interval
  const double at = t_s * rate_hz - in_files;
  const double rounded = std::round(at);
  if (!(std::abs(at - rounded) <= nearest && rounded >= 0 && rounded <= last - first)) {
    fail("time {} s does not belong to any frame: the input has {} to {} s in steps of {} s", t_s,
         in_files / rate_hz, (in_files + last - first) / rate_hz, 1 / rate_hz);
  }
  return first + static_cast<int>(rounded);
}

int FrameNumbers::of_row(size_t row) const {
  if (row > static_cast<size_t>(last - first)) {
    fail("the input has only {} frames: poses without frame number or time stamp must be one per frame",
         last - first + 1);
  }
  return first + static_cast<int>(row);
}

ExternalResults read_external_results(const ExternalResultSet& set, const ResultFolder& folder,
                                      const SequenceTruth& truth) {
  ExternalResults out;
  Reader reader(set, folder, truth, out);
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

FrameTimes read_frame_times(const ExternalTimes& times, const ResultFolder& folder) {
  FrameTimes out;
  if (times.file.empty()) return out;
  const Files files(folder, out.notes);
  const std::vector<Match> found = files.matches(times.file);
  if (found.size() != 1) {
    out.problems.push_back(fmt::format(
        "{}: {}", files.path(times.file),
        found.empty() ? "the program did not write this file" : "several files match: expected one"));
    return out;
  }
  const double ms_per_unit = times.unit == TimeUnit::s ? 1000 : 1;
  constexpr double longest_ms = 1e9;  // 12 days
  try {
    const std::string path = found.front().path.string();
    NumberFile file(path, ' ', files.rules(pose_file));
    size_t row = 0;
    bool has_numbers = false;
    for (; file.next(); ++row) {
      const auto values = file.values();
      const bool numbered = values.size() == 2;
      if ((values.size() != 1 && !numbered) || values.back() < 0 || values.back() * ms_per_unit > longest_ms)
        file.fail_here("expected the time of a frame, or its number and time, in {}, 0 to {:g}",
                       to_string(times.unit), longest_ms / ms_per_unit);
      if (numbered && (values[0] != std::trunc(values[0]) || std::abs(values[0]) > 1e9))
        file.fail_here("expected a frame number, got {}", values[0]);
      has_numbers |= numbered;
      try {
        const int frame =
            numbered ? folder.numbers.of_number(static_cast<int>(values[0])) : folder.numbers.of_row(row);
        out.ms.emplace(frame, ms_per_unit * values.back());
      } catch (const Error& error) {
        file.fail_here("{}", error.what());
      }
    }
    if (!has_numbers && misses_rows(row, folder))
      out.problems.push_back(taken_as_first_frames("times", row, path, folder));
  } catch (const Error& error) {
    out.ms.clear();
    out.problems.emplace_back(error.what());
  }
  return out;
}

}  // namespace sextant
