#pragma once

// What the reproduction runs: each part is a folder below DIR/parts that is complete or can be resumed.
// How to add one: a plan in eval/plans/reproduce/ and one line in the table of parts.cc.

#include <string>
#include <vector>

#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/report/evidence.h"

namespace sextant {

enum class PartKind {
  sweep,     ///< a plan, from packs
  recorded,  ///< trajectories of other systems against the truth
  timing,    ///< one thread, sources decoded, no packs: run times
  showcase,  ///< a run with paths, and the picture of its last pair
  stored,    ///< results/systems: errors of published systems, measured once (stored.h)
};

struct Part {
  std::string name;
  PartRole role = PartRole::sets;
  PartKind kind = PartKind::sweep;
  std::string title;
  std::string needs;  ///< folder below the data root; empty: comes with the program
  std::string fetch;  ///< how to get it
  std::string plan;   ///< JSON; empty for `recorded` and `stored`
  std::string beside{};  ///< `stored`: the earlier part whose records have the truth of the same frames
};

/// In the order in which they run: what comes with the program first. The text of Virtual KITTI is taken from
/// ROOT/vkitti_1.3.1_text, or from ROOT/vkitti_1.3.1 where only that is there.
std::vector<Part> reproduction_parts(const std::string& data_root);

/// Why a part cannot run with this data; empty when it can.
std::string what_is_missing(const Part& part, const std::string& data_root);

}  // namespace sextant
