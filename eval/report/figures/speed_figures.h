#pragma once

// (ours) Speed of every object over the frames of a source: estimates, truth, and around the truth a band as
// wide as its own error (the ground-truth floor). One figure per dataset and sequence, of the records of its
// lowest seed; up to six objects, those with the most estimates, of at least five.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// `floor_kmh`: by sequence, how far the true speed is off (RMS); sequences that are not in it have no band.
std::vector<Figure> speed_figures(const std::vector<Record>& records,
                                  const std::map<std::string, double>& floor_kmh);

/// Of records that say values.step_floor_m (recorded trajectories): 3.6 floor / dt at KITTI's 10 Hz.
std::map<std::string, double> kitti_speed_floor_kmh(const std::vector<Record>& records);

}  // namespace sextant
