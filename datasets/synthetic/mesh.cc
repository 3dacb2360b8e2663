#include "sextant/datasets/synthetic/mesh.h"

#include <cmath>
#include <map>
#include <numbers>

#include "sextant/base/error.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

/// The two axes that span a plane of this normal best: the texture of a blob.
std::pair<Vector3d, Vector3d> dominant_axes(const Vector3d& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return {Vector3d::Unit((axis + 1) % 3), Vector3d::Unit((axis + 2) % 3)};
}

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
  patches.push_back({look, origin, u_axis, v_axis, false});
  add_fan(points, static_cast<uint32_t>(patches.size() - 1));
}

void Mesh::add_box(const Look& sides, const Look& top, const Vector3d& low, const Vector3d& high) {
  const auto corner = [&](int x, int y, int z) {
    return Vector3d(x ? high.x() : low.x(), y ? high.y() : low.y(), z ? high.z() : low.z());
  };
  const Vector3d up(0, -1, 0);
  const auto side = [&](int x0, int z0, int x1, int z1) {
    const Vector3d a = corner(x0, 1, z0), b = corner(x1, 1, z1);  // y = 1 is the bottom: y points down
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
    if (is_new) {
      const auto [u_axis, v_axis] = dominant_axes(normal);
      patches.push_back({look, centre, u_axis, v_axis, true});
    }
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

}  // namespace sextant::synthetic
