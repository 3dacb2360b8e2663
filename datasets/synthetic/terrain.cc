#include "sextant/datasets/synthetic/street.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

constexpr double cell_m = 3;
constexpr double smooth_m2 = 4;     // smoothing of the weights
constexpr double distances_m = 12;  // distances to the road's edge are exact up to this value

}  // namespace

Terrain::Terrain(const std::vector<Support>& supports, const std::vector<Disc>& road, double margin_m) {
  SEXTANT_CHECK(!supports.empty());
  double x1 = -1e300, z1 = -1e300;
  x0_ = z0_ = 1e300;
  for (const Support& support : supports) {
    x0_ = std::min(x0_, support.place.x() - margin_m);
    x1 = std::max(x1, support.place.x() + margin_m);
    z0_ = std::min(z0_, support.place.z() - margin_m);
    z1 = std::max(z1, support.place.z() + margin_m);
  }
  n_x_ = static_cast<int>((x1 - x0_) / cell_m) + 2;
  n_z_ = static_cast<int>((z1 - z0_) / cell_m) + 2;
  if (static_cast<int64_t>(n_x_) * n_z_ > 4'000'000) {
    fail("street along a path: its terrain has {:.0f} m x {:.0f} m, expected at most 36 km^2", x1 - x0_,
         z1 - z0_);
  }
  nodes_.resize(static_cast<size_t>(n_x_) * n_z_);
  for (const Support& support : supports) {
    visit_near(support.place, margin_m, [&](Node& node, double d2) {
      const double w = support.weight / ((d2 + smooth_m2) * (d2 + smooth_m2));
      node.weight += w;
      node.y += w * support.place.y();
      node.drawn = true;
    });
  }
  for (Node& node : nodes_) {
    if (node.drawn) node.y /= node.weight;
  }
  for (const Disc& disc : road) {
    visit_near(disc.place, disc.radius_m + distances_m, [&](Node& node, double d2) {
      node.edge_m = std::min(node.edge_m, std::sqrt(d2) - disc.radius_m);
    });
  }
}

template <typename Visit>
void Terrain::visit_near(const Vector3d& place, double radius_m, const Visit& visit) {
  const auto index = [](double from, double at, int n) {
    return static_cast<int>(std::clamp((at - from) / cell_m, 0.0, static_cast<double>(n - 1)));
  };
  const int i1 = index(x0_, place.x() + radius_m, n_x_), j1 = index(z0_, place.z() + radius_m, n_z_);
  for (int j = index(z0_, place.z() - radius_m, n_z_); j <= j1; ++j) {
    for (int i = index(x0_, place.x() - radius_m, n_x_); i <= i1; ++i) {
      const double dx = x0_ + i * cell_m - place.x(), dz = z0_ + j * cell_m - place.z();
      const double d2 = dx * dx + dz * dz;
      if (d2 <= radius_m * radius_m) visit(nodes_[static_cast<size_t>(j) * n_x_ + i], d2);
    }
  }
}

Terrain::Corner Terrain::corner(int i, int j) const {
  const Node& node = nodes_[static_cast<size_t>(j) * n_x_ + i];
  return {{x0_ + i * cell_m, node.y, z0_ + j * cell_m}, node.edge_m};
}

double Terrain::height(double x, double z) const {
  const double u = std::clamp((x - x0_) / cell_m, 0.0, n_x_ - 1.001);
  const double v = std::clamp((z - z0_) / cell_m, 0.0, n_z_ - 1.001);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const double a = u - i, b = v - j;
  const double y00 = corner(i, j).at.y(), y11 = corner(i + 1, j + 1).at.y();
  // The two triangles of add_to().
  if (a >= b) return y00 + a * (corner(i + 1, j).at.y() - y00) + b * (y11 - corner(i + 1, j).at.y());
  return y00 + b * (corner(i, j + 1).at.y() - y00) + a * (y11 - corner(i, j + 1).at.y());
}

void Terrain::add_to(Mesh& mesh, double pavement_m) const {
  const auto first = static_cast<uint32_t>(mesh.patches.size());
  for (const Look& look : {Look{Material::asphalt, {0.34F, 0.34F, 0.35F}, 101, 0},
                           Look{Material::plaster, {0.55F, 0.54F, 0.52F}, 102, 0},
                           Look{Material::paving, {0.52F, 0.50F, 0.47F}, 104, 0},
                           Look{Material::grass, {0.30F, 0.36F, 0.20F}, 103, 0}}) {
    mesh.patches.push_back({look, Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitZ()});
  }
  const std::vector<double> bands = {-1e9, 0, 0.2, pavement_m, 1e9};
  for (int j = 0; j + 1 < n_z_; ++j) {
    for (int i = 0; i + 1 < n_x_; ++i) {
      const auto drawn = [&](int di, int dj) {
        return nodes_[static_cast<size_t>(j + dj) * n_x_ + i + di].drawn;
      };
      if (!drawn(0, 0) || !drawn(1, 0) || !drawn(0, 1) || !drawn(1, 1)) continue;
      add_triangle({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)}, bands, first, mesh);
      add_triangle({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)}, bands, first, mesh);
    }
  }
}

void Terrain::add_triangle(const std::vector<Corner>& corners, const std::vector<double>& bands,
                           uint32_t first_patch, Mesh& mesh) const {
  // Returns the part of a convex polygon on one side of edge_m = limit (Sutherland and Hodgman).
  const auto clip = [](const std::vector<Corner>& polygon, double limit, double sign) {
    std::vector<Corner> kept;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Corner& a = polygon[i];
      const Corner& b = polygon[(i + 1) % polygon.size()];
      const double fa = sign * (a.edge_m - limit), fb = sign * (b.edge_m - limit);
      if (fa >= 0) kept.push_back(a);
      if ((fa < 0) == (fb < 0) || fa == 0 || fb == 0) continue;
      const double t = fa / (fa - fb);
      kept.push_back({a.at + t * (b.at - a.at), limit});
    }
    return kept;
  };
  for (size_t band = 0; band + 1 < bands.size(); ++band) {
    const std::vector<Corner> part = clip(clip(corners, bands[band], 1.0), bands[band + 1], -1.0);
    if (part.size() < 3) continue;
    // As triangles; those too thin to have a normal have no area.
    for (size_t i = 1; i + 1 < part.size(); ++i) {
      const Vector3d cross = (part[i].at - part[0].at).cross(part[i + 1].at - part[0].at);
      if (cross.norm() < 1e-7) continue;
      mesh.add_fan({part[0].at, part[i].at, part[i + 1].at}, first_patch + static_cast<uint32_t>(band));
    }
  }
}

}  // namespace sextant::synthetic
