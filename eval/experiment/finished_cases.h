#pragma once

// Cases of an unfinished sweep that keeps summaries, moved out of its journal: when that has grown to some size, its cases
// become a file of summaries, whose noise is summed and which is half as large, and the journal begins anew. At the end the
// files are joined like shards.
//
//   DIR/.finished/OWNER/000001.bin   summary.bin (records/case_summary.h) of some cases; OWNER is who owns the journal
//
// A file is there as a whole or not at all. One that was damaged is passed over, and its cases are done again.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/records/journal.h"

namespace sextant {

class FinishedCases {
 public:
  /// Finds those of `owner`, or of any owner; nothing is changed.
  FinishedCases(const std::filesystem::path& folder, const std::string& owner, bool of_any = false);

  bool contains(uint64_t number) const { return number < is_there_.size() && is_there_[number]; }
  uint64_t n_cases() const { return n_cases_; }
  std::vector<std::unique_ptr<CaseResultReader>> readers() const;

  /// Makes the journal's cases a file and empties the journal. Throws Error when the disk is full; the journal then is as
  /// before.
  void take_from(Journal& journal, const NoiseOfCases& noise);

  /// How many cases a folder has in such files, whoever owns them.
  static uint64_t count(const std::filesystem::path& folder);
  /// All of a folder's.
  static void remove(const std::filesystem::path& folder);
  /// Those of other owners.
  void remove_others() const;

 private:
  void mark(uint64_t number);

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> files_;
  std::vector<bool> is_there_;  ///< by number of case
  uint64_t n_cases_ = 0;
};

}  // namespace sextant
