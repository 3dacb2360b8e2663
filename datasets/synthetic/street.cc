#include "sextant/datasets/synthetic/street.h"

#include <algorithm>
#include <cmath>

namespace sextant::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kKerb_m = 0.14;
const Vector3f kAsphalt(0.34F, 0.34F, 0.35F);

/// A block of houses: a rectangle on the ground, and which of its sides face a road.
struct Block {
  double x0, x1, z0, z1;
};

class StreetBuilder {
 public:
  explicit StreetBuilder(const StreetPlan& plan) : plan_(plan) {}

  Mesh build() {
    roads();
    const double r = plan_.road_half_m;
    const double far = plan_.arm_m;
    std::vector<Block> blocks;
    for (const double side : {-1.0, 1.0}) {
      const double x0 = side < 0 ? -far : r;
      const double x1 = side < 0 ? -r : far;
      if (plan_.crossing_z_m) {
        blocks.push_back({x0, x1, plan_.z_from_m, *plan_.crossing_z_m - r});
        blocks.push_back({x0, x1, *plan_.crossing_z_m + r, plan_.z_to_m});
      } else {
        blocks.push_back({x0, x1, plan_.z_from_m, plan_.z_to_m});
      }
    }
    for (const Block& block : blocks) furnish(block);
    // Houses across the ends of the roads.
    house({-far, plan_.z_to_m}, {far, plan_.z_to_m + 14}, 17);
    house({-far, plan_.z_from_m - 14}, {far, plan_.z_from_m}, 15);
    if (plan_.crossing_z_m) {
      const double c = *plan_.crossing_z_m;
      house({far, c - 30}, {far + 14, c + 30}, 16);
      house({-far - 14, c - 30}, {-far, c + 30}, 18);
    }
    return std::move(mesh_);
  }

 private:
  uint32_t next_seed() { return hash3(plan_.seed, 77, ++things_); }
  /// Uniform in [low, high), of the next thing.
  double draw(double low, double high) { return low + (high - low) * (next_seed() * 0x1p-32); }

  void ground(const Look& look, double x0, double x1, double z0, double z1, double y, bool along_x = false,
              Vector2d middle = Vector2d::Zero()) {
    const Vector3d origin(middle.x(), 0, middle.y());
    mesh_.add_polygon(look, {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}}, origin,
                      along_x ? Vector3d::UnitZ() : Vector3d::UnitX(),
                      along_x ? Vector3d::UnitX() : Vector3d::UnitZ());
  }

  void roads() {
    const double r = plan_.road_half_m;
    const auto marked = static_cast<float>(r - 2.3);  // a parking strip lies outside of the lanes
    const Look road{Material::road, kAsphalt, 101, marked};
    const Look plain{Material::asphalt, kAsphalt, 101, 0};
    const Look stripes{Material::stripes, kAsphalt, 101, 0};
    // Far below everything: whatever lies beyond the blocks.
    ground({Material::grass, {0.30F, 0.36F, 0.20F}, 103, 0}, -400, 400, plan_.z_from_m - 300,
           plan_.z_to_m + 300, 0.3);
    if (!plan_.crossing_z_m) {
      ground(road, -r, r, plan_.z_from_m, plan_.z_to_m, 0);
      return;
    }
    const double c = *plan_.crossing_z_m;
    const double band = 3.0;  // of the pedestrian crossings
    ground(plain, -r, r, c - r, c + r, 0);
    for (const double side : {-1.0, 1.0}) {
      const auto span = [&](double from, double to) {
        return std::pair(std::min(side * from, side * to), std::max(side * from, side * to));
      };
      const auto [s0, s1] = span(r, r + band);
      ground(stripes, -r, r, c + s0, c + s1, 0, false, {0, c});
      ground(stripes, s0, s1, c - r, c + r, 0, true, {0, c});
      const double end = side < 0 ? c - plan_.z_from_m : plan_.z_to_m - c;
      const auto [l0, l1] = span(r + band, end);
      ground(road, -r, r, c + l0, c + l1, 0);
      const auto [a0, a1] = span(r + band, plan_.arm_m);
      ground(road, a0, a1, c - r, c + r, 0, true, {0, c});
    }
  }

  /// Pavement, houses, trees and posts of one block. Only sides towards a road are furnished.
  void furnish(const Block& b) {
    const Look kerb{Material::plaster, {0.55F, 0.54F, 0.52F}, next_seed(), 0};
    const Look slabs{Material::paving, {0.52F, 0.50F, 0.47F}, next_seed(), 0};
    mesh_.add_box(kerb, slabs, {b.x0, -kKerb_m, b.z0}, {b.x1, 0, b.z1});
    const double p = plan_.pavement_m;
    const double depth = 11;
    const bool right = b.x0 > 0;
    const double front = right ? b.x0 + p : b.x1 - p;  // of the houses along the main road
    const double back = right ? front + depth : front - depth;
    double z0 = b.z0 + (faces_crossing(b.z0) ? p : 0.0);
    const double z1 = b.z1 - (faces_crossing(b.z1) ? p : 0.0);
    row(z0, z1, [&](double from, double to, double height_m) {
      house({std::min(front, back), from}, {std::max(front, back), to}, height_m);
    });
    plant_row(right ? b.x0 + 0.8 : b.x1 - 0.8, b.z0 + 6, b.z1 - 6);
    for (const double edge : {b.z0, b.z1}) {
      if (!faces_crossing(edge)) continue;
      const double inwards = edge == b.z0 ? 1 : -1;
      const double zf = edge + inwards * p, zb = zf + inwards * depth;
      const double from_x = right ? back + 1 : b.x0, to_x = right ? b.x1 : back - 1;
      row(from_x, to_x, [&](double from, double to, double height_m) {
        house({from, std::min(zf, zb)}, {to, std::max(zf, zb)}, height_m);
      });
      for (double x = from_x; x < to_x; x += draw(9, 13)) tree(x, edge + inwards * 0.8);
    }
  }

  bool faces_crossing(double z) const {
    return plan_.crossing_z_m && std::abs(z - *plan_.crossing_z_m) < plan_.road_half_m + 0.1;
  }

  template <typename House>
  void row(double from, double to, const House& build) {
    while (to - from > 4) {
      double length = 2.7 * std::round(draw(4, 9));
      if (to - from - length < 8) length = to - from;
      build(from, from + length, 3.1 * std::round(draw(2.6, 6.4)) + 0.9);
      from += length + (draw(0, 1) < 0.2 ? 2.0 : 0.0);
    }
  }

  void house(const Vector2d& low, const Vector2d& high, double height_m) {
    static const Vector3f palette[] = {{0.66F, 0.56F, 0.44F}, {0.60F, 0.40F, 0.32F}, {0.70F, 0.66F, 0.58F},
                                       {0.52F, 0.50F, 0.48F}, {0.72F, 0.62F, 0.40F}, {0.55F, 0.60F, 0.62F}};
    const Vector3f colour = palette[next_seed() % std::size(palette)];
    const Look wall{Material::facade, colour, next_seed(), 0};
    const Look roof{Material::plaster, {0.35F, 0.22F, 0.18F}, next_seed(), 0};
    mesh_.add_box(wall, roof, {low.x(), -height_m - kKerb_m, low.y()}, {high.x(), -kKerb_m, high.y()});
    // A cornice: it throws a shadow and breaks the outline.
    const Look cornice{Material::plaster, colour * 1.15F, next_seed(), 0};
    const double lip = 0.35;
    mesh_.add_box(cornice, roof, {low.x() - lip, -height_m - kKerb_m - 0.4, low.y() + 0.02},
                  {high.x() + lip, -height_m - kKerb_m + 0.15, high.y() - 0.02});
  }

  void plant_row(double x, double z0, double z1) {
    for (double z = z0; z < z1; z += draw(7, 11)) {
      if (draw(0, 1) < 0.62) {
        tree(x, z);
      } else {
        post(x, z);
      }
    }
  }

  void tree(double x, double z) {
    const Look bark{Material::bark, {0.30F, 0.24F, 0.18F}, next_seed(), 0};
    const double crown = draw(2.9, 3.7);
    mesh_.add_tube(bark, {x, -kKerb_m, z}, {x, -crown, z}, 0.17, 0.11, 8);
    for (int i = 0; i < 3; ++i) {
      const auto tint = static_cast<float>(draw(0.8, 1.15));
      const Look leaves{Material::foliage, Vector3f(0.24F, 0.36F, 0.13F) * tint, next_seed(), 0};
      const double size = draw(0.9, 1.4);
      mesh_.add_blob(leaves, {x + draw(-0.6, 0.6), -crown - 0.6 - draw(0, 1.2), z + draw(-0.7, 0.7)},
                     {size, 0.85 * size, size});
    }
  }

  void post(double x, double z) {
    const Look metal{Material::metal, {0.35F, 0.37F, 0.38F}, next_seed(), 0};
    const Look sign{Material::paint, {0.15F, 0.25F, 0.60F}, next_seed(), 0};
    mesh_.add_tube(metal, {x, -kKerb_m, z}, {x, -6.2, z}, 0.09, 0.07, 8);
    const double to_road = x < 0 ? 1.0 : -1.0;
    mesh_.add_tube(metal, {x, -6.15, z}, {x + 1.6 * to_road, -6.35, z}, 0.06, 0.05, 6);
    mesh_.add_box(sign, sign, {x - 0.35, -3.2, z - 0.12}, {x + 0.35, -2.5, z - 0.10});
  }

  StreetPlan plan_;
  Mesh mesh_;
  uint32_t things_ = 0;
};

}  // namespace

Mesh make_street(const StreetPlan& plan) { return StreetBuilder(plan).build(); }

}  // namespace sextant::synthetic
