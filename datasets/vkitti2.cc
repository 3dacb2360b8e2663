#include "sextant/datasets/vkitti2.h"

#include <fmt/ranges.h>

#include <cmath>
#include <set>

#include "sextant/datasets/vkitti1.h"
#include "sextant/datasets/vkitti2_truth.h"
#include "sextant/datasets/vkitti_files.h"

namespace sextant {
namespace {

// Those of the release, where a text file does not say.
const PinholeCamera release_camera{725.0087, 725.0087, 620.5, 187.0};
constexpr double baseline_digits_m = 2e-3;  // of the release's extrinsics

constexpr const char* archives[] = {"textgt",      "rgb",          "depth",
                                    "forwardFlow", "backwardFlow", "instanceSegmentation"};

std::vector<fs::path> roots(const fs::path& root) {
  std::vector<fs::path> all = {root};
  for (const char* archive : archives) all.push_back(root / fmt::format("vkitti_2.0.3_{}", archive));
  return all;
}

std::set<std::string> subfolders(const std::vector<fs::path>& folders, const std::string& start) {
  std::set<std::string> names;
  for (const fs::path& folder : folders) {
    if (!fs::is_directory(folder)) continue;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_directory() && name.starts_with(start)) names.insert(name);
    }
  }
  return names;
}

// Where the scene is below the root.
class Place {
 public:
  explicit Place(const SourceSpec& source) : root_(source.path), name_(parse_vkitti2_name(source.sequence)) {
    if (!fs::is_directory(root_)) fail("{}: no such folder", root_.string());
    const std::set<std::string> scenes = subfolders(roots(root_), "Scene");
    if (scenes.empty()) {
      fail("{}: no Virtual KITTI 2 in it: expected folders such as Scene01/clone", root_.string());
    }
    if (source.sequence.empty()) {
      fail("source '{}': say which scene: {}:{}#<scene>/<variation>; there: {}", source.text, source.adapter,
           source.path, fmt::join(scenes, ", "));
    }
    if (!scenes.contains(name_.group)) {
      fail("{}: no scene '{}' in it; there: {}", root_.string(), name_.group, fmt::join(scenes, ", "));
    }
    std::vector<fs::path> places;
    for (const fs::path& place : roots(root_)) places.push_back(place / name_.group);
    const std::set<std::string> variations = subfolders(places, "");
    if (name_.variation.empty() || !variations.contains(name_.variation)) {
      fail("{}: {} has no variation '{}' in it; there: {}", root_.string(), name_.group, name_.variation,
           fmt::join(variations, ", "));
    }
  }

  std::string sequence() const { return name_.text(); }

  /// Empty when it is not there.
  std::string frames(const char* kind, int camera) const {
    for (const fs::path& root : roots(root_)) {
      const fs::path base = root / name_.group / name_.variation / "frames" / kind;
      const std::string found = if_there(base / fmt::format("Camera_{}", camera));
      if (!found.empty()) return found;
    }
    return "";
  }

  // The folder with text files, or where they would be.
  fs::path text() const {
    for (const fs::path& root : roots(root_)) {
      const fs::path folder = root / name_.group / name_.variation;
      for (const char* file : {"extrinsic.txt", "pose.txt", "intrinsic.txt", "bbox.txt", "info.txt"}) {
        if (fs::is_regular_file(folder / file)) return folder;
      }
    }
    return root_ / name_.group / name_.variation;
  }

 private:
  fs::path root_;
  VkittiName name_;
};

void choose_camera(const Vkitti2Truth& text, SequenceInfo& info) {
  info.camera.left = text.camera.value_or(release_camera);
  double baseline_m = vkitti_baseline_m;
  if (text.baseline_m && std::abs(*text.baseline_m - vkitti_baseline_m) > baseline_digits_m) {
    baseline_m = *text.baseline_m;
    info.warnings.push_back(
        fmt::format("baseline of {:.6f} m, as in extrinsic.txt: the data set has {:.6f} m", baseline_m,
                    vkitti_baseline_m));
  }
  info.camera.bf = info.camera.left.fx * baseline_m;
  info.camera.check();
}

}  // namespace

void Vkitti2Options::check() const {
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "> 0");
  check_option(camera == 0 || camera == 1, "camera", camera, "0 or 1");
}

std::unique_ptr<Sequence> open_vkitti2(const SourceSpec& source) {
  Vkitti2Options options;
  read_options(source.options, options, source.adapter);
  const Place place(source);
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  info.sequence = place.sequence();
  info.rate_hz = options.rate_hz;
  Vkitti2Truth text = read_vkitti2_truth(place.text(), options.camera, sequence->inputs());
  sequence->truth() = std::move(text.truth);
  info.warnings = std::move(text.warnings);
  choose_camera(text, info);

  FolderFiles files = vkitti_files(sequence->truth());
  files.left = place.frames("rgb", options.camera);
  if (options.camera == 0) files.right = place.frames("rgb", 1);
  files.depth = {.option = options.depth,
                 .kind = "cm",
                 .files = place.frames("depth", options.camera),
                 .computed = "sgbm",
                 .exact = true};
  files.flow = {.option = options.flow,
                .kind = "vkitti_png",
                .files = place.frames("forwardFlow", options.camera),
                .computed = "dis",
                .exact = true};
  files.backward_flow = {.kind = "vkitti_png", .files = place.frames("backwardFlow", options.camera)};
  files.masks = {.option = options.masks,
                 .kind = "instance_png",
                 .files = place.frames("instanceSegmentation", options.camera)};
  sequence->choose_frames(files, fmt::format("{} {}", source.path, info.sequence));
  check_vkitti_frames(*sequence, source.path);
  sequence->open_channels(files);
  return sequence;
}

}  // namespace sextant
