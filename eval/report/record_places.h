#pragma once

// Places in the files of records that the rows of a table come from, for links from a page to these records.

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// Records behind a row: their number, and the one with the largest E_t.
struct RowRecords {
  std::filesystem::path file;
  size_t n = 0;
  size_t worst_line = 0;  ///< from 1; 0: none of them has E_t
  uint64_t worst_seed = 0;
  int worst_frame = 0;
  double worst_Et_m = 0;

  /// Adds the record in line `line`.
  void add(const Record& record, size_t line);
  /// Adds the records of another row; `file` becomes that of the worst record.
  void add(const RowRecords& more);
  /// Formats "80; largest E_t: seed 3, frame 130, line 512".
  std::string text() const;
};

/// The records of one noise level.
struct LevelRecords {
  std::string parameter;  ///< parameter of the sweep; "" if nothing is swept
  NoiseLevelKey key;
  RowRecords records;
};
using RecordPlaces = std::vector<LevelRecords>;

/// Finds the records with truth in FOLDER/records.jsonl, for the levels of the sweeps that were read from
/// these folders; a folder that kept summaries has none.
RecordPlaces record_places(const std::vector<std::filesystem::path>& folders,
                           const std::vector<NoiseSweep>& sweeps);
/// Finds records with truth that will become the lines of `file`.
RecordPlaces record_places(const std::vector<Record>& records, const std::filesystem::path& file);

/// Adds or fills the column "records", which links from a page in `page_folder` to the records behind each
/// row.
void add_records_column(const std::vector<RowRecords>& behind, const std::filesystem::path& page_folder,
                        Table& table);

/// Adds the column "records" to a table with one row for each of `rows`, which have a data set, a sequence
/// and a body, and may have a level. `row.covers(parameter, key)` returns true for the levels whose records
/// are behind a row. Without places the table stays unchanged.
template <typename Row>
void add_record_links(const std::vector<Row>& rows, const RecordPlaces& places,
                      const std::filesystem::path& page_folder, Table& table) {
  if (places.empty() || rows.empty()) return;
  // Both rows and levels can be numerous, so a row is only compared with the levels of its own case.
  using Case = std::tuple<std::string_view, std::string_view, std::string_view, double>;
  constexpr bool has_level = requires(const Row& row) { row.level; };
  std::map<Case, std::vector<const LevelRecords*>> by_case;
  for (const LevelRecords& level : places) {
    const NoiseLevelKey& key = level.key;
    by_case[Case(key.dataset.str(), key.sequence.str(), key.body.str(), has_level ? key.level : 0.0)]
        .push_back(&level);
  }
  std::vector<RowRecords> behind(rows.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    Case of_row(rows[i].dataset, rows[i].sequence, rows[i].body, 0.0);
    if constexpr (has_level) std::get<3>(of_row) = rows[i].level;
    const auto found = by_case.find(of_row);
    if (found == by_case.end()) continue;
    for (const LevelRecords* level : found->second) {
      if (rows[i].covers(level->parameter, level->key)) behind[i].add(level->records);
    }
  }
  add_records_column(behind, page_folder, table);
}

/// Makes the cells in the column `key` link to these addresses, one for each row; "" links nowhere.
void add_addresses(const std::string& key, const std::vector<std::string>& addresses, Table& table);

/// Returns the address of a file relative to a page in `page_folder`, so that both can be moved together.
std::string address_from(const std::filesystem::path& page_folder, const std::filesystem::path& file);

}  // namespace sextant
