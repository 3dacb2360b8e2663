#include <algorithm>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/vkitti1_truth.h"
#include "sextant/datasets/vkitti_files.h"
#include "sextant/datasets/vkitti_layout.h"
#include "sextant/datasets/vkitti_rows.h"

namespace sextant {
namespace {

// All that is no track: the source does not tell roads from trees.
constexpr const char* static_category = "Misc";
constexpr Rgb static_color{80, 80, 80};

Rgb unpack(uint32_t n) {
  return {static_cast<uint8_t>(n >> 16), static_cast<uint8_t>(n >> 8), static_cast<uint8_t>(n)};
}

// A colour of its own for every id: multiplication by an odd number is one to one modulo 2^24.
Rgb color_of(int id) {
  if (id == 0) return static_color;
  constexpr uint32_t factor = 0x9E3779;
  constexpr uint32_t low_24_bits = 0xFFFFFF;
  const Rgb color = unpack(static_cast<uint32_t>(id) * factor & low_24_bits);
  return color == static_color ? unpack((static_cast<uint32_t>(id) + 65536) * factor & low_24_bits) : color;
}

Image<Rgb> scene_colors(const Image<uint16_t>& mask) {
  Image<Rgb> image(mask.width(), mask.height());
  std::transform(mask.data(), mask.data() + mask.size(), image.data(),
                 [](uint16_t id) { return color_of(id); });
  return image;
}

std::string color_table(const Sequence& sequence, const std::map<int, MaskOutlines>& outlines) {
  std::map<int, std::string> types;  // by id
  for (const auto& [frame, shown] : outlines) {
    for (const auto& [id, outline] : shown) types.emplace(id, "Car");
  }
  for (const auto& [frame, objects] : sequence.truth().objects) {
    for (const ObjectTruth& object : objects) {
      if (!object.type.empty()) types[object.id] = object.type;
    }
  }
  std::vector<Vkitti1Color> colors = {{static_category, std::nullopt, static_color}};
  for (const auto& [id, type] : types) colors.push_back({type, id - 1, color_of(id)});
  return encode_vkitti1_colors(colors);
}

Vkitti1Object to_text(const VkittiRow& row) {
  Vkitti1Object o;
  o.frame = row.frame;
  o.tid = row.track;
  o.label = o.orig_label = row.type;
  o.truncated = row.truncation >= 0.78 ? 2 : row.truncation > 0 ? 1 : 0;
  o.occluded = row.occupancy >= 0.75 ? 0 : row.occupancy >= 0.4 ? 1 : 2;
  o.alpha = row.alpha_rad;
  o.box = row.box;
  o.size_m = *row.object->size_m;
  o.position_m = row.object->T_camera_object.translation();
  o.angles = row.angles;
  o.truncr = row.truncation;
  o.occupr = row.occupancy;
  o.moving = row.moving;
  o.model = o.color = "unknown";
  return o;
}

class Writer {
 public:
  Writer(const Sequence& sequence, const LayoutRequest& request)
      : sequence_(sequence), info_(sequence.info()), request_(request) {
    const std::string name =
        request.sequence.empty() ? fmt::format("{:04}", default_number(info_.sequence)) : request.sequence;
    name_ = parse_vkitti1_name(name);
    check_name(name);
    check_camera();
    check_vkitti_poses(sequence);
  }

  std::string write() {
    const auto frames = [&](auto channel, auto image, const char* kind, const auto& encode) {
      return layout_folder(channel, image, folder(kind) / name_.group / name_.variation, "{:05}.png",
                           [=](const auto& pixels) { return encode_png(encode(pixels)); });
    };
    const auto as_it_is = [](const Image<Rgb>& image) { return image; };
    const auto outlines =
        write_vkitti_frames(sequence_, request_,
                            {frames(&Channels::rgb, &Frame::rgb, "rgb", as_it_is),
                             frames(&Channels::depth, &Frame::depth_m, "depthgt", cm_from_depth),
                             frames(&Channels::flow, &Frame::flow, "flowgt", vkitti_from_flow),
                             frames(&Channels::mask, &Frame::mask, "scenegt", scene_colors)});
    if (info_.channels.mask) {
      put("scenegt", stem() + "_scenegt_rgb_encoding.txt", color_table(sequence_, outlines));
    }
    write_truth(outlines);
    return fmt::format("vkitti1:{}#{}", request_.out.string(), name_.text());
  }

 private:
  std::string stem() const { return name_.group + "_" + name_.variation; }
  fs::path folder(const char* kind) const {
    const fs::path there =
        vkitti1_folder(request_.out, kind).value_or(request_.out / fmt::format("vkitti_1.3.1_{}", kind));
    return request_.stage.empty() ? there : request_.stage / there.lexically_relative(request_.out);
  }
  void put(const char* kind, const std::string& file, const std::string& bytes) const {
    write_file(folder(kind) / file, bytes);
  }

  void check_name(const std::string& name) const {
    const bool digits = name_.group.size() == 4 &&
                        std::ranges::all_of(name_.group, [](char c) { return c >= '0' && c <= '9'; });
    if (!digits || name_.variation.empty() || name_.variation.find('/') != std::string::npos) {
      fail("sequence '{}': expected four digits and a variation, such as 0018/clone", name);
    }
    if (!fs::is_directory(request_.out)) return;
    if (vkitti1_variations(request_.out, name_.group).contains(name_.variation)) {
      fail("{}: {} is there already: remove it, or choose another folder or sequence", request_.out.string(),
           name_.text());
    }
  }

  void check_camera() const {
    const PinholeCamera& k = info_.camera.left;
    if (k.fx == 725 && k.fy == 725 && k.cx == 620.5 && k.cy == 187 && info_.width == 1242 &&
        info_.height == 375) {
      return;
    }
    fail(
        "{}:{}: the layout vkitti1 has no place for a camera other than f = 725, c = (620.5, 187), 1242x375; "
        "this one has f = ({}, {}), c = ({}, {}), {}x{}: take the layout vkitti2",
        info_.dataset, info_.sequence, k.fx, k.fy, k.cx, k.cy, info_.width, info_.height);
  }

  void write_truth(const std::map<int, MaskOutlines>& outlines) const {
    const SequenceTruth& truth = sequence_.truth();
    if (truth.camera.empty()) return;
    std::map<int, SE3> T_camera_world;
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      T_camera_world[frame] = truth.camera.pose(frame)->inverse();
    }
    fs::create_directories(folder("extrinsicsgt"));
    put("extrinsicsgt", stem() + ".txt", encode_vkitti1_extrinsics(T_camera_world));
    std::vector<Vkitti1Object> objects;
    for (const VkittiRow& row : vkitti_rows(sequence_, outlines)) objects.push_back(to_text(row));
    fs::create_directories(folder("motgt"));
    put("motgt", stem() + ".txt", encode_vkitti1_objects(objects));
  }

  const Sequence& sequence_;
  const SequenceInfo& info_;
  const LayoutRequest& request_;
  VkittiName name_;
};

}  // namespace

std::string write_vkitti1_layout(const Sequence& sequence, const LayoutRequest& request) {
  return Writer(sequence, request).write();
}

}  // namespace sextant
