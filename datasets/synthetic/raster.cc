#include "sextant/datasets/synthetic/raster.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant::synthetic {

using Eigen::Vector3d;

namespace {

#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Eight pixels at a time where the processor can; the same numbers either way.
#define SEXTANT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define SEXTANT_WIDE
#endif

/// One row of a triangle: the nearer of what is there and its own surface.
SEXTANT_WIDE void fill(float* __restrict depth, uint32_t* __restrict surface, int n, float start, float step,
                       uint32_t own) {
  for (int i = 0; i < n; ++i) {
    const float inverse = start + step * static_cast<float>(i);
    const bool nearer = inverse > depth[i];
    depth[i] = nearer ? inverse : depth[i];
    surface[i] = nearer ? own : surface[i];
  }
}

}  // namespace

Bodies::Bodies(std::vector<Mesh> meshes) : meshes_(std::move(meshes)) {
  SEXTANT_CHECK(meshes_.size() < 65536);
  uint32_t next = 0;
  for (size_t body = 0; body < meshes_.size(); ++body) {
    first_surface_.push_back(next);
    next += static_cast<uint32_t>(meshes_[body].triangles.size());
    body_of_.resize(next, static_cast<uint16_t>(body));
  }
  first_surface_.push_back(next);
}

Surfaces::Surfaces(const Bodies& bodies, std::span<const std::optional<SE3>> T_camera_body,
                   const PinholeCamera& camera, int width, int height)
    : camera_(camera), width_(width), height_(height), planes_(bodies.n_surfaces()) {
  SEXTANT_CHECK(T_camera_body.size() == bodies.size());
  for (size_t body = 0; body < bodies.size(); ++body) {
    if (T_camera_body[body]) add_body(bodies, body, *T_camera_body[body]);
  }
}

void Surfaces::add_body(const Bodies& bodies, size_t body, const SE3& T_camera_body) {
  const Mesh& mesh = bodies.mesh(body);
  const Eigen::Matrix3d R = T_camera_body.rotation().toRotationMatrix();
  const Vector3d& t = T_camera_body.translation();
  std::vector<Vector3d> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const Vector3d& vertex : mesh.vertices) vertices.emplace_back(R * vertex + t);
  uint32_t surface = bodies.first_surface(body);
  for (const Triangle& triangle : mesh.triangles) {
    add_triangle(
        {vertices[triangle.vertices[0]], vertices[triangle.vertices[1]], vertices[triangle.vertices[2]]},
        R * triangle.normal, surface++);
  }
}

void Surfaces::add_triangle(const std::array<Vector3d, 3>& corners, const Vector3d& normal,
                            uint32_t surface) {
  constexpr double kNear_m = 0.05;
  const auto [nearest_m, farthest_m] = std::minmax({corners[0].z(), corners[1].z(), corners[2].z()});
  if (farthest_m < kNear_m) return;
  int y0 = 0, y1 = height_ - 1;
  if (nearest_m > kNear_m) {
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (const Vector3d& corner : corners) {
      const double x = camera_.fx * corner.x() / corner.z() + camera_.cx;
      const double y = camera_.fy * corner.y() / corner.z() + camera_.cy;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
    // Half a pixel more, for samples off the pixels' centres.
    if (right < -1 || left > width_ || bottom < -1 || top > height_) return;
    y0 = std::max(0, static_cast<int>(std::floor(std::max(top, -1.0) - 0.5)));
    y1 = std::min(height_ - 1, static_cast<int>(std::ceil(std::min(bottom, height_ + 1.0) + 0.5)));
  }
  const double distance = normal.dot(corners[0]);
  const double determinant = corners[0].dot(corners[1].cross(corners[2]));
  if (determinant == 0 || distance == 0) return;  // seen edge-on
  planes_[surface] = {normal, distance, std::max(nearest_m, kNear_m), farthest_m};
  const auto in_pixels = [&](const Vector3d& n) {
    return Vector3d(n.x() / camera_.fx, n.y() / camera_.fy,
                    n.z() - n.x() * camera_.cx / camera_.fx - n.y() * camera_.cy / camera_.fy);
  };
  const double sign = determinant > 0 ? 1.0 : -1.0;
  Scan scan;
  for (int i = 0; i < 3; ++i) {
    const Vector3d& a = corners[(i + 1) % 3];
    const Vector3d& b = corners[(i + 2) % 3];
    const Vector3d edge = sign * in_pixels(a.cross(b));
    scan.edges[i] = std::abs(edge.x()) < 1e-200
                        ? Edge{edge.y(), edge.z(), 0}
                        : Edge{-edge.y() / edge.x(), -edge.z() / edge.x(), edge.x() > 0 ? 1 : -1};
  }
  scan.inverse_depth = in_pixels(normal / distance);
  scan.surface = surface;
  scan.y0 = y0;
  scan.y1 = y1;
  scans_.push_back(scan);
}

Image<uint32_t> Surfaces::seen(double dx, double dy) const {
  Image<uint32_t> surfaces(width_, height_, Bodies::kSky);
  Image<float> nearest(width_, height_, 0.0F);  // 1 / m
  for (const Scan& scan : scans_) {
    for (int y = scan.y0; y <= scan.y1; ++y) {
      double from = 0, to = width_ - 1;
      bool outside = false;
      for (const Edge& edge : scan.edges) {
        const double at = edge.slope * (y + dy) + edge.offset;
        if (edge.side > 0) {
          from = std::max(from, at - dx);
        } else if (edge.side < 0) {
          to = std::min(to, at - dx);
        } else {
          outside |= at < 0;
        }
      }
      if (outside || from > to) continue;
      const int x0 = static_cast<int>(std::ceil(from)), x1 = static_cast<int>(to);
      const int n = x1 - x0 + 1;
      const auto start = static_cast<float>(scan.inverse_depth.x() * (x0 + dx) +
                                            scan.inverse_depth.y() * (y + dy) + scan.inverse_depth.z());
      const auto step = static_cast<float>(scan.inverse_depth.x());
      float* depth = nearest.row(y) + x0;
      uint32_t* surface = surfaces.row(y) + x0;
      fill(depth, surface, n, start, step, scan.surface);
    }
  }
  return surfaces;
}

}  // namespace sextant::synthetic
