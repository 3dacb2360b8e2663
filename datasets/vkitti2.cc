#include "sextant/datasets/vkitti2.h"

#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "sextant/datasets/vkitti1.h"
#include "sextant/datasets/vkitti2_truth.h"
#include "sextant/datasets/vkitti_names.h"
#include "sextant/datasets/vkitti_sequence.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

// Those of the release, where a text file does not say.
const PinholeCamera kCamera{725.0087, 725.0087, 620.5, 187.0};
constexpr double kBaselineDigits_m = 2e-3;  // of the release's extrinsics

constexpr const char* kArchives[] = {"textgt",      "rgb",          "depth",
                                     "forwardFlow", "backwardFlow", "instanceSegmentation"};

std::vector<fs::path> roots(const fs::path& root) {
  std::vector<fs::path> all = {root};
  for (const char* archive : kArchives) all.push_back(root / fmt::format("vkitti_2.0.3_{}", archive));
  return all;
}

std::set<std::string> subfolders(const std::vector<fs::path>& folders, const std::string& prefix) {
  std::set<std::string> names;
  for (const fs::path& folder : folders) {
    if (!fs::is_directory(folder)) continue;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_directory() && name.starts_with(prefix)) names.insert(name);
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

  std::optional<fs::path> frames(const char* kind, int camera) const {
    for (const fs::path& root : roots(root_)) {
      const fs::path base = root / name_.group / name_.variation / "frames" / kind;
      if (auto found = existing_folder(base / fmt::format("Camera_{}", camera))) return found;
    }
    return std::nullopt;
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

class Vkitti2 final : public VkittiSequence {
 public:
  Vkitti2(const SourceSpec& source, const Vkitti2Options& options) {
    const Place place(source);
    info_.dataset = "vkitti2";
    info_.sequence = place.sequence();
    info_.rate_hz = options.rate_hz;
    Vkitti2Truth text = read_vkitti2_truth(place.text(), options.camera, inputs());
    truth_ = std::move(text.truth);
    info_.warnings = std::move(text.warnings);
    choose_camera(text);

    VkittiFolders folders;
    folders.left = place.frames("rgb", options.camera);
    if (options.camera == 0) folders.right = place.frames("rgb", 1);
    folders.depth = place.frames("depth", options.camera);
    folders.flow = place.frames("forwardFlow", options.camera);
    folders.backward_flow = place.frames("backwardFlow", options.camera);
    folders.masks = place.frames("instanceSegmentation", options.camera);
    choose_frames(source, folders, fmt::format("{} {}", source.path, info_.sequence));
    open_channels(folders, {options.flow, options.depth, options.masks}, [&](const ChannelInputs& inputs) {
      return make_mask_source("instance_png:" + folders.masks->string(), inputs);
    });
  }

 private:
  void choose_camera(const Vkitti2Truth& text) {
    info_.camera.left = text.camera.value_or(kCamera);
    double baseline_m = kVkittiBaseline_m;
    if (text.baseline_m && std::abs(*text.baseline_m - kVkittiBaseline_m) > kBaselineDigits_m) {
      baseline_m = *text.baseline_m;
      info_.warnings.push_back(
          fmt::format("baseline of {:.6f} m, as in extrinsic.txt: the data set has {:.6f} m", baseline_m,
                      kVkittiBaseline_m));
    }
    info_.camera.bf = info_.camera.left.fx * baseline_m;
    info_.camera.check();
  }
};

}  // namespace

void Vkitti2Options::check() const {
  check_vkitti_options(rate_hz, {flow, depth, masks});
  check_option(camera == 0 || camera == 1, "camera", camera, "0 or 1");
}

std::unique_ptr<Sequence> open_vkitti2(const SourceSpec& source) {
  Vkitti2Options options;
  read_options(source.options, options, source.adapter);
  return std::make_unique<Vkitti2>(source, options);
}

}  // namespace sextant
