#include "sextant/datasets/synthetic/mesh.h"

#include <cmath>
#include <map>
#include <numbers>

#include "sextant/base/error.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

struct Icosphere {
  std::vector<Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
};

Icosphere icosahedron() {
  const double g = std::numbers::phi;
  Icosphere ball;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-g, g}) {
      ball.vertices.push_back(Vector3d(0, a, b).normalized());
      ball.vertices.push_back(Vector3d(a, b, 0).normalized());
      ball.vertices.push_back(Vector3d(b, 0, a).normalized());
    }
  }
  // The faces are the triples of mutually nearest vertices.
  const double edge = 2.0 / std::sqrt(g * g + 1.0);
  const auto near = [&](uint32_t i, uint32_t j) {
    return (ball.vertices[i] - ball.vertices[j]).norm() < 1.01 * edge;
  };
  for (uint32_t i = 0; i < 12; ++i) {
    for (uint32_t j = i + 1; j < 12; ++j) {
      for (uint32_t k = j + 1; k < 12; ++k) {
        if (near(i, j) && near(j, k) && near(i, k)) ball.faces.push_back({i, j, k});
      }
    }
  }
  return ball;
}

Icosphere subdivided(const Icosphere& ball) {
  Icosphere finer;
  finer.vertices = ball.vertices;
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
  const auto middle = [&](uint32_t a, uint32_t b) {
    const auto [it, is_new] =
        middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(finer.vertices.size()));
    if (is_new) finer.vertices.push_back((ball.vertices[a] + ball.vertices[b]).normalized());
    return it->second;
  };
  for (const auto& [a, b, c] : ball.faces) {
    const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const auto& face : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) {
      finer.faces.push_back(face);
    }
  }
  return finer;
}

}  // namespace

uint32_t hash3(uint32_t a, uint32_t b, uint32_t c) {
  uint32_t h = a * 0x9e3779b1U ^ b * 0x85ebca77U ^ c * 0xc2b2ae3dU;
  h = (h ^ (h >> 15)) * 0x2c1b3c6dU;
  h = (h ^ (h >> 12)) * 0x297a2d39U;
  return h ^ (h >> 15);
}

double random01(uint32_t a, uint32_t b, uint32_t c) { return hash3(a, b, c) * 0x1p-32; }

void Mesh::add_fan(const std::vector<Vector3d>& points, uint32_t patch) {
  const auto first = static_cast<uint32_t>(vertices.size());
  vertices.insert(vertices.end(), points.begin(), points.end());
  for (uint32_t i = 1; i + 1 < points.size(); ++i) {
    const Vector3d cross = (points[i] - points[0]).cross(points[i + 1] - points[0]);
    SEXTANT_CHECK(cross.norm() > 1e-9);
    triangles.push_back({{first, first + i, first + i + 1}, cross.normalized(), patch});
  }
}

void Mesh::add_polygon(const Look& look, const std::vector<Vector3d>& points) {
  const Vector3d u_axis = (points[1] - points[0]).normalized();
  const Vector3d normal = u_axis.cross(points[2] - points[0]).normalized();
  add_polygon(look, points, points[0], u_axis, normal.cross(u_axis));
}

void Mesh::add_polygon(const Look& look, const std::vector<Vector3d>& points, const Vector3d& origin,
                       const Vector3d& u_axis, const Vector3d& v_axis) {
  patches.push_back({look, origin, u_axis, v_axis});
  add_fan(points, static_cast<uint32_t>(patches.size() - 1));
}

void Mesh::add_box(const Look& sides, const Look& top, const Vector3d& low, const Vector3d& high) {
  const auto corner = [&](int x, int y, int z) {
    return Vector3d(x ? high.x() : low.x(), y ? high.y() : low.y(), z ? high.z() : low.z());
  };
  const Vector3d up(0, -1, 0);
  const auto side = [&](int x0, int z0, int x1, int z1) {
    // y = 1 is the bottom, because y points down
    const Vector3d a = corner(x0, 1, z0), b = corner(x1, 1, z1);
    add_polygon(sides, {a, b, corner(x1, 0, z1), corner(x0, 0, z0)}, a, (b - a).normalized(), up);
  };
  side(0, 0, 1, 0);
  side(1, 0, 1, 1);
  side(1, 1, 0, 1);
  side(0, 1, 0, 0);
  add_polygon(top, {corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1)}, Vector3d::Zero(),
              Vector3d::UnitX(), Vector3d::UnitZ());
}

void Mesh::add_tube(const Look& look, const Vector3d& from, const Vector3d& to, double radius_from_m,
                    double radius_to_m, int sides) {
  const Vector3d axis = (to - from).normalized();
  const Vector3d x = axis.unitOrthogonal();
  const Vector3d y = axis.cross(x);
  const auto spoke = [&](int i) -> Vector3d {
    const double angle = 2 * std::numbers::pi * (i % sides) / sides;
    return std::cos(angle) * x + std::sin(angle) * y;
  };
  for (int i = 0; i < sides; ++i) {
    const Vector3d a = spoke(i), b = spoke(i + 1);
    Look facet = look;
    facet.seed = hash3(look.seed, 7, static_cast<uint32_t>(i));
    add_polygon(facet, {from + radius_from_m * a, from + radius_from_m * b, to + radius_to_m * b,
                        to + radius_to_m * a});
  }
}

void Mesh::add_blob(const Look& look, const Vector3d& centre, const Vector3d& radii_m) {
  static const Icosphere ball = subdivided(subdivided(icosahedron()));
  std::vector<Vector3d> lumpy;
  for (uint32_t i = 0; i < ball.vertices.size(); ++i) {
    const double bulge = 0.82 + 0.36 * random01(look.seed, i, 11);
    lumpy.push_back(centre + bulge * ball.vertices[i].cwiseProduct(radii_m));
  }
  std::map<int, uint32_t> patch_of_axis;
  for (const auto& [a, b, c] : ball.faces) {
    const std::vector<Vector3d> points = {lumpy[a], lumpy[b], lumpy[c]};
    const Vector3d normal = (points[1] - points[0]).cross(points[2] - points[0]).normalized();
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const auto [it, is_new] = patch_of_axis.try_emplace(axis, static_cast<uint32_t>(patches.size()));
    // The texture runs along the two axes that are most parallel to the faces.
    if (is_new)
      patches.push_back({look, centre, Vector3d::Unit((axis + 1) % 3), Vector3d::Unit((axis + 2) % 3)});
    add_fan(points, it->second);
  }
}

void Mesh::append(const Mesh& other, const SE3& T_this_b) {
  const auto first_vertex = static_cast<uint32_t>(vertices.size());
  const auto first_patch = static_cast<uint32_t>(patches.size());
  for (const Vector3d& vertex : other.vertices) vertices.push_back(T_this_b * vertex);
  for (Triangle triangle : other.triangles) {
    for (uint32_t& vertex : triangle.vertices) vertex += first_vertex;
    triangle.normal = T_this_b.rotation() * triangle.normal;
    triangle.patch += first_patch;
    triangles.push_back(triangle);
  }
  for (Patch patch : other.patches) {
    patch.origin = T_this_b * patch.origin;
    patch.u_axis = T_this_b.rotation() * patch.u_axis;
    patch.v_axis = T_this_b.rotation() * patch.v_axis;
    patches.push_back(patch);
  }
}

namespace {

using Eigen::Vector3d;

/// A cross-section of the body: heights above ground and half widths, as shares of the car's size.
struct Station {
  double z;       ///< -0.5 rear .. 0.5 front, of the length
  double bottom;  ///< share of the height
  double belt;    ///< share of the height at which the body ends and glass begins
  double half;    ///< share of the width, at the belt
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

  /// Adds a panel whose texture runs along the car and upwards.
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
    const double waist = 0.38;  // height of the widest part; below, the side bends inwards
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

  /// Adds two triangles with a side texture; the four corners need not be coplanar, because stations differ.
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
      // Two side windows, slightly outside their frame.
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
