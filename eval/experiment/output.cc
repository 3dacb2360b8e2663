#include "sextant/eval/experiment/output.h"

#include <algorithm>
#include <system_error>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/experiment/interrupt.h"
#include "sextant/eval/experiment/run_json.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

std::string matrix_line(const SE3& T) {
  const Eigen::Matrix4d m = T.matrix();
  std::string line;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      if (!line.empty()) line += ' ';
      line += fmt::format("{}", m(row, column));
    }
  }
  return line;
}

std::string kitti_text(const Trajectory& trajectory) {
  std::string text;
  for (const auto& [frame, pose] : trajectory.poses()) text += matrix_line(pose) + '\n';
  return text;
}

std::string tum_text(const Trajectory& trajectory, const SequenceInfo& info) {
  std::string text;
  for (const auto& [frame, pose] : trajectory.poses()) {
    if (frame < info.first_frame || frame > info.last_frame) continue;
    const Eigen::Vector3d& t = pose.translation();
    const Eigen::Quaterniond& q = pose.rotation();
    text += fmt::format("{} {} {} {} {} {} {} {}\n", frame / info.rate_hz, t.x(), t.y(), t.z(), q.x(), q.y(),
                        q.z(), q.w());
  }
  return text;
}

/// The source's subfolder; none when it is alone.
std::string folder_of(const SourceRun& source, bool alone) {
  if (alone) return "";
  std::string name = fmt::format("{}_{}_{}-{}", source.info.dataset, source.info.sequence,
                                 source.info.first_frame, source.info.last_frame);
  std::replace(name.begin(), name.end(), '/', '-');
  return name + "/";
}

/// The first folder on the way to `folder` that does not exist; empty when all do.
fs::path first_missing(const fs::path& folder) {
  fs::path missing;
  for (fs::path p = fs::absolute(folder).lexically_normal(); !fs::exists(p); p = p.parent_path()) missing = p;
  return missing;
}

/// "configuration" of the folder's run.json; null when there is none to be read.
Json recorded_configuration(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / "run.json", ignored) ? read_run_json(folder).value("configuration", Json())
                                                  : Json();
}

}  // namespace

OutputFiles run_files(const RunResult& result) {
  OutputFiles files;
  files["records.jsonl"] = write_records(result.records);
  files["run.json"] = json_text(run_provenance(result));
  for (const SourceRun& source : result.sources) {
    const std::string folder = folder_of(source, result.sources.size() == 1);
    files[folder + "est_camera_kitti.txt"] = kitti_text(source.motions.estimated);
    files[folder + "est_camera_tum.txt"] = tum_text(source.motions.estimated, source.info);
    const std::string truth = tum_text(source.truth, source.info);
    if (!truth.empty()) files[folder + "gt_camera_tum.txt"] = truth;
    files[folder + "tracks.csv"] = write_tracks(source.tracks);
    for (const auto& [id, motions] : source.motions.objects) {
      std::string& text = files[fmt::format("{}obj_{}_motion.txt", folder, id)];
      for (const auto& [frame, H_world] : motions)
        text += fmt::format("{} {}\n", frame, matrix_line(H_world));
    }
  }
  return files;
}

void check_output_folder(const fs::path& folder, const Json& configuration, bool force) {
  std::error_code ignored;
  if (folder.empty()) fail("--out: expected a folder, got ''");
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored)) {
    fail("{}: is a file, expected a folder for the results", folder.string());
  }
  if (force || !fs::exists(folder / "records.jsonl", ignored)) return;
  if (recorded_configuration(folder) != configuration) {
    fail(
        "{}: holds the records of a run with other sources or options; choose another folder, or pass "
        "--force "
        "to replace them",
        folder.string());
  }
}

void write_output_folder(const fs::path& folder, const OutputFiles& files) {
  const fs::path staging = folder / ".incomplete";
  fs::path created;
  try {
    created = first_missing(folder);
    fs::remove_all(staging);  // of a run that was killed
    for (const auto& [name, bytes] : files) {
      check_interrupt();
      fs::create_directories((staging / name).parent_path());
      write_file(staging / name, bytes);
    }
    for (const auto& [name, bytes] : files) {
      fs::create_directories((folder / name).parent_path());
      fs::rename(staging / name, folder / name);
    }
    fs::remove_all(staging);
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(staging, ignored);
    if (!created.empty()) fs::remove_all(created, ignored);
    try {
      throw;
    } catch (const fs::filesystem_error& error) {
      fail("{}: cannot create: {}", error.path1().string(), error.code().message());
    }
  }
}

}  // namespace sextant
