#pragma once

// What the tables and claims of the reproduction are made of: the records of its parts and the paper's
// published numbers, and nothing else. Equal evidence, equal report.

#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/paper.h"

namespace sextant {

/// What a part was run for; tables look for their records by it.
enum class PartRole {
  sets,         ///< the paper's three sets, our estimators
  sets_paper,   ///< the same by the paper's procedures (eval/procedures)
  attribution,  ///< the same, one decision at a time from the published code's procedure to ours
  noise,
  noise_correlated,  ///< independent and correlated noise of the same size
  classification,
  real,
  recorded,          ///< camera trajectories of other systems
  recorded_objects,  ///< object logs of other systems
  timing,
  showcase,
  systems,        ///< published systems and ours in one run
  systems_noise,  ///< published systems for the figures of `noise`
};

struct EvidencePart {
  std::string name;  ///< its folder below parts/
  PartRole role = PartRole::sets;
  NoiseSweep sweep;
  std::vector<Record> records;
};

struct Evidence {
  std::vector<EvidencePart> parts;
  Json published = Json::object();  ///< Paper::published; empty: nothing is compared with the paper

  std::vector<const EvidencePart*> with(PartRole role) const {
    std::vector<const EvidencePart*> found;
    for (const EvidencePart& part : parts) {
      if (part.role == role) found.push_back(&part);
    }
    return found;
  }
};

}  // namespace sextant
