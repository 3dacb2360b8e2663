#pragma once

// Records as figures want them: sets of frames, each with its bodies in order.

#include <string>
#include <vector>

#include "sextant/eval/records/record.h"

namespace sextant {

struct BodyRecords {
  std::string title;  ///< "camera", "Obj1"
  std::vector<const Record*> records;
};

struct RecordSet {
  std::string name;   ///< part of file names: "s18"
  std::string title;  ///< "scenario s18"
  std::vector<BodyRecords> bodies;
};

/// One set per dataset and sequence: estimated records with truth, camera first, objects by id. They point
/// into `records`.
std::vector<RecordSet> record_sets(const std::vector<Record>& records);

/// In order of first appearance.
std::vector<std::string> estimators_of(const RecordSet& set);

/// Those of one estimator.
std::vector<const Record*> of_estimator(const std::vector<const Record*>& records,
                                        const std::string& estimator);

}  // namespace sextant
