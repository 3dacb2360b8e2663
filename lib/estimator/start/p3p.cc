#include "sextant/estimator/start/p3p.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

/// A real root m >= 0 of 8 m^3 + 8 p m^2 + (2 p^2 - 8 r) m - q^2, the largest one.
double resolvent_root(double p, double q, double r) {
  // m^3 + b m^2 + c m + d, shifted to w^3 + e w + f.
  const double b = p;
  const double c = 0.25 * p * p - r;
  const double d = -0.125 * q * q;
  const double e = c - b * b / 3;
  const double f = 2 * b * b * b / 27 - b * c / 3 + d;
  const double discriminant = 0.25 * f * f + e * e * e / 27;
  double w = 0;
  if (discriminant > 0) {
    const double u = std::cbrt(std::abs(0.5 * f) + std::sqrt(discriminant)) * (f > 0 ? -1 : 1);
    w = u - (u == 0 ? 0 : e / (3 * u));
  } else {
    const double radius = std::sqrt(std::max(-e / 3, 0.0));
    const double cosine = radius > 0 ? std::clamp(-0.5 * f / (radius * radius * radius), -1.0, 1.0) : 0;
    w = 2 * radius * std::cos(std::acos(cosine) / 3);
  }
  return std::max(w - b / 3, 0.0);
}

}  // namespace

std::array<double, 4> quartic_roots(const std::array<double, 4>& a) {
  // x = y - a0 / 4: y^4 + p y^2 + q y + r = (y^2 + p / 2 + m)^2 - 2 m (y - q / (4 m))^2.
  const double shift = 0.25 * a[0];
  const double s2 = shift * shift;
  const double p = a[1] - 6 * s2;
  const double q = a[2] - 2 * a[1] * shift + 8 * s2 * shift;
  const double r = a[3] - a[2] * shift + a[1] * s2 - 3 * s2 * s2;
  const double m = resolvent_root(p, q, r);
  const double g = std::sqrt(2 * m);
  // Without m there is no q either, and the quartic is one in y^2.
  const double h = g > 0 ? q / (2 * g) : std::sqrt(std::max(0.25 * p * p - r, 0.0));
  std::array<double, 4> roots;
  for (const int sign : {-1, 1}) {
    // y^2 + sign g y + p / 2 + m - sign h = 0
    const double quarter = 0.25 * g * g - (0.5 * p + m - sign * h);
    const double root = std::sqrt(std::max(quarter, 0.0));
    roots[1 + sign] = -0.5 * sign * g - shift + root;
    roots[2 + sign] = -0.5 * sign * g - shift - root;
  }
  for (double& x : roots) {
    for (int step = 0; step < 2; ++step) {
      const double value = (((x + a[0]) * x + a[1]) * x + a[2]) * x + a[3];
      const double slope = ((4 * x + 3 * a[0]) * x + 2 * a[1]) * x + a[2];
      const double next = x - value / slope;
      if (std::isfinite(next) && std::abs(next - x) < 0.1) x = next;
    }
  }
  return roots;
}

P3PSolutions::P3PSolutions(const std::array<Eigen::Vector3d, 3>& points,
                           const std::array<Eigen::Vector3d, 3>& rays) {
  using Eigen::Vector3d;
  const Vector3d& b1 = rays[0];
  const Vector3d& b2 = rays[1];
  const Vector3d& b3 = rays[2];
  // Frames of the first edge and of the plane of the first two rays.
  const Vector3d edge = points[0] - points[1];
  const double length = edge.norm();
  const Vector3d k1 = edge / length;
  const Vector3d normal = b1.cross(b2);
  const double sine = normal.norm();
  const Vector3d k3 = normal / sine;
  const Vector3d tz = b1.cross(k3);
  const Vector3d u1 = points[0] - points[2];
  const Vector3d across = u1.cross(k1);
  const double delta = across.norm();
  const Vector3d nl = across / delta;
  const double k3b3 = k3.dot(b3);

  const Vector3d v1 = b1.cross(b3);
  const Vector3d v2 = b2.cross(b3);
  const double along1 = u1.dot(k1);
  const double along2 = along1 - length;
  const double f11 = delta * k3b3;
  const double f13 = delta * k3.dot(v1);
  const double f15 = -along1 * k3b3;
  const double f21 = delta * tz.dot(v2);
  const double f22 = delta * sine * k3b3;
  const double f23 = delta * k3.dot(v2);
  const double f24 = along2 * sine * k3b3;
  const double f25 = -along2 * tz.dot(v2);
  const double g1 = f13 * f22;
  const double g2 = f13 * f25 - f15 * f23;
  const double g3 = f11 * f23 - f13 * f21;
  const double g4 = -f13 * f24;
  const double g5 = f11 * f22;
  const double g6 = f11 * f25 - f15 * f21;
  const double g7 = -f15 * f24;
  const double lead = g5 * g5 + g1 * g1 + g3 * g3;
  const std::array<double, 4> coefficients = {
      2 * (g5 * g6 + g1 * g2 + g3 * g4) / lead,
      (g6 * g6 + 2 * g5 * g7 + g2 * g2 + g4 * g4 - g1 * g1 - g3 * g3) / lead,
      2 * (g6 * g7 - g1 * g2 - g3 * g4) / lead, (g7 * g7 - g2 * g2 - g4 * g4) / lead};
  for (const double coefficient : coefficients) {
    if (!std::isfinite(coefficient)) return;
  }

  Eigen::Matrix3d from_edge;
  from_edge << k1, nl, k1.cross(nl);
  Eigen::Matrix3d from_rays;
  from_rays << b1, k3, tz;
  for (const double cos1 : quartic_roots(coefficients)) {
    if (!(std::abs(cos1) <= 1)) continue;
    const double sin1 = std::copysign(std::sqrt(1 - cos1 * cos1), k3b3);
    const double scale = sin1 / ((g5 * cos1 + g6) * cos1 + g7);
    const double cos3 = scale * (g1 * cos1 + g2);
    const double sin3 = scale * (g3 * cos1 + g4);
    Eigen::Matrix3d turn;
    turn << cos3, 0, -sin3, sin1 * sin3, cos1, sin1 * cos3, cos1 * sin3, -sin1, cos1 * cos3;
    const Eigen::Matrix3d R = (from_edge * turn * from_rays.transpose()).transpose();
    const Vector3d t = (delta / k3b3 * sin1) * b3 - R * points[2];
    if (!R.allFinite() || !t.allFinite()) continue;
    motions_[size_++] = SE3(Eigen::Quaterniond(R), t);
  }
}

}  // namespace sextant
