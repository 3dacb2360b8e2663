#include "sextant/datasets/synthetic/street.h"

#include <algorithm>
#include <cmath>

#include "sextant/datasets/synthetic/furniture.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f asphalt_grey(0.34F, 0.34F, 0.35F);

/// A block of houses: a rectangle on the ground, and which of its sides face a road.
struct Block {
  double x0, x1, z0, z1;
};

class StreetBuilder : Furnisher {
 public:
  explicit StreetBuilder(const StreetPlan& plan) : Furnisher(plan.seed), plan_(plan) {}

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
    house({-far, -kerb_m, plan_.z_to_m}, {far, -kerb_m, plan_.z_to_m + 14}, 17);
    house({-far, -kerb_m, plan_.z_from_m - 14}, {far, -kerb_m, plan_.z_from_m}, 15);
    if (plan_.crossing_z_m) {
      const double c = *plan_.crossing_z_m;
      house({far, -kerb_m, c - 30}, {far + 14, -kerb_m, c + 30}, 16);
      house({-far - 14, -kerb_m, c - 30}, {-far, -kerb_m, c + 30}, 18);
    }
    return std::move(mesh);
  }

 private:
  void ground(const Look& look, double x0, double x1, double z0, double z1, double y, bool along_x = false,
              Vector2d middle = Vector2d::Zero()) {
    const Vector3d origin(middle.x(), 0, middle.y());
    mesh.add_polygon(look, {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}}, origin,
                     along_x ? Vector3d::UnitZ() : Vector3d::UnitX(),
                     along_x ? Vector3d::UnitX() : Vector3d::UnitZ());
  }

  void roads() {
    const double r = plan_.road_half_m;
    const auto marked = static_cast<float>(r - 2.3);  // a parking strip lies outside of the lanes
    const Look road{Material::road, asphalt_grey, 101, marked};
    const Look plain{Material::asphalt, asphalt_grey, 101, 0};
    const Look stripes{Material::stripes, asphalt_grey, 101, 0};
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
    mesh.add_box(kerb, slabs, {b.x0, -kerb_m, b.z0}, {b.x1, 0, b.z1});
    const double p = plan_.pavement_m;
    const double depth = 11;
    const bool right = b.x0 > 0;
    const double front = right ? b.x0 + p : b.x1 - p;  // of the houses along the main road
    const double back = right ? front + depth : front - depth;
    double z0 = b.z0 + (faces_crossing(b.z0) ? p : 0.0);
    const double z1 = b.z1 - (faces_crossing(b.z1) ? p : 0.0);
    row(z0, z1, [&](double from, double to, double height_m) {
      house({std::min(front, back), -kerb_m, from}, {std::max(front, back), -kerb_m, to}, height_m);
    });
    plant_row(right ? b.x0 + 0.8 : b.x1 - 0.8, b.z0 + 6, b.z1 - 6);
    for (const double edge : {b.z0, b.z1}) {
      if (!faces_crossing(edge)) continue;
      const double inwards = edge == b.z0 ? 1 : -1;
      const double zf = edge + inwards * p, zb = zf + inwards * depth;
      const double from_x = right ? back + 1 : b.x0, to_x = right ? b.x1 : back - 1;
      row(from_x, to_x, [&](double from, double to, double height_m) {
        house({from, -kerb_m, std::min(zf, zb)}, {to, -kerb_m, std::max(zf, zb)}, height_m);
      });
      for (double x = from_x; x < to_x; x += draw(9, 13)) tree({x, -kerb_m, edge + inwards * 0.8});
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
      build(from, from + length, house_height_m());
      from += length + (draw(0, 1) < 0.2 ? 2.0 : 0.0);
    }
  }

  void plant_row(double x, double z0, double z1) {
    for (double z = z0; z < z1; z += draw(7, 11)) {
      if (draw(0, 1) < 0.62) {
        tree({x, -kerb_m, z});
      } else {
        post({x, -kerb_m, z}, x < 0 ? 1.0 : -1.0);
      }
    }
  }

  StreetPlan plan_;
};

}  // namespace

Mesh make_street(const StreetPlan& plan) { return StreetBuilder(plan).build(); }

}  // namespace sextant::synthetic
