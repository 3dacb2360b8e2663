#pragma once

// What the tables and claims of the reproduction are made of: the records of its parts and the paper's
// published numbers, and nothing else. Equal evidence, equal report.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"

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
  recorded,
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
  Json published = Json::object();  ///< results/published/zhang2020.json

  std::vector<const EvidencePart*> with(PartRole role) const;
};

/// The number at this path of the published values; none where the paper prints none. Throws Error where the
/// path does not exist: a misspelt key must not look like a missing value.
std::optional<double> published_number(const Json& table, const std::string& key);

/// "scenario s18", "replay of Virtual KITTI 0018/clone": where a record was measured, for people.
std::string data_title(const std::string& dataset, const std::string& sequence);

/// Records of one body, dataset and sequence, within frames first..last (current frames of pairs).
struct RecordFilter {
  std::string dataset;
  std::string sequence;
  int first_frame = 0;
  int last_frame = 1 << 30;

  bool matches(const Record& record) const;
};

}  // namespace sextant
