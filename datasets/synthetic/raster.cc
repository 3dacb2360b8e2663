#include "sextant/datasets/synthetic/raster.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/datasets/synthetic/wide.h"

namespace sextant::synthetic {

using Eigen::Vector3d;

namespace {

/// First and last columns of the rows of a triangle.
constexpr int band_rows = 64;
struct Columns {
  double from[band_rows], to[band_rows];
  int32_t first[band_rows], last[band_rows];
};

/// Computes the columns for samples at (x + dx, y + dy), for `n` rows from y0 on.
SEXTANT_INLINED void find_columns(const Surfaces::Scan& scan, int width, int y0, int n, double dx, double dy,
                                  Columns& c) {
  for (int k = 0; k < n; ++k) {
    c.from[k] = 0;
    c.to[k] = width - 1;
  }
  for (const Surfaces::Edge& edge : scan.edges) {
    const double slope = edge.slope, offset = edge.offset;
    if (edge.side > 0) {
      for (int k = 0; k < n; ++k) {
        const double x = slope * (y0 + k + dy) + offset - dx;
        c.from[k] = x > c.from[k] ? x : c.from[k];
      }
    } else if (edge.side < 0) {
      for (int k = 0; k < n; ++k) {
        const double x = slope * (y0 + k + dy) + offset - dx;
        c.to[k] = x < c.to[k] ? x : c.to[k];
      }
    } else {
      for (int k = 0; k < n; ++k) c.to[k] = slope * (y0 + k + dy) + offset < 0 ? -1.0 : c.to[k];
    }
  }
  for (int k = 0; k < n; ++k) {
    // Afterwards from is in [0, width] and to in [-1, width]: both fit into integers, and truncation rounds
    // down.
    const double from = c.from[k] < width ? c.from[k] : width;
    const double to = c.to[k] > -1 ? c.to[k] + 1 : 0;
    const auto down = static_cast<int32_t>(from);
    c.first[k] = down + (down < from ? 1 : 0);
    c.last[k] = static_cast<int32_t>(to) - 1;
  }
}

/// Calls row(y, first, last) for the rows with samples at (x + dx, y + dy) inside the triangle.
template <typename Row>
SEXTANT_INLINED void each_row(const Surfaces::Scan& scan, int width, int height, double dx, double dy,
                              const Row& row) {
  constexpr double margin_px = 1e-4;  // projected corners and edges are rounded differently
  const int y0 = std::max(0, static_cast<int>(std::ceil(scan.top - dy - margin_px)));
  const int y1 = std::min(height - 1, static_cast<int>(std::floor(scan.bottom - dy + margin_px)));
  Columns c;
  for (int y = y0; y <= y1; y += band_rows) {
    const int n = std::min(band_rows, y1 - y + 1);
    find_columns(scan, width, y, n, dx, dy, c);
    for (int k = 0; k < n; ++k) {
      if (c.first[k] <= c.last[k]) row(y + k, c.first[k], c.last[k]);
    }
  }
}

/// Updates the z-buffer with the triangle.
SEXTANT_SIMD void fill(const Surfaces::Scan& scan, int width, int height, float* nearest,
                       uint32_t* surfaces) {
  const std::array<double, 3> inverse = scan.inverse_depth;
  const auto step = static_cast<float>(inverse[0]);
  const uint32_t own = scan.surface;
  each_row(scan, width, height, 0, 0, [&](int y, int first, int last) {
    const auto start = static_cast<float>(inverse[0] * first + inverse[1] * y + inverse[2]);
    float* __restrict depth = nearest + static_cast<ptrdiff_t>(y) * width + first;
    uint32_t* __restrict surface = surfaces + static_cast<ptrdiff_t>(y) * width + first;
    for (int i = 0; i <= last - first; ++i) {
      const float here = start + step * static_cast<float>(i);
      const bool nearer = here > depth[i];
      depth[i] = nearer ? here : depth[i];
      surface[i] = nearer ? own : surface[i];
    }
  });
}

/// Updates the z-buffer with the triangle at samples (x + dx, y + dy) of the pixels in `spots` only.
SEXTANT_SIMD void fill_at(const Surfaces::Scan& scan, int width, int height, double dx, double dy,
                          const Spots& spots, float* nearest, uint32_t* surfaces) {
  const std::array<double, 3> inverse = scan.inverse_depth;
  const auto step = static_cast<float>(inverse[0]);
  const uint32_t own = scan.surface;
  each_row(scan, width, height, dx, dy, [&](int y, int first, int last) {
    const int before = spots.before(first, y), n = spots.before(last + 1, y) - before;
    if (n == 0) return;
    const auto start = static_cast<float>(inverse[0] * dx + inverse[1] * (y + dy) + inverse[2]);
    const size_t at = spots.first(y) + before;
    const float* __restrict x = spots.x().data() + at;
    float* __restrict depth = nearest + at;
    uint32_t* __restrict surface = surfaces + at;
    for (int i = 0; i < n; ++i) {
      const float here = start + step * x[i];
      const bool nearer = here > depth[i];
      depth[i] = nearer ? here : depth[i];
      surface[i] = nearer ? own : surface[i];
    }
  });
}

}  // namespace

Bodies::Bodies(std::vector<Mesh> meshes) : meshes_(std::move(meshes)) {
  SEXTANT_CHECK(meshes_.size() < 65536);
  uint32_t next = 0;
  for (size_t body = 0; body < meshes_.size(); ++body) {
    first_surface_.push_back(next);
    next += static_cast<uint32_t>(meshes_[body].triangles.size());
    body_of_.resize(next, static_cast<uint16_t>(body));
    for (const Triangle& triangle : meshes_[body].triangles) {
      patches_.push_back(&meshes_[body].patches[triangle.patch]);
    }
  }
  first_surface_.push_back(next);
}

Surfaces::Surfaces(const Bodies& bodies, std::span<const std::optional<SE3>> T_camera_body,
                   const PinholeCamera& camera, int width, int height)
    : camera_(camera), width_(width), height_(height), planes_(bodies.n_surfaces()) {
  SEXTANT_CHECK(T_camera_body.size() == bodies.size());
  scans_.reserve(bodies.n_surfaces());
  for (size_t body = 0; body < bodies.size(); ++body) {
    if (T_camera_body[body]) add_body(bodies, body, *T_camera_body[body]);
  }
}

void Surfaces::add_body(const Bodies& bodies, size_t body, const SE3& T_camera_body) {
  const Mesh& mesh = bodies.mesh(body);
  const Eigen::Matrix3d R = T_camera_body.rotation().toRotationMatrix();
  const Vector3d& t = T_camera_body.translation();
  const auto moved = [&](uint32_t vertex) -> Vector3d { return R * mesh.vertices[vertex] + t; };
  uint32_t surface = bodies.first_surface(body);
  for (const Triangle& triangle : mesh.triangles) {
    const auto& [a, b, c] = triangle.vertices;
    add_triangle({moved(a), moved(b), moved(c)}, R * triangle.normal, surface++);
  }
}

void Surfaces::add_triangle(const std::array<Vector3d, 3>& corners, const Vector3d& normal,
                            uint32_t surface) {
  constexpr double near_m = 0.05;
  const auto [nearest_m, farthest_m] = std::minmax({corners[0].z(), corners[1].z(), corners[2].z()});
  if (farthest_m < near_m) return;
  Scan scan;
  scan.top = -1;
  scan.bottom = height_;
  if (nearest_m > near_m) {
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (const Vector3d& corner : corners) {
      const double per_z = 1 / corner.z();
      const double x = camera_.fx * corner.x() * per_z + camera_.cx;
      const double y = camera_.fy * corner.y() * per_z + camera_.cy;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
    if (right < -1 || left > width_ || bottom < -1 || top > height_) return;
    scan.top = std::max(top, -1.0);
    scan.bottom = std::min(bottom, height_ + 1.0);
  }
  const double distance = normal.dot(corners[0]);
  const double determinant = corners[0].dot(corners[1].cross(corners[2]));
  if (determinant == 0 || distance == 0) return;  // edge-on
  planes_[surface] = {normal, distance, std::max(nearest_m, near_m), farthest_m};
  const double per_fx = 1 / camera_.fx, per_fy = 1 / camera_.fy;
  const auto in_pixels = [&](const Vector3d& n) {
    const double x = n.x() * per_fx, y = n.y() * per_fy;
    return Vector3d(x, y, n.z() - x * camera_.cx - y * camera_.cy);
  };
  const double sign = determinant > 0 ? 1.0 : -1.0;
  for (int i = 0; i < 3; ++i) {
    const Vector3d& a = corners[(i + 1) % 3];
    const Vector3d& b = corners[(i + 2) % 3];
    const Vector3d edge = sign * in_pixels(a.cross(b));
    scan.edges[i] = std::abs(edge.x()) < 1e-200
                        ? Edge{edge.y(), edge.z(), 0}
                        : Edge{-edge.y() / edge.x(), -edge.z() / edge.x(), edge.x() > 0 ? 1 : -1};
  }
  const Vector3d inverse_depth = in_pixels(normal / distance);
  scan.inverse_depth = {inverse_depth.x(), inverse_depth.y(), inverse_depth.z()};
  scan.surface = surface;
  scans_.push_back(scan);
}

Image<uint32_t> Surfaces::seen() const {
  Image<uint32_t> surfaces(width_, height_, Bodies::sky_surface);
  Image<float> nearest(width_, height_, 0.0F);  // 1 / m
  for (const Scan& scan : scans_) fill(scan, width_, height_, nearest.data(), surfaces.data());
  return surfaces;
}

std::vector<uint32_t> Surfaces::seen_at(const Spots& spots, double dx, double dy) const {
  std::vector<uint32_t> surfaces(spots.size(), Bodies::sky_surface);
  std::vector<float> nearest(spots.size(), 0.0F);  // 1 / m
  for (const Scan& scan : scans_) {
    fill_at(scan, width_, height_, dx, dy, spots, nearest.data(), surfaces.data());
  }
  return surfaces;
}

Spots::Spots(const Image<uint8_t>& marked) : width_(marked.width()) {
  SEXTANT_CHECK(width_ < 65535);
  before_.reserve(static_cast<size_t>(width_ + 1) * marked.height());
  for (int y = 0; y < marked.height(); ++y) {
    const auto first = static_cast<uint32_t>(x_.size());
    first_.push_back(first);
    for (int x = 0; x < width_; ++x) {
      before_.push_back(static_cast<uint16_t>(x_.size() - first));
      if (marked(x, y) != 0) x_.push_back(static_cast<float>(x));
    }
    before_.push_back(static_cast<uint16_t>(x_.size() - first));
  }
  first_.push_back(static_cast<uint32_t>(x_.size()));
}

}  // namespace sextant::synthetic
