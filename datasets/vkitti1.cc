#include "sextant/datasets/vkitti1.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <unordered_map>

#include "sextant/base/text.h"
#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/vkitti_layout.h"

namespace sextant {
namespace {

constexpr const char* prefix = "vkitti_1.3.1_";
constexpr const char* flat_variation = "clone";

// Worlds in which `moving` = 0 is reliable. In worlds 0006 and 0018 such rows include rolling cars
// (docs/datasets.md), so outside of the worlds listed here the poses decide.
const std::set<std::string> reliable_parked = {"0001", "0002"};

bool is_world(std::string_view name) { return name.size() == 4 && is_digits(name); }

std::vector<fs::path> flat_folders(const fs::path& root) { return {root, root / "vkitti_1.3.1_text"}; }

void for_each_entry(const fs::path& folder, const std::function<void(const fs::directory_entry&)>& visit) {
  if (!fs::is_directory(folder)) return;
  for (const auto& entry : fs::directory_iterator(folder)) visit(entry);
}

// Calls visit(world, variation) for every sequence that exists, often more than once.
void for_each_sequence(const fs::path& root,
                       const std::function<void(const std::string&, const std::string&)>& visit) {
  for (const char* kind : {"extrinsicsgt", "motgt"}) {
    for_each_entry(vkitti1_folder(root, kind).value_or(""), [&](const fs::directory_entry& entry) {
      const std::string stem = entry.path().stem().string();
      if (entry.path().extension() != ".txt" || stem.size() < 6 || stem[4] != '_') return;
      if (is_world(stem.substr(0, 4))) visit(stem.substr(0, 4), stem.substr(5));
    });
  }
  for (const char* kind : {"rgb", "depthgt", "flowgt", "scenegt"}) {
    for_each_entry(vkitti1_folder(root, kind).value_or(""), [&](const fs::directory_entry& world) {
      if (!world.is_directory() || !is_world(world.path().filename().string())) return;
      for_each_entry(world.path(), [&](const fs::directory_entry& variation) {
        if (!variation.is_directory()) return;
        visit(world.path().filename().string(), variation.path().filename().string());
      });
    });
  }
  for (const fs::path& folder : flat_folders(root)) {
    for_each_entry(folder, [&](const fs::directory_entry& entry) {
      const std::string name = entry.path().filename().string();
      const bool text = name.ends_with("_camera.txt") || name.ends_with("_objects.txt");
      if (text && is_world(name.substr(0, name.find('_')))) visit(name.substr(0, 4), flat_variation);
    });
  }
}

ObjectTruth to_truth(const Vkitti1Object& row, bool parked_is_reliable) {
  ObjectTruth object;
  object.id = row.tid + 1;
  object.T_camera_object = SE3(vkitti_rotation(row.angles), row.position_m);
  object.box = row.box;
  object.size_m = row.size_m;
  object.type = row.orig_label;
  if (row.moving || parked_is_reliable) object.moving = row.moving;
  return object;
}

void read_objects(const Vkitti1TextFiles& files, const std::string& world, InputLog& inputs,
                  Vkitti1Truth& out) {
  const std::string name = files.objects.string();
  const bool reliable = reliable_parked.contains(world);
  for (const Vkitti1Object& row : decode_vkitti1_objects(inputs.read(files.objects), name)) {
    if (!files.extrinsics.empty() && !out.truth.camera.has(row.frame)) {
      fail("{}: it has objects in frame {}, of which {} has no pose: take both files from the same sequence",
           name, row.frame, files.extrinsics.string());
    }
    out.truth.objects[row.frame].push_back(to_truth(row, reliable));
  }
  for (auto& [frame, list] : out.truth.objects) std::ranges::sort(list, {}, &ObjectTruth::id);
  for (auto& [frame, list] : out.truth.objects) {
    for (ObjectTruth& object : list) {
      if (!object.moving) object.moving = moves(out.truth, object.id, frame);
    }
  }
}

}  // namespace

std::optional<fs::path> vkitti1_folder(const fs::path& root, const std::string& kind) {
  const fs::path folder = root / (prefix + kind);
  if (fs::is_directory(folder / (prefix + kind))) return folder / (prefix + kind);
  if (fs::is_directory(folder)) return folder;
  return std::nullopt;
}

std::set<std::string> vkitti1_worlds(const fs::path& root) {
  std::set<std::string> worlds;
  for_each_sequence(root, [&](const std::string& world, const std::string&) { worlds.insert(world); });
  return worlds;
}

std::set<std::string> vkitti1_variations(const fs::path& root, const std::string& world) {
  std::set<std::string> variations;
  for_each_sequence(root, [&](const std::string& other, const std::string& variation) {
    // The name of a colour table of scenegt would look like a variation if it lay in extrinsicsgt or motgt.
    if (other == world && !variation.ends_with("_encoding")) variations.insert(variation);
  });
  return variations;
}

Vkitti1TextFiles find_vkitti1_text(const fs::path& root, const std::string& world,
                                   const std::string& variation) {
  Vkitti1TextFiles files;
  const auto official = [&](const char* kind, fs::path& path) {
    const auto folder = vkitti1_folder(root, kind);
    if (folder && fs::is_regular_file(*folder / (world + "_" + variation + ".txt"))) {
      path = *folder / (world + "_" + variation + ".txt");
    }
  };
  official("extrinsicsgt", files.extrinsics);
  official("motgt", files.objects);
  if (variation != flat_variation) return files;
  const auto flat = [&](const char* what, fs::path& path) {
    for (const fs::path& folder : flat_folders(root)) {
      if (path.empty() && fs::is_regular_file(folder / (world + what))) path = folder / (world + what);
    }
  };
  flat("_camera.txt", files.extrinsics);
  flat("_objects.txt", files.objects);
  return files;
}

void require_vkitti1_sequence(const fs::path& root, const std::string& world, const std::string& variation) {
  if (!fs::is_directory(root)) fail("{}: no such folder", root.string());
  const std::set<std::string> worlds = vkitti1_worlds(root);
  if (worlds.empty()) {
    fail(
        "{}: no Virtual KITTI 1.3.1 in it: expected folders "
        "such as vkitti_1.3.1_rgb and vkitti_1.3.1_extrinsicsgt",
        root.string());
  }
  if (!worlds.contains(world)) {
    fail("{}: no world '{}' in it; available: {}", root.string(), world, fmt::join(worlds, ", "));
  }
  const std::set<std::string> variations = vkitti1_variations(root, world);
  if (!variations.contains(variation)) {
    fail("{}: world {} has no variation '{}' in it; available: {}", root.string(), world, variation,
         fmt::join(variations, ", "));
  }
}

Vkitti1Truth read_vkitti1_truth(const Vkitti1TextFiles& files, const std::string& world, InputLog& inputs) {
  Vkitti1Truth out;
  if (files.extrinsics.empty()) {
    out.warnings.push_back(
        fmt::format("world {} has no extrinsicsgt file, so there is no true camera motion", world));
  } else {
    const std::string name = files.extrinsics.string();
    for (const auto& [frame, T_camera_world] :
         decode_vkitti1_extrinsics(inputs.read(files.extrinsics), name)) {
      out.truth.camera.set(frame, T_camera_world.inverse());
    }
  }
  if (files.objects.empty()) {
    out.warnings.push_back(
        fmt::format("world {} has no motgt file, so there is no true object motion", world));
  } else {
    read_objects(files, world, inputs, out);
  }
  return out;
}

Vkitti1Truth read_vkitti1_truth(const fs::path& root, const std::string& world, const std::string& variation,
                                InputLog& inputs) {
  require_vkitti1_sequence(root, world, variation);
  const Vkitti1TextFiles files = find_vkitti1_text(root, world, variation);
  for (const auto& [path, kind] :
       {std::pair{&files.extrinsics, "extrinsicsgt"}, std::pair{&files.objects, "motgt"}}) {
    if (!path->empty()) continue;
    fail("{}: world {} lacks its file vkitti_1.3.1_{}/{}_{}.txt", root.string(), world, kind, world,
         variation);
  }
  return read_vkitti1_truth(files, world, inputs);
}

namespace {

uint32_t key_of(Rgb c) { return uint32_t{c.r} << 16 | uint32_t{c.g} << 8 | c.b; }

/// Instance ids by the colours of scenegt.
class SceneColors {
 public:
  SceneColors(fs::path table, InputLog& inputs) : table_(std::move(table)) {
    const std::string name = table_.string();
    for (const Vkitti1Color& row : decode_vkitti1_colors(inputs.read(table_), name)) {
      constexpr int largest = std::numeric_limits<uint16_t>::max() - 1;
      if (row.tid && *row.tid > largest)
        fail("{}: track id {} is too large, expected at most {}", name, *row.tid, largest);
      const int id = row.tid ? *row.tid + 1 : 0;
      ids_[key_of(row.color)] = static_cast<uint16_t>(id);
    }
  }

  Image<uint16_t> mask(const Image<Rgb>& image, const std::string& path) const {
    Image<uint16_t> mask(image.width(), image.height());
    uint32_t last = ~0u;  // not a colour; neighbouring pixels mostly have the same colour
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
  if (worlds.empty()) require_vkitti1_sequence(source.path, "", "");  // reports what is wrong with the folder
  fail("source '{}': choose a world: {}:{}#<world>/<variation>; available: {}", source.text, source.adapter,
       source.path, fmt::join(worlds, ", "));
}

}  // namespace

void Vkitti1Options::check() const {
  RatedChannelOptions::check();
  check_option(std::isfinite(bf) && bf > 0, "bf", bf, "finite and > 0");
}

std::unique_ptr<Sequence> open_vkitti1(const SourceSpec& source) {
  const auto options = options_of<Vkitti1Options>(source);
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
