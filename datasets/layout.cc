#include "sextant/datasets/layout.h"

#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/machine.h"
#include "sextant/base/names.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/datasets/kitti_tracking.h"
#include "sextant/datasets/vdo_folder.h"
#include "sextant/datasets/vkitti_layout.h"

namespace sextant {
namespace {

using Write = std::function<std::string(const Sequence&, const LayoutRequest&)>;

constexpr const char* stage_prefix = ".sextant_incomplete_";
/// Marks a stage with complete files; contains the request and the SOURCE that reads the result.
constexpr const char* complete_file = ".complete";

/// Lock of a stage, which the system releases when the process ends. It concerns the stage alone, because
/// several writers may write into one root (the lock of base/file_lock.h would refuse the second).
class StageLock {
 public:
  explicit StageLock(const fs::path& folder)
      : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    held_ = folder_ && ::flock(folder_.get(), LOCK_EX | LOCK_NB) == 0;
    refused_ = !folder_ || (!held_ && errno == EWOULDBLOCK);
  }
  bool held() const { return held_; }
  /// Returns true if the stage is gone or locked by another process. If neither held() nor refused() is true,
  /// the file system has no locks.
  bool refused() const { return refused_; }

 private:
  Descriptor folder_;
  bool held_ = false, refused_ = false;
};

/// Moves all files of a stage to `out`, text files last: as long as they are missing, no reader takes the
/// images for a sequence with truth.
void move_into_place(const fs::path& stage, const fs::path& out) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(stage)) {
    if (entry.is_regular_file() && entry.path() != stage / complete_file) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::stable_partition(files.begin(), files.end(),
                        [](const fs::path& file) { return file.extension() != ".txt"; });
  for (const fs::path& file : files) {
    move_below(file, out, file.lexically_relative(stage));
  }
}

/// Cleans up after killed writers: complete stages are moved into place, others removed. Returns the SOURCE
/// of a completed stage that was written for the request `what`.
std::optional<std::string> take_abandoned(const fs::path& out, const Json& what) {
  std::vector<fs::path> stages;
  for (const auto& entry : fs::directory_iterator(out)) {
    if (entry.is_directory() && !entry.is_symlink() &&
        entry.path().filename().string().starts_with(stage_prefix))
      stages.push_back(entry.path());
  }
  std::error_code ignored;
  std::optional<std::string> source;
  for (const fs::path& stage : stages) {
    const StageLock lock(stage);
    if (!lock.held()) continue;
    if (fs::exists(stage / complete_file)) {
      const Json written = read_json(stage / complete_file);
      move_into_place(stage, out);
      if (written.value("what", Json()) == what)
        source = json_member<std::string>(written, "source", (stage / complete_file).string());
    }
    fs::remove_all(stage, ignored);
  }
  return source;
}

/// A hidden folder in `out` for the files being written. The destructor removes it, and those parent folders
/// made for it that are empty, unless publish() was interrupted.
class Stage {
 public:
  /// `what` identifies the request.
  Stage(const fs::path& out, Json what) : out_(fs::absolute(out).lexically_normal()), what_(std::move(what)) {
    for (fs::path folder = out_; !fs::exists(folder); folder = folder.parent_path()) made_.push_back(folder);
    fs::create_directories(out_);
    finished_ = take_abandoned(out_, what_);
    do {  // until it is locked before another writer considers it abandoned
      std::string name = (out_ / stage_prefix).string() + "XXXXXX";
      if (::mkdtemp(name.data()) == nullptr)
        fail("{}: cannot write: {}", out_.string(), std::strerror(errno));
      folder_ = name;
      lock_.emplace(folder_);
    } while (lock_->refused() || !fs::exists(folder_));
  }
  ~Stage() {
    std::error_code ignored;
    if (!is_complete_) fs::remove_all(folder_, ignored);
    for (const fs::path& folder : made_) fs::remove(folder, ignored);  // only the empty ones
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
  const fs::path& folder() const { return folder_; }

  /// Returns the SOURCE that a killed writer had completed for the same request; nullopt if there is none.
  const std::optional<std::string>& finished() const { return finished_; }

  /// Moves the files into place. If this is interrupted, the next writer in the folder completes it.
  void publish(const std::string& source) {
    write_file(folder_ / complete_file, json_text({{"what", what_}, {"source", source}}));
    is_complete_ = true;
    move_into_place(folder_, out_);
    is_complete_ = false;
  }

 private:
  fs::path out_;
  Json what_;
  fs::path folder_;
  std::optional<std::string> finished_;
  bool is_complete_ = false;  ///< complete, but not yet all moved into place
  std::optional<StageLock> lock_;
  std::vector<fs::path> made_;  // innermost first
};

struct NoOptions {
  void visit(auto&) {}
};

template <typename Options = NoOptions>
Layout layout(const std::string& name, const std::string& description, const Write& write) {
  const auto staged = [name, write](const Sequence& sequence, const LayoutRequest& request) {
    if (request.out.empty()) fail("--out: expected a folder, got ''");
    Options options;
    read_options(request.options, options, "layout");
    const SequenceInfo& info = sequence.info();
    Stage stage(request.out, {{"layout", name},
                              {"sequence", request.sequence},
                              {"options", request.options},
                              {"of", {info.dataset, info.sequence, info.first_frame, info.last_frame}},
                              {"provenance", info.provenance}});
    if (stage.finished()) return *stage.finished();
    LayoutRequest inside = request;
    inside.stage = stage.folder();
    std::string source = write(sequence, inside);
    stage.publish(source);
    return source;
  };
  return {name, description, staged, [] { return describe_options(Options{}); }};
}

}  // namespace

void write_layout_frames(const Sequence& sequence, const LayoutRequest& request, const LayoutFrames& frames) {
  const SequenceInfo& info = sequence.info();
  Channels wanted;
  for (const LayoutFolder& folder : frames.folders) {
    if (!(info.channels.*folder.channel)) continue;
    wanted.*folder.channel = true;
    fs::create_directories(folder.path);
  }
  const int n = info.last_frame - info.first_frame + 1;
  Progress progress("frames written", n, request.quiet);
  parallel_for(n, request.jobs, [&](int i) {
    if (request.between_frames) request.between_frames();
    const int number = info.first_frame + i;
    const Frame frame = frames.read ? frames.read(number, wanted) : sequence.read(number, wanted);
    for (const LayoutFolder& folder : frames.folders) {
      const std::string bytes = wanted.*folder.channel ? folder.encode(frame) : "";
      if (!bytes.empty())
        write_file(folder.path / fmt::format(fmt::runtime(folder.name), number - frames.zero), bytes);
    }
    if (frames.also) frames.also(frame);
    progress.advance();
  });
}

std::span<const Layout> layouts() {
  static const std::vector<Layout> table = {
      layout<KittiLayoutOptions>(
          "kitti", "KITTI tracking: image_02, image_03, calib, oxts, label_02, MOTS; and depth_02, flow_02",
          write_kitti_layout),
      layout("vdo",
             "VDO-SLAM folder: image_0, depth as disparity, flow, semantic, camera.yaml; any camera and rate",
             write_vdo_layout),
      layout("vkitti1", "Virtual KITTI 1.3.1: camera f = 725, 1242x375 only", write_vkitti1_layout),
      layout("vkitti2",
             "Virtual KITTI 2.0.3: any camera, right image, backward flow; images as JPEG, which is lossy",
             write_vkitti2_layout),
  };
  return table;
}

const Layout& find_layout(const std::string& name) { return find_entry(layouts(), name, "layout"); }

int default_number(const std::string& sequence) {
  const auto first = std::ranges::find_if(sequence, is_digit);
  int number = 0;
  for (auto it = first; it != sequence.end() && is_digit(*it) && number < 1'000'000; ++it) {
    number = 10 * number + (*it - '0');
  }
  return number;
}

}  // namespace sextant
