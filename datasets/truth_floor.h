#pragma once

// How good the camera's true steps are across the way and in rotation, where a data set allows to compute it, RMS over
// the sequence (KITTI: kitti_heading.h). Along the way: SequenceTruth::camera_step_floor_m.

#include <map>
#include <optional>
#include <string>

#include <Eigen/Core>

namespace sextant {

class Sequence;

struct TruthFloor {
  std::optional<double> lateral_m;            ///< of the steps across the heading
  std::optional<double> rotation_deg;         ///< of the steps' rotations: not more than that
  std::optional<double> rotation_timing_deg;  ///< the same: not less than that
  std::optional<Eigen::Vector3d> gyro_deg;    ///< mean absolute difference to the turn rates: roll, pitch, yaw

  /// Those that are known under their metric keys (metrics/definitions.h).
  std::map<std::string, double> numbers() const;
};

/// A sequence that knows how accurate its truth is.
class KnowsTruthFloor {
 public:
  virtual const TruthFloor& floor() const = 0;

 protected:
  ~KnowsTruthFloor() = default;
};

/// Nothing of sequences that do not know it.
TruthFloor truth_floor(const Sequence& sequence);

}  // namespace sextant
