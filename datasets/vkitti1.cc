#include "sextant/datasets/vkitti1.h"

#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <unordered_map>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/vkitti1_truth.h"
#include "sextant/datasets/vkitti_names.h"
#include "sextant/datasets/vkitti_sequence.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

uint32_t key_of(Rgb c) { return uint32_t{c.r} << 16 | uint32_t{c.g} << 8 | c.b; }

/// Masks from the colours of scenegt.
class SceneColors final : public MaskSource {
 public:
  SceneColors(const fs::path& folder, fs::path table, const ChannelInputs& inputs)
      : files_(folder, ".png"), folder_(folder), table_(std::move(table)), inputs_(inputs) {
    const std::string name = table_.string();
    for (const Vkitti1Color& row : decode_vkitti1_colors(inputs_.inputs->read(table_), name)) {
      const int id = row.tid ? *row.tid + 1 : 0;
      if (id > std::numeric_limits<uint16_t>::max()) fail("{}: track id {} is too large", name, *row.tid);
      ids_[key_of(row.color)] = static_cast<uint16_t>(id);
    }
  }

  Image<uint16_t> read(int frame) const override {
    const fs::path& path = files_.at(frame, "masks");
    const Image<Rgb> image = decode_png_rgb(inputs_.inputs->read(path), path.string());
    if (image.width() != inputs_.width || image.height() != inputs_.height) {
      fail("{}: {}x{} pixels, but the others have {}x{}: all files of a sequence need the same size",
           path.string(), image.width(), image.height(), inputs_.width, inputs_.height);
    }
    Image<uint16_t> mask(image.width(), image.height());
    uint32_t last = ~0u;  // no colour: neighbours mostly are of the same
    uint16_t id = 0;
    for (size_t i = 0; i < image.size(); ++i) {
      const uint32_t key = key_of(image.data()[i]);
      if (key != last) {
        const auto found = ids_.find(key);
        if (found == ids_.end()) fail_at(path, image, i);
        id = found->second;
        last = key;
      }
      mask.data()[i] = id;
    }
    return mask;
  }
  void check_file(int frame) const override { files_.at(frame, "masks"); }
  std::string provenance() const override { return "masks: scene colours:" + folder_.string(); }

 private:
  [[noreturn]] void fail_at(const fs::path& path, const Image<Rgb>& image, size_t i) const {
    const auto width = static_cast<size_t>(image.width());
    const Rgb c = image.data()[i];
    fail("{}: pixel ({}, {}) has the colour {} {} {}, which {} does not list", path.string(), i % width,
         i / width, c.r, c.g, c.b, table_.string());
  }

  FrameFiles files_;
  fs::path folder_;
  fs::path table_;
  ChannelInputs inputs_;
  std::unordered_map<uint32_t, uint16_t> ids_;
};

VkittiName parse_sequence(const SourceSpec& source) {
  if (!source.sequence.empty()) return parse_vkitti1_name(source.sequence);
  const std::set<std::string> worlds =
      fs::is_directory(source.path) ? vkitti1_worlds(source.path) : std::set<std::string>{};
  if (worlds.empty()) require_vkitti1_sequence(source.path, "", "");  // says what is wrong with the folder
  fail("source '{}': say which world: {}:{}#<world>/<variation>; there: {}", source.text, source.adapter,
       source.path, fmt::join(worlds, ", "));
}

class Vkitti1 final : public VkittiSequence {
 public:
  Vkitti1(const SourceSpec& source, const Vkitti1Options& options) : root_(source.path) {
    const VkittiName name = parse_sequence(source);
    require_vkitti1_sequence(root_, name.group, name.variation);
    info_.dataset = "vkitti1";
    info_.sequence = name.text();
    info_.rate_hz = options.rate_hz;
    info_.camera = {{kVkitti1Focal_px, kVkitti1Focal_px, 620.5, 187.0}, options.bf};

    Vkitti1Truth text =
        read_vkitti1_truth(find_vkitti1_text(root_, name.group, name.variation), name.group, inputs());
    truth_ = std::move(text.truth);
    info_.warnings = std::move(text.warnings);

    VkittiFolders folders;
    folders.left = folder("rgb", name);
    folders.depth = folder("depthgt", name);
    folders.flow = folder("flowgt", name);
    folders.masks = folder("scenegt", name);
    choose_frames(source, folders, fmt::format("{} {}", source.path, info_.sequence));
    check_size();
    open_channels(folders, {options.flow, options.depth, options.masks}, [&](const ChannelInputs& inputs) {
      return std::make_unique<SceneColors>(*folders.masks, color_table(name), inputs);
    });
  }

 private:
  std::optional<fs::path> folder(const char* kind, const VkittiName& name) const {
    const auto folder = vkitti1_folder(root_, kind);
    return folder ? existing_folder(*folder / name.group / name.variation) : std::nullopt;
  }

  fs::path color_table(const VkittiName& name) const {
    return *vkitti1_folder(root_, "scenegt") /
           fmt::format("{}_{}_scenegt_rgb_encoding.txt", name.group, name.variation);
  }

  void check_size() const {
    if (info_.width == kWidth && info_.height == kHeight) return;
    fail(
        "{} {}: images of {}x{} pixels: the data set's camera (f = 725, c = (620.5, 187)) belongs to {}x{}; "
        "take images of that size",
        root_.string(), info_.sequence, info_.width, info_.height, kWidth, kHeight);
  }

  fs::path root_;
};

}  // namespace

void Vkitti1Options::check() const {
  check_vkitti_options(rate_hz, {flow, depth, masks});
  check_option(std::isfinite(bf) && bf > 0, "bf", bf, "> 0");
}

std::unique_ptr<Sequence> open_vkitti1(const SourceSpec& source) {
  Vkitti1Options options;
  read_options(source.options, options, source.adapter);
  return std::make_unique<Vkitti1>(source, options);
}

}  // namespace sextant
