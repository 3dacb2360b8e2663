#include "sextant/datasets/vkitti1.h"

#include <fmt/ranges.h>

#include <cmath>
#include <limits>
#include <unordered_map>

#include "sextant/datasets/channels/file_channels.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/vkitti1_truth.h"
#include "sextant/datasets/vkitti_files.h"

namespace sextant {
namespace {

uint32_t key_of(Rgb c) { return uint32_t{c.r} << 16 | uint32_t{c.g} << 8 | c.b; }

/// Ids by the colours of scenegt.
class SceneColors {
 public:
  SceneColors(fs::path table, InputLog& inputs) : table_(std::move(table)) {
    const std::string name = table_.string();
    for (const Vkitti1Color& row : decode_vkitti1_colors(inputs.read(table_), name)) {
      const int id = row.tid ? *row.tid + 1 : 0;
      if (id > std::numeric_limits<uint16_t>::max()) fail("{}: track id {} is too large", name, *row.tid);
      ids_[key_of(row.color)] = static_cast<uint16_t>(id);
    }
  }

  Image<uint16_t> mask(const Image<Rgb>& image, const std::string& path) const {
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

 private:
  [[noreturn]] void fail_at(const std::string& path, const Image<Rgb>& image, size_t i) const {
    const auto width = static_cast<size_t>(image.width());
    const Rgb c = image.data()[i];
    fail("{}: pixel ({}, {}) has the colour {} {} {}, which {} does not list", path, i % width, i / width,
         c.r, c.g, c.b, table_.string());
  }

  fs::path table_;
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

}  // namespace

void Vkitti1Options::check() const {
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "> 0");
  check_option(std::isfinite(bf) && bf > 0, "bf", bf, "> 0");
}

std::unique_ptr<Sequence> open_vkitti1(const SourceSpec& source) {
  Vkitti1Options options;
  read_options(source.options, options, source.adapter);
  const VkittiName name = parse_sequence(source);
  require_vkitti1_sequence(source.path, name.group, name.variation);
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  info.sequence = name.text();
  info.rate_hz = options.rate_hz;
  info.camera = {{vkitti1_focal_px, vkitti1_focal_px, 620.5, 187.0}, options.bf};
  Vkitti1Truth text = read_vkitti1_truth(find_vkitti1_text(source.path, name.group, name.variation),
                                         name.group, sequence->inputs());
  sequence->truth() = std::move(text.truth);
  info.warnings = std::move(text.warnings);

  const auto folder = [&](const char* kind) -> std::string {
    const auto archive = vkitti1_folder(source.path, kind);
    return archive ? if_there(*archive / name.group / name.variation) : "";
  };
  FolderFiles files = vkitti_files(sequence->truth());
  files.left = folder("rgb");
  files.depth = {.option = options.depth, .kind = "cm", .files = folder("depthgt"), .exact = true};
  files.flow = {.option = options.flow,
                .kind = "vkitti_png",
                .files = folder("flowgt"),
                .computed = "dis",
                .exact = true};
  files.masks = {.option = options.masks, .files = folder("scenegt")};
  files.masks.provenance = "masks: scene colours:" + files.masks.files;
  files.masks.open = [&](const ChannelInputs& inputs) {
    const fs::path table = *vkitti1_folder(source.path, "scenegt") /
                           fmt::format("{}_{}_scenegt_rgb_encoding.txt", name.group, name.variation);
    return std::make_unique<FolderSource<uint16_t>>(
        "masks", "scene_colours", ".png", files.masks.files, inputs,
        [colors = SceneColors(table, *inputs.inputs)](const auto& bytes, const auto& path) {
          return colors.mask(decode_png_rgb(bytes, path), path);
        });
  };
  sequence->choose_frames(files, fmt::format("{} {}", source.path, info.sequence));
  check_vkitti_frames(*sequence, source.path);
  if (info.width != vkitti_width || info.height != vkitti_height) {
    fail(
        "{} {}: images of {}x{} pixels: the data set's camera (f = 725, "
        "c = (620.5, 187)) belongs to {}x{}; take images of that size",
        source.path, info.sequence, info.width, info.height, vkitti_width, vkitti_height);
  }
  sequence->open_channels(files);
  return sequence;
}

}  // namespace sextant
