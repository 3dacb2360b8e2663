#include "sextant/datasets/vkitti1_truth.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

#include "sextant/datasets/codec/vkitti_box.h"
#include "sextant/datasets/vkitti_rows.h"

namespace sextant {
namespace {

constexpr const char* prefix = "vkitti_1.3.1_";
constexpr const char* flat_variation = "clone";

// Where `moving` = 0 is taken: in worlds 0006 and 0018 such rows include cars that roll (docs/datasets.md), so
// that there the poses decide.
const std::set<std::string> reliable_parked = {"0001", "0002"};

bool is_world(std::string_view name) {
  return name.size() == 4 && std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; });
}

std::vector<fs::path> flat_folders(const fs::path& root) { return {root, root / "vkitti_1.3.1_text"}; }

void for_each_entry(const fs::path& folder, const std::function<void(const fs::directory_entry&)>& visit) {
  if (!fs::is_directory(folder)) return;
  for (const auto& entry : fs::directory_iterator(folder)) visit(entry);
}

// Calls visit(world, variation) for everything that is there, often more than once.
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
    // The colour table of scenegt lies beside extrinsics in no release, yet its name would fit.
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
    fail("{}: no world '{}' in it; there: {}", root.string(), world, fmt::join(worlds, ", "));
  }
  const std::set<std::string> variations = vkitti1_variations(root, world);
  if (!variations.contains(variation)) {
    fail("{}: world {} has no variation '{}' in it; there: {}", root.string(), world, variation,
         fmt::join(variations, ", "));
  }
}

Vkitti1Truth read_vkitti1_truth(const Vkitti1TextFiles& files, const std::string& world, InputLog& inputs) {
  Vkitti1Truth out;
  if (files.extrinsics.empty()) {
    out.warnings.push_back(fmt::format("no extrinsicsgt of world {}: no true camera motion", world));
  } else {
    const std::string name = files.extrinsics.string();
    for (const auto& [frame, T_camera_world] :
         decode_vkitti1_extrinsics(inputs.read(files.extrinsics), name)) {
      out.truth.camera.set(frame, T_camera_world.inverse());
    }
  }
  if (files.objects.empty()) {
    out.warnings.push_back(fmt::format("no motgt of world {}: no true object motion", world));
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

}  // namespace sextant
