#include "sextant/datasets/synthetic/furniture.h"

#include <cmath>

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
  // A cornice: it throws a shadow and breaks the outline.
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

}  // namespace sextant::synthetic
