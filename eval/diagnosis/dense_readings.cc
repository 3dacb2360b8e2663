#include "sextant/eval/diagnosis/dense_readings.h"

#include <fmt/format.h>

#include <algorithm>

namespace sextant {
namespace {

using V = Eigen::Vector2d;

V kitti_from_vkitti(const V& f, double width, double height) {
  const auto n = [](double x, double size) { return (x / (size - 1) + 1) * 65535 / 2; };
  return {(n(f.x(), width) - 32768) / 64, (n(f.y(), height) - 32768) / 64};
}

V vkitti_from_kitti(const V& f, double width, double height) {
  const auto x = [](double px, double size) { return (2 * (64 * px + 32768) / 65535 - 1) * (size - 1); };
  return {x(f.x(), width), x(f.y(), height)};
}

const FlowReading all_flow_readings[] = {
    {"flow is backward: u and v have the wrong sign", "negate u and v, or compute the flow to the next image",
     [](const V& f, double, double) { return V(-f); }},
    {"flow has u and v swapped", "exchange u and v",
     [](const V& f, double, double) { return V(f.y(), f.x()); }},
    {"flow has u negated (x axis to the left)", "negate u",
     [](const V& f, double, double) { return V(-f.x(), f.y()); }},
    {"flow has v negated (y axis upwards)", "negate v",
     [](const V& f, double, double) { return V(f.x(), -f.y()); }},
    {"flow is 64 times too large: KITTI's n - 2^15 not divided by 64", "divide the flow by 64",
     [](const V& f, double, double) { return V(f / 64); }},
    {"flow is not decoded: KITTI's n stands for (n - 2^15) / 64", "write (n - 2^15) / 64",
     [](const V& f, double, double) { return V((f.array() - 32768) / 64); }},
    {"flow lacks KITTI's offset: n / 64 stands for (n - 2^15) / 64", "subtract 512",
     [](const V& f, double, double) { return V(f.array() - 512); }},
    {"flow is normalised by the image size", "multiply the flow by the image size less 1",
     [](const V& f, double width, double height) { return V(f.x() * (width - 1), f.y() * (height - 1)); }},
    {"flow is normalised to [-1, 1] by half the image size", "multiply the flow by half the image size",
     [](const V& f, double width, double height) {
       return V(f.x() * (width - 1) / 2, f.y() * (height - 1) / 2);
     }},
    {"flow is stored as KITTI's (n - 2^15) / 64, but read as Virtual KITTI's", "", kitti_from_vkitti,
     "vkitti", "kitti"},
    {"flow is stored as Virtual KITTI's, but read as KITTI's (n - 2^15) / 64", "", vkitti_from_kitti, "kitti",
     "vkitti"},
    {"flow is 2 times too large", "divide the flow by 2",
     [](const V& f, double, double) { return V(f / 2); }},
    {"flow is 2 times too small: computed on images of half the size?", "multiply the flow by 2",
     [](const V& f, double, double) { return V(f * 2); }},
};

/// Possible meanings of the integers n of a depth image, as depth in m.
struct Meaning {
  const char* name;
  const char* kind;  ///< of files with this meaning
  double (*z_m)(double n, double bf);
};
constexpr Meaning meanings[] = {
    {"disparity * 256", "disparity256", [](double n, double bf) { return bf * 256 / n; }},
    {"disparity in whole px", "", [](double n, double bf) { return bf / n; }},
    {"centimetres", "cm", [](double n, double) { return n / 100; }},
    {"millimetres", "", [](double n, double) { return n / 1000; }},
    {"depth * 256 (KITTI depth)", "depth256", [](double n, double) { return n / 256; }},
    {"depth * 5000 (TUM)", "", [](double n, double) { return n / 5000; }},
    {"whole metres", "", [](double n, double) { return n; }},
};

/// Inverse of the reader of a kind of depth files: from depth to the integer n.
struct Reader {
  const char* kind;
  const char* meaning;
  double (*n)(double z_m, double bf);
};
constexpr Reader readers[] = {
    {"disparity256", "disparity * 256", [](double z, double bf) { return 256 * bf / z; }},
    {"cm", "centimetres", [](double z, double) { return 100 * z; }},
    {"depth256", "depth * 256 (KITTI depth)", [](double z, double) { return 256 * z; }},
};

}  // namespace

std::span<const FlowReading> flow_readings() { return all_flow_readings; }

std::vector<DepthReading> depth_readings(std::string_view kind) {
  const auto* const reader = std::ranges::find(readers, kind, &Reader::kind);
  if (reader == std::end(readers)) return {};
  std::vector<DepthReading> out;
  for (const Meaning& meaning : meanings) {
    if (kind == meaning.kind) continue;
    out.push_back(
        {fmt::format("depth looks like {}: the files are read as {}", meaning.name, reader->meaning),
         meaning.kind, [meaning, n = reader->n](double z, double bf) { return meaning.z_m(n(z, bf), bf); }});
  }
  return out;
}

}  // namespace sextant
