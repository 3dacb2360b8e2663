#pragma once

// Evidence of a reproduction: the records of its experiments and the paper's published numbers. Tables and
// claims depend on nothing else, so that equal evidence gives an equal report.

#include <initializer_list>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/paper.h"

namespace sextant {

/// Purpose of an experiment; tables select records by it.
enum class PartRole {
  sets,         ///< the paper's three sets, our estimators
  sets_paper,   ///< the three sets by the paper's procedures (eval/procedures)
  attribution,  ///< the three sets, one decision at a time from the published code's procedure to ours
  noise,
  noise_correlated,  ///< independent and correlated noise of the same size
  classification,
  real,
  recorded,          ///< camera trajectories of other systems
  recorded_objects,  ///< object logs of other systems
  timing,
  showcase,
  systems,        ///< published systems and ours in one run
  systems_noise,  ///< published systems, for the figures of `noise`
};

/// Records of one experiment.
struct EvidencePart {
  std::string name;  ///< its folder below parts/
  PartRole role = PartRole::sets;
  NoiseSweep sweep;
  std::vector<Record> records;
};

struct Evidence {
  std::vector<EvidencePart> parts;
  Json published = Json::object();  ///< Paper::published; empty: nothing is compared with the paper

  /// Returns the experiments with these roles, in order of the roles.
  std::vector<const EvidencePart*> with(std::initializer_list<PartRole> roles) const {
    std::vector<const EvidencePart*> found;
    for (const PartRole role : roles) {
      for (const EvidencePart& part : parts) {
        if (part.role == role) found.push_back(&part);
      }
    }
    return found;
  }
  std::vector<const EvidencePart*> with(PartRole role) const {
    return with(std::initializer_list<PartRole>{role});
  }
};

}  // namespace sextant
