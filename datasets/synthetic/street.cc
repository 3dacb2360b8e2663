#include "sextant/datasets/synthetic/street.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sextant/base/error.h"

namespace sextant::synthetic {

using Eigen::Vector3d;
using Eigen::Vector3f;

double Furnisher::house_height_m() { return 3.1 * std::round(draw(2.6, 6.4)) + 0.9; }

void Furnisher::house(const Vector3d& low, const Vector3d& high, double height_m, double below_m) {
  static const Vector3f palette[] = {{0.66F, 0.56F, 0.44F}, {0.60F, 0.40F, 0.32F}, {0.70F, 0.66F, 0.58F},
                                     {0.52F, 0.50F, 0.48F}, {0.72F, 0.62F, 0.40F}, {0.55F, 0.60F, 0.62F}};
  const Vector3f colour = palette[next_seed() % std::size(palette)];
  const Look wall{Material::facade, colour, next_seed(), 0};
  const Look roof{Material::plaster, {0.35F, 0.22F, 0.18F}, next_seed(), 0};
  const double ground = low.y();
  mesh.add_box(wall, roof, {low.x(), ground - height_m, low.z()}, {high.x(), ground + below_m, high.z()});
  // A cornice, which casts a shadow and interrupts the outline.
  const Look cornice{Material::plaster, colour * 1.15F, next_seed(), 0};
  const double lip = 0.35;
  mesh.add_box(cornice, roof, {low.x() - lip, ground - height_m - 0.4, low.z() + 0.02},
               {high.x() + lip, ground - height_m + 0.15, high.z() - 0.02});
}

void Furnisher::tree(const Vector3d& foot) {
  const Look bark{Material::bark, {0.30F, 0.24F, 0.18F}, next_seed(), 0};
  const double crown = draw(2.9, 3.7);
  mesh.add_tube(bark, foot, {foot.x(), foot.y() - crown, foot.z()}, 0.17, 0.11, 8);
  for (int i = 0; i < 3; ++i) {
    const auto tint = static_cast<float>(draw(0.8, 1.15));
    const Look leaves{Material::foliage, Vector3f(0.24F, 0.36F, 0.13F) * tint, next_seed(), 0};
    const double size = draw(0.9, 1.4);
    const double x = draw(-0.6, 0.6), y = draw(0, 1.2), z = draw(-0.7, 0.7);
    mesh.add_blob(leaves, foot + Vector3d(x, -crown - 0.6 - y, z), {size, 0.85 * size, size});
  }
}

void Furnisher::post(const Vector3d& foot, double arm_sign) {
  const Look metal{Material::metal, {0.35F, 0.37F, 0.38F}, next_seed(), 0};
  const Look sign{Material::paint, {0.15F, 0.25F, 0.60F}, next_seed(), 0};
  mesh.add_tube(metal, foot, foot + Vector3d(0, -6.2, 0), 0.09, 0.07, 8);
  mesh.add_tube(metal, foot + Vector3d(0, -6.15, 0), foot + Vector3d(1.6 * arm_sign, -6.35, 0), 0.06, 0.05,
                6);
  mesh.add_box(sign, sign, foot + Vector3d(-0.35, -3.2, -0.12), foot + Vector3d(0.35, -2.5, -0.10));
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f street_grey(0.34F, 0.34F, 0.35F);

/// The rectangle on the ground that a block of houses with its pavement occupies.
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
    const auto marked = static_cast<float>(r - 2.3);  // a parking strip lies outside the lanes
    const Look road{Material::road, street_grey, 101, marked};
    const Look plain{Material::asphalt, street_grey, 101, 0};
    const Look stripes{Material::stripes, street_grey, 101, 0};
    // A plane 30 cm below the road, which is visible beyond the blocks.
    ground({Material::grass, {0.30F, 0.36F, 0.20F}, 103, 0}, -400, 400, plan_.z_from_m - 300,
           plan_.z_to_m + 300, 0.3);
    if (!plan_.crossing_z_m) {
      ground(road, -r, r, plan_.z_from_m, plan_.z_to_m, 0);
      return;
    }
    const double c = *plan_.crossing_z_m;
    const double band = 3.0;  // width of the pedestrian crossings
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

  /// Adds pavement, houses, trees and posts of one block. Only sides that face a road are furnished.
  void furnish(const Block& b) {
    const Look kerb{Material::plaster, {0.55F, 0.54F, 0.52F}, next_seed(), 0};
    const Look slabs{Material::paving, {0.52F, 0.50F, 0.47F}, next_seed(), 0};
    mesh.add_box(kerb, slabs, {b.x0, -kerb_m, b.z0}, {b.x1, 0, b.z1});
    const double p = plan_.pavement_m;
    const double depth = 11;
    const bool right = b.x0 > 0;
    const double front = right ? b.x0 + p : b.x1 - p;  // front of the houses along the main road
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

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double step_m = 1.5;
constexpr double lower_m = 0.02;
constexpr double margin_m = 70;
constexpr double house_depth_m = 11;

Vector2d flat(const Vector3d& p) { return {p.x(), p.z()}; }

/// A rectangle on the ground with its own axes: x across (to the right of `ahead`), z along.
struct Plot {
  Vector2d middle, ahead;
  double x0, x1, z0, z1;

  Vector2d local(const Vector2d& p) const {
    const Vector2d d = p - middle;
    return {d.dot(Vector2d(ahead.y(), -ahead.x())), d.dot(ahead)};
  }
  double distance_m(const Vector2d& world) const {
    const Vector2d p = local(world);
    return Vector2d(std::max({x0 - p.x(), 0.0, p.x() - x1}), std::max({z0 - p.y(), 0.0, p.y() - z1})).norm();
  }
  bool cut_by(const Vector2d& from_world, const Vector2d& to_world) const {
    const Vector2d from = local(from_world), step = local(to_world) - from;
    double t0 = 0, t1 = 1;
    const double low[] = {x0, z0}, high[] = {x1, z1};
    for (int k = 0; k < 2; ++k) {
      if (std::abs(step[k]) < 1e-12) {
        if (from[k] < low[k] || from[k] > high[k]) return false;
        continue;
      }
      const double a = (low[k] - from[k]) / step[k], b = (high[k] - from[k]) / step[k];
      t0 = std::max(t0, std::min(a, b));
      t1 = std::min(t1, std::max(a, b));
    }
    return t0 <= t1;
  }
};

class Builder : Furnisher {
 public:
  explicit Builder(const StreetWay& way) : Furnisher(way.seed), way_(way) {
    sample_way();
    thin_out_free();
  }

  Mesh build() {
    std::vector<Terrain::Support> supports;
    std::vector<Terrain::Disc> road;
    for (const Vector3d& place : samples_) {
      supports.push_back({place + Vector3d(0, lower_m, 0), 1});
      road.push_back({place, way_.road_half_m});
    }
    for (const Vector3d& place : free_) {
      supports.push_back({place + Vector3d(0, lower_m, 0), 0.3});
      road.push_back({place, 3.2});
    }
    const Terrain terrain(supports, road, margin_m);
    terrain_ = &terrain;
    terrain.add_to(mesh, way_.pavement_m);
    far_ground(supports);
    marks();
    for (const double side : {-1.0, 1.0}) {
      houses(side);
      plants(side);
    }
    return std::move(mesh);
  }

 private:
  /// Samples the path in steps of about step_m, with straight ends.
  void sample_way() {
    if (way_.points.empty()) fail("street along a path: the path has no points");
    const auto heading = [](const StreetWay::Point& point) -> Vector3d {
      const Vector3d ahead(point.ahead.x(), 0, point.ahead.z());
      if (!point.ground.allFinite() || !ahead.allFinite() || ahead.norm() < 1e-9) {
        fail(
            "street along a path: a point of the path or its direction is not finite, or the direction has "
            "no horizontal component");
      }
      return ahead.normalized();
    };
    const Vector3d back = -heading(way_.points.front());
    for (double s = way_.before_m; s > 0.5 * step_m; s -= step_m) {
      samples_.push_back(way_.points.front().ground + s * back);
    }
    for (const StreetWay::Point& point : way_.points) {
      heading(point);  // throws Error if the heading is undefined
      if (!samples_.empty()) {
        const Vector3d last = samples_.back();
        const double gap_m = (flat(point.ground) - flat(last)).norm();
        if (gap_m < step_m) continue;
        if (gap_m > 1000)
          fail("street along a path: consecutive points are {:.0f} m apart, expected at most 1 km", gap_m);
        const int n = static_cast<int>(gap_m / step_m);
        for (int i = 1; i < n; ++i) samples_.push_back(last + (point.ground - last) * i / n);
      }
      samples_.push_back(point.ground);
    }
    const Vector3d on = heading(way_.points.back());
    const Vector3d end = samples_.back();
    for (double s = step_m; s <= way_.after_m; s += step_m) samples_.push_back(end + s * on);
    while (samples_.size() < 2) samples_.push_back(samples_.back() + step_m * on);
  }

  void thin_out_free() {
    std::set<std::pair<int64_t, int64_t>> taken;
    for (const Vector3d& place : way_.keep_free) {
      if (!place.allFinite())
        fail("street along a path: the position of an object is not finite: expected finite coordinates, m");
      if (taken.emplace(std::llround(place.x() * 2), std::llround(place.z() * 2)).second) {
        free_.push_back(place);
      }
    }
  }

  bool is_free(const Plot& plot, double from_way_m) const {
    for (const Vector3d& place : samples_) {
      if (plot.distance_m(flat(place)) < from_way_m) return false;
    }
    for (const Vector3d& place : free_) {
      if (plot.distance_m(flat(place)) < way_.clearance_m) return false;
    }
    return std::ranges::none_of(
        way_.sight, [&](const StreetWay::Line& line) { return plot.cut_by(flat(line.from), flat(line.to)); });
  }

  /// Adds ground below and beyond the terrain.
  void far_ground(const std::vector<Terrain::Support>& supports) {
    Vector3d low = supports.front().place, high = low;
    for (const Terrain::Support& support : supports) {
      low = low.cwiseMin(support.place);
      high = high.cwiseMax(support.place);
    }
    const double y = high.y() + 0.3;
    low.array() -= 500;
    high.array() += 500;
    mesh.add_polygon(
        {Material::grass, {0.30F, 0.36F, 0.20F}, 103, 0},
        {{low.x(), y, low.z()}, {high.x(), y, low.z()}, {high.x(), y, high.z()}, {low.x(), y, high.z()}},
        Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitZ());
  }

  /// Adds a dashed line, and a solid line on the right, just above the ground.
  void marks() {
    const Look white{Material::plaster, {0.80F, 0.80F, 0.78F}, 105, 0};
    for (size_t i = 0; i + 1 < samples_.size(); ++i) {
      const Vector2d a = flat(samples_[i]), b = flat(samples_[i + 1]);
      const Vector2d right = right_of(i);
      const auto strip = [&](double offset_m) {
        std::vector<Vector3d> corners;
        for (const auto& [at, half] : {std::pair(a, -0.07), {b, -0.07}, {b, 0.07}, {a, 0.07}}) {
          const Vector2d p = at + (offset_m + half) * right;
          corners.emplace_back(p.x(), terrain_->height(p.x(), p.y()) - 0.015, p.y());
        }
        // Four corners on hilly ground are not coplanar, so each strip consists of two triangles.
        mesh.add_polygon(white, {corners[0], corners[1], corners[2]});
        mesh.add_polygon(white, {corners[0], corners[2], corners[3]});
      };
      if (i % 4 < 2) strip(way_.dashes_m);
      strip(way_.road_half_m - 2.3);
    }
  }

  Vector2d right_of(size_t i) const {
    const size_t from = i < 2 ? 0 : i - 2, to = std::min(i + 3, samples_.size() - 1);
    const Vector2d ahead = (flat(samples_[to]) - flat(samples_[from])).normalized();
    return {ahead.y(), -ahead.x()};
  }

  void houses(double side) {
    size_t i = 0;
    while (i + 3 < samples_.size()) {
      const double length_m = 2.7 * std::round(draw(4, 9));
      const double height_m = house_height_m();
      const size_t j = std::min(i + static_cast<size_t>(length_m / step_m), samples_.size() - 1);
      const Vector2d a = flat(samples_[i]), b = flat(samples_[j]);
      i = j;
      if ((b - a).norm() < 2) continue;
      const double front_m = way_.road_half_m + way_.pavement_m;
      for (const double back_m : {0.0, 5.0, 12.0, 22.0}) {
        const double near_m = front_m + back_m, far_m = near_m + house_depth_m;
        const Plot plot{
            (a + b) / 2,         (b - a).normalized(), side < 0 ? -far_m : near_m, side < 0 ? -near_m : far_m,
            -(b - a).norm() / 2, (b - a).norm() / 2};
        if (!is_free(plot, front_m - 0.6)) continue;
        place_house(plot, height_m);
        break;
      }
    }
  }

  void place_house(const Plot& plot, double height_m) {
    double top = 1e300, bottom = -1e300;
    const Vector2d right(plot.ahead.y(), -plot.ahead.x());
    for (const double x : {plot.x0, plot.x1}) {
      for (const double z : {plot.z0, plot.z1}) {
        const Vector2d p = plot.middle + x * right + z * plot.ahead;
        top = std::min(top, terrain_->height(p.x(), p.y()));
        bottom = std::max(bottom, terrain_->height(p.x(), p.y()));
      }
    }
    Furnisher one(next_seed());
    one.house({plot.x0, 0, plot.z0}, {plot.x1, 0, plot.z1}, height_m, bottom - top + 0.5);
    append(one.mesh, plot.middle, plot.ahead, top);
  }

  void append(const Mesh& part, const Vector2d& at, const Vector2d& ahead, double y) {
    const double heading_rad = std::atan2(ahead.x(), ahead.y());
    mesh.append(part, SE3(Eigen::Quaterniond(Eigen::AngleAxisd(heading_rad, Vector3d::UnitY())),
                          {at.x(), y, at.y()}));
  }

  void plants(double side) {
    double next_m = 4;
    double travelled_m = 0;
    for (size_t i = 0; i + 1 < samples_.size(); ++i) {
      const Vector2d at = flat(samples_[i]);
      travelled_m += (flat(samples_[i + 1]) - at).norm();
      if (travelled_m < next_m) continue;
      next_m += draw(7, 11);
      const Vector2d right = right_of(i), ahead(-right.y(), right.x());
      const bool is_tree = draw(0, 1) < 0.62;
      const double radius_m = is_tree ? 1.6 : 0.4;
      const Vector2d foot = at + side * (way_.road_half_m + 0.8) * right;
      const Plot plot{foot, ahead, -radius_m, radius_m, -radius_m, radius_m};
      if (!is_free(plot, std::max(way_.clearance_m, way_.road_half_m - 1))) continue;
      Furnisher one(next_seed());
      if (is_tree) {
        one.tree({0, 0.1, 0});
      } else {
        one.post({0, 0.1, 0}, -side);
      }
      append(one.mesh, foot, ahead, terrain_->height(foot.x(), foot.y()));
    }
  }

  const StreetWay& way_;
  std::vector<Vector3d> samples_, free_;
  const Terrain* terrain_ = nullptr;
};

}  // namespace

Mesh make_street_along(const StreetWay& way) { return Builder(way).build(); }

}  // namespace sextant::synthetic
