#include "sextant/datasets/synthetic/car.h"

#include <cmath>
#include <numbers>

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

/// A cross-section of the body: heights above ground and half widths, as shares of the car's size.
struct Station {
  double z;       ///< -0.5 rear .. 0.5 front, of the length
  double bottom;  ///< of the height
  double belt;    ///< of the height: where the body ends and glass begins
  double half;    ///< of the width, at the belt
};

class CarBuilder {
 public:
  explicit CarBuilder(const CarShape& shape) : shape_(shape) {}

  Mesh build() {
    body();
    cabin();
    for (const double side : {-1.0, 1.0}) {
      wheel(side, shape_.fills_box ? -0.415 : -0.31);
      wheel(side, shape_.fills_box ? 0.41 : 0.32);
    }
    lights_and_plates();
    return std::move(mesh_);
  }

 private:
  Vector3d at(double x_share, double height_share, double z_share) const {
    return {x_share * shape_.width_m, -height_share * shape_.height_m, z_share * shape_.length_m};
  }

  Look look(Material material, const Eigen::Vector3f& colour) {
    return {material, colour, hash3(shape_.seed, 31, ++parts_), 0};
  }

  /// A panel whose texture runs along the car and up.
  void side_panel(const Look& panel, const std::vector<Vector3d>& points) {
    mesh_.add_polygon(panel, points, Vector3d::Zero(), Vector3d::UnitZ(), -Vector3d::UnitY());
  }

  void body() {
    const double ends = shape_.fills_box ? 0.045 : 0;    // wider bumpers
    const double tuck = shape_.fills_box ? 0.86 : 0.95;  // half width below the waist
    const std::vector<Station> stations = {{-0.500, 0.26, 0.50, 0.44 + ends}, {-0.470, 0.16, 0.62, 0.48},
                                           {-0.310, 0.13, 0.64, 0.50},        {0.160, 0.13, 0.62, 0.50},
                                           {0.330, 0.13, 0.56, 0.49},         {0.460, 0.15, 0.49, 0.46},
                                           {0.500, 0.24, 0.40, 0.40 + ends}};
    const Look side = look(Material::paint, shape_.colour);
    const Look top = look(Material::paint, shape_.colour);
    const Look under = look(Material::tyre, {0.05F, 0.05F, 0.05F});
    const double waist = 0.38;  // where the side is widest; below, it bends inwards
    for (size_t i = 0; i + 1 < stations.size(); ++i) {
      const Station& a = stations[i];
      const Station& b = stations[i + 1];
      for (const double s : {-1.0, 1.0}) {
        const double wa = std::min(waist, a.belt - 0.02), wb = std::min(waist, b.belt - 0.02);
        triangles(side, at(s * a.half, wa, a.z), at(s * b.half, wb, b.z), at(s * b.half * 0.95, b.belt, b.z),
                  at(s * a.half * 0.95, a.belt, a.z));
        triangles(side, at(s * a.half * tuck, a.bottom, a.z), at(s * b.half * tuck, b.bottom, b.z),
                  at(s * b.half, wb, b.z), at(s * a.half, wa, a.z));
        // The shoulder and half of the deck: bonnet, boot.
        triangles(top, at(s * a.half * 0.95, a.belt, a.z), at(s * b.half * 0.95, b.belt, b.z),
                  at(0, b.belt + 0.02, b.z), at(0, a.belt + 0.02, a.z));
        triangles(under, at(s * a.half * tuck, a.bottom, a.z), at(s * b.half * tuck, b.bottom, b.z),
                  at(0, b.bottom, b.z), at(0, a.bottom, a.z));
      }
    }
    for (const Station& end : {stations.front(), stations.back()}) {
      const double w = std::min(waist, end.belt - 0.02);
      const double x = end.half;
      mesh_.add_polygon(side,
                        {at(-x * tuck, end.bottom, end.z), at(x * tuck, end.bottom, end.z), at(x, w, end.z),
                         at(x * 0.95, end.belt, end.z), at(0, end.belt + 0.02, end.z),
                         at(-x * 0.95, end.belt, end.z), at(-x, w, end.z)},
                        Vector3d::Zero(), Vector3d::UnitX(), -Vector3d::UnitY());
    }
  }

  /// Two triangles with a side texture: stations differ, so four corners need not lie in one plane.
  void triangles(const Look& panel, const Vector3d& a, const Vector3d& b, const Vector3d& c,
                 const Vector3d& d) {
    const auto one = [&](const Vector3d& p, const Vector3d& q, const Vector3d& r) {
      const Vector3d normal = (q - p).cross(r - p);
      if (normal.norm() < 1e-9) return;
      const bool flat = std::abs(normal.normalized().y()) > 0.7;
      mesh_.add_polygon(panel, {p, q, r}, Vector3d::Zero(), Vector3d::UnitZ(),
                        flat ? Vector3d::UnitX().eval() : (-Vector3d::UnitY()).eval());
    };
    one(a, b, c);
    one(a, c, d);
  }

  void cabin() {
    const double rear_foot = shape_.van ? -0.485 : -0.40;
    const double rear_roof = shape_.van ? -0.45 : -0.25;
    const double front_roof = 0.06, front_foot = 0.24;
    const double belt = 0.61, roof = 1.0;
    const double foot = 0.475, top = shape_.fills_box ? 0.33 : 0.39;  // half widths
    const Look roof_look = look(Material::paint, shape_.colour);
    const Look frame = look(Material::paint, shape_.colour * 0.9F);
    const Look glass = look(Material::glass, {0.13F, 0.16F, 0.19F});
    const double crown = roof - 0.03;
    for (const double s : {-1.0, 1.0}) {
      side_panel(frame, {at(s * foot, belt, rear_foot), at(s * foot, belt, front_foot),
                         at(s * top, crown, front_roof), at(s * top, crown, rear_roof)});
      mesh_.add_polygon(roof_look, {at(s * top, crown, rear_roof), at(s * top, crown, front_roof),
                                    at(0, roof, front_roof), at(0, roof, rear_roof)});
      // Two side windows, a little outside of their frame.
      const auto pane = [&](double z, double up) {
        return Vector3d(at(s * (foot + (top - foot) * up), belt + (crown - belt) * up, z) +
                        Vector3d(s * 0.012, 0, 0));
      };
      const auto slant = [](double from, double to, double up) { return from + (to - from) * up; };
      const double low = 0.10, high = 0.88, post = -0.07;
      side_panel(glass, {pane(slant(rear_foot, rear_roof, low) + 0.035, low), pane(post - 0.01, low),
                         pane(post - 0.01, high), pane(slant(rear_foot, rear_roof, high) + 0.025, high)});
      side_panel(glass, {pane(post + 0.01, low), pane(slant(front_foot, front_roof, low) - 0.035, low),
                         pane(slant(front_foot, front_roof, high) - 0.025, high), pane(post + 0.01, high)});
    }
    screen(frame, glass, rear_foot, rear_roof, belt, roof, foot, top, -0.012);
    screen(frame, glass, front_foot, front_roof, belt, roof, foot, top, 0.012);
  }

  void screen(const Look& frame, const Look& glass, double z_foot, double z_roof, double belt, double roof,
              double foot, double top, double offset_m) {
    const double crown = roof - 0.03;
    mesh_.add_polygon(frame, {at(-foot, belt, z_foot), at(foot, belt, z_foot), at(top, crown, z_roof),
                              at(-top, crown, z_roof)});
    mesh_.add_polygon(frame, {at(-top, crown, z_roof), at(top, crown, z_roof), at(0, roof, z_roof)});
    const auto pane = [&](double x_share, double up) {
      const double half = foot + (top - foot) * up - 0.03;
      return Vector3d(at(x_share * half, belt + (crown - belt) * up, z_foot + (z_roof - z_foot) * up) +
                      Vector3d(0, -0.012, offset_m));
    };
    mesh_.add_polygon(glass, {pane(-1, 0.08), pane(1, 0.08), pane(1, 0.92), pane(-1, 0.92)});
  }

  void wheel(double side, double z_share) {
    constexpr int spokes = 16;
    const double radius_m = 0.215 * shape_.height_m;
    const Vector3d hub(side * (0.5 * shape_.width_m + 0.015), -radius_m, z_share * shape_.length_m);
    const Vector3d inner = hub - Vector3d(side * 0.22, 0, 0);
    const Look tyre = look(Material::tyre, {0.07F, 0.07F, 0.07F});
    const Look rim = look(Material::metal, {0.55F, 0.56F, 0.58F});
    mesh_.add_tube(tyre, inner, hub, radius_m, radius_m, spokes);
    disc(tyre, hub, radius_m, spokes);
    disc(rim, hub + Vector3d(side * 0.012, 0, 0), 0.62 * radius_m, spokes);
    disc(tyre, hub + Vector3d(side * 0.02, 0, 0), 0.16 * radius_m, 6);
  }

  void disc(const Look& face, const Vector3d& centre, double radius_m, int corners) {
    std::vector<Vector3d> rim;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      rim.push_back(centre + radius_m * Vector3d(0, std::cos(angle), std::sin(angle)));
    }
    mesh_.add_polygon(face, rim);
  }

  void lights_and_plates() {
    const Look red = look(Material::metal, {0.65F, 0.05F, 0.05F});
    const Look white = look(Material::metal, {0.90F, 0.90F, 0.85F});
    const Look black = look(Material::metal, {0.06F, 0.06F, 0.06F});
    const auto face = [&](const Look& part, double x0, double x1, double low, double high, double z,
                          double gap_m) {
      const Vector3d gap(0, 0, gap_m);
      mesh_.add_polygon(
          part, {at(x0, low, z) + gap, at(x1, low, z) + gap, at(x1, high, z) + gap, at(x0, high, z) + gap});
    };
    for (const double s : {-1.0, 1.0}) {
      face(red, s * 0.28, s * 0.41, 0.39, 0.48, -0.5, -0.012);
      face(white, s * 0.24, s * 0.37, 0.31, 0.38, 0.5, 0.012);
    }
    face(white, -0.14, 0.14, 0.40, 0.47, -0.5, -0.012);
    face(black, -0.40, 0.40, 0.27, 0.31, -0.5, -0.012);
    face(black, -0.20, 0.20, 0.26, 0.35, 0.5, 0.012);
  }

  CarShape shape_;
  Mesh mesh_;
  uint32_t parts_ = 0;
};

}  // namespace

Mesh make_car(const CarShape& shape) { return CarBuilder(shape).build(); }

}  // namespace sextant::synthetic
