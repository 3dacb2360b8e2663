#pragma once

// What lines a street: houses, trees and lamp posts, each drawn from the next random numbers of one seed.

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

inline constexpr double kerb_m = 0.14;  ///< height of a pavement over the road

class Furnisher {
 public:
  explicit Furnisher(uint32_t seed) : seed_(seed) {}

  uint32_t next_seed() { return hash3(seed_, 77, ++things_); }
  /// Uniform in [low, high), of the next thing.
  double draw(double low, double high) { return low + (high - low) * (next_seed() * 0x1p-32); }

  double house_height_m();
  /// Between two corners on the ground (y of `low`), with sides along x and z; walls reach `below_m` into the
  /// ground.
  void house(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double height_m, double below_m = 0);
  void tree(const Eigen::Vector3d& foot);
  /// Lamp post; its arm reaches along +x or -x.
  void post(const Eigen::Vector3d& foot, double arm_sign);

  Mesh mesh;

 private:
  uint32_t seed_;
  uint32_t things_ = 0;
};

}  // namespace sextant::synthetic
