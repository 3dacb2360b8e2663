#pragma once

// Where in the files of records the rows of a table come from: for links from a page to what is behind a row.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// The records of one row: how many, and the one with the largest E_t.
struct RowRecords {
  std::filesystem::path file;
  size_t n = 0;
  size_t worst_line = 0;  ///< from 1; 0: none of them has E_t
  uint64_t worst_seed = 0;
  int worst_frame = 0;
  double worst_Et_m = 0;

  /// One more, which stands in that line.
  void add(const Record& record, size_t line);
  /// Those of another row too; the file is that of the worst.
  void add(const RowRecords& more);
  /// "80; largest E_t: seed 3, frame 130, line 512".
  std::string text() const;
};

using RecordPlaces = std::map<NoiseLevelKey, RowRecords>;
/// Of the records with truth in FOLDER/records.jsonl, folder by folder; those that kept summaries have none.
RecordPlaces record_places(const std::vector<std::filesystem::path>& folders);

/// The same of records that will be the lines of `file`.
RecordPlaces record_places(const std::vector<Record>& records, const std::filesystem::path& file);

/// A column "records" that leads from a page in `page_folder` to the records behind each row: those of the sweeps that agree
/// with it in what it has of parameter, dataset, sequence, body, estimator (or first and second), level and noise. A table
/// without datasets, or without places, stays as it is.
void add_record_links(const RecordPlaces& places, const std::vector<NoiseSweep>& sweeps,
                      const std::filesystem::path& page_folder, Table& table);
/// The same for all of the places: of records that no sweep varies.
void add_record_links(const RecordPlaces& places, const std::filesystem::path& page_folder, Table& table);

/// Each row's cell in the column of that key leads to its address, in the order of the rows.
void add_addresses(const std::string& key, const std::vector<std::string>& addresses, Table& table);

/// The address of a file on a page in `page_folder`: relative, so that both can be moved together.
std::string address_from(const std::filesystem::path& page_folder, const std::filesystem::path& file);

}  // namespace sextant
