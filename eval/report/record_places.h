#pragma once

// Where in the files of records the rows of a table come from: for links from a page to what is behind a row.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_level.h"

namespace sextant {

/// The records of one row: how many, and the one with the largest E_t.
struct RowRecords {
  std::filesystem::path file;
  size_t n = 0;
  size_t worst_line = 0;  ///< from 1; 0: none of them has E_t
  uint64_t worst_seed = 0;
  int worst_frame = 0;
  double worst_Et_m = 0;

  /// "80; largest E_t: seed 3, frame 130, line 512".
  std::string text() const;
};

/// Of the records with truth in FOLDER/records.jsonl, folder by folder; those that kept summaries have none.
std::map<NoiseLevelKey, RowRecords> record_places(const std::vector<std::filesystem::path>& folders);

/// The address of a file on a page in `page_folder`: relative, so that both can be moved together.
std::string address_from(const std::filesystem::path& page_folder, const std::filesystem::path& file);

}  // namespace sextant
