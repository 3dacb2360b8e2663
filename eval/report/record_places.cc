#include "sextant/eval/report/record_places.h"

#include <algorithm>
#include <cctype>
<<<<<<< HEAD
#include <unordered_map>
=======
#include <map>
>>>>>>> Reports: tables from rows and fields, what stands for the paper's rows is data, files by concept

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

namespace {

<<<<<<< HEAD
/// What the rows of one noise level say in the columns that a table has, found once for all rows.
class LevelInTable {
 public:
  LevelInTable(const Table& table, const NoiseLevelKey& key, const std::string& parameter)
      : estimator_(key.estimator.str()), first_(table.find_column("first")), second_(table.find_column("second")) {
    const std::pair<const char*, Cell> values[] = {
        {"parameter", parameter},   {"dataset", key.dataset.str()}, {"sequence", key.sequence.str()},
        {"body", key.body.str()},   {"estimator", estimator_},      {"level", key.level},
        {"noise", key.noise.str()},
    };
    for (const auto& [name, value] : values) {
      if (const auto column = table.find_column(name)) said_.emplace_back(*column, value);
    }
  }

  /// The values in those of its columns that all rows of the table fill; key_of_row() of the rows that it can be behind.
  std::string key(const std::vector<bool>& filled) const {
    std::string key;
    for (const auto& [column, value] : said_) {
      if (filled[column]) add_to_key(value, key);
    }
    return key;
  }
  std::string key_of_row(const std::vector<bool>& filled, const std::vector<Cell>& row) const {
    std::string key;
    for (const auto& [column, value] : said_) {
      if (filled[column]) add_to_key(row[column], key);
    }
    return key;
  }

  /// An empty cell agrees with everything; a row that compares two estimators has both behind it.
  bool is_behind(const std::vector<Cell>& row) const {
    const auto agrees = [&row](size_t column, const Cell& value) {
      return std::holds_alternative<std::monostate>(row[column]) || row[column] == value;
    };
    const bool is_compared = !first_ || !second_ || agrees(*first_, estimator_) || agrees(*second_, estimator_);
    return is_compared && std::ranges::all_of(said_, [&](const auto& said) { return agrees(said.first, said.second); });
  }

 private:
  static void add_to_key(const Cell& cell, std::string& key) {
    if (const auto* text = std::get_if<std::string>(&cell)) key += *text;
    if (const auto* number = std::get_if<double>(&cell)) key += fmt::format("{}", *number + 0.0);  // -0 is 0
    key.push_back('\0');
  }

  Cell estimator_;
  std::optional<size_t> first_, second_;
  std::vector<std::pair<size_t, Cell>> said_;
};
=======
using RecordsByLevel = std::map<NoiseLevelKey, RowRecords>;
>>>>>>> Reports: tables from rows and fields, what stands for the paper's rows is data, files by concept

void add_place(const Record& record, size_t line, const fs::path& file, RecordsByLevel& places) {
  if (!has_truth(record)) return;
  RowRecords& row = places[NoiseLevelKey::of(record)];
  row.file = file;
  row.add(record, line);
}

<<<<<<< HEAD
void add_links(const std::vector<PlaceOfRows>& all, const fs::path& page_folder, Table& table) {
  if (all.empty() || table.rows.empty() || !table.find_column("dataset")) return;
  if (!table.find_column("records")) {
    table.columns.push_back(Column::text("records"));
    for (std::vector<Cell>& row : table.rows) row.emplace_back();
  }
  const size_t at = table.place("records");
  table.columns[at].fold = false;
  // Levels by what they say in the columns that every row fills, so that a row meets its own alone.
  std::vector<bool> filled(table.columns.size());
  for (size_t j = 0; j < filled.size(); ++j) {
    filled[j] = std::ranges::none_of(
        table.rows, [&](const std::vector<Cell>& row) { return std::holds_alternative<std::monostate>(row[j]); });
  }
  std::unordered_map<std::string, std::vector<const PlaceOfRows*>> by_key;
  for (const PlaceOfRows& place : all) by_key[place.level.key(filled)].push_back(&place);
  std::vector<std::string> addresses;
  for (std::vector<Cell>& row : table.rows) {
    RowRecords behind;
    if (const auto found = by_key.find(all.front().level.key_of_row(filled, row)); found != by_key.end()) {
      for (const PlaceOfRows* place : found->second) {
        if (place->level.is_behind(row)) behind.add(*place->place);
      }
    }
    if (behind.n > 0) row[at] = behind.text();
    addresses.push_back(behind.n == 0 ? "" : address_from(page_folder, behind.file));
  }
  add_addresses("records", addresses, table);
}

=======
>>>>>>> Reports: tables from rows and fields, what stands for the paper's rows is data, files by concept
}  // namespace

void RowRecords::add(const RowRecords& more) {
  const bool is_worse = more.worst_line != 0 && (worst_line == 0 || more.worst_Et_m > worst_Et_m);
  const size_t n_all = n + more.n;
  if (is_worse || n == 0) *this = more;
  n = n_all;
}

std::string RowRecords::text() const {
  if (worst_line == 0) return fmt::format("{}", n);
  return fmt::format("{}; largest E_t: seed {}, frame {}, line {}", n, worst_seed, worst_frame, worst_line);
}

void RowRecords::add(const Record& record, size_t line) {
  ++n;
  const auto Et_m = find_number(record.errors, "Et_m");
  if (record.status != Status::ok || !Et_m || (worst_line != 0 && *Et_m <= worst_Et_m)) return;
  worst_line = line;
  worst_seed = record.seed;
  worst_frame = record.frame;
  worst_Et_m = *Et_m;
}

RecordPlaces record_places(const std::vector<fs::path>& folders, const std::vector<NoiseSweep>& sweeps) {
  RecordsByLevel by_level;
  for (const fs::path& folder : folders) {
    const fs::path file = folder / "records.jsonl";
    if (!fs::exists(file)) continue;
    size_t line = 0;
    for_each_record(file, [&](Record& record) { add_place(record, ++line, file, by_level); });
  }
  RecordPlaces places;
  for (const NoiseSweep& sweep : sweeps) {
    for (const NoiseLevelRef& level : sweep.levels) {
      if (const RowRecords* records = find_in(by_level, level->key()))
        places.push_back({sweep.parameter, level->key(), *records});
    }
  }
  return places;
}

RecordPlaces record_places(const std::vector<Record>& records, const fs::path& file) {
  RecordsByLevel by_level;
  size_t line = 0;
  for (const Record& record : records) add_place(record, ++line, file, by_level);
  RecordPlaces places;
  for (const auto& [key, of_level] : by_level) places.push_back({"", key, of_level});
  return places;
}

void add_records_column(const std::vector<RowRecords>& behind, const fs::path& page_folder, Table& table) {
  SEXTANT_CHECK(behind.size() == table.rows.size());
  if (!table.find_column("records")) {
    table.columns.push_back(Column::text("records"));
    for (std::vector<Cell>& row : table.rows) row.emplace_back();
  }
  const size_t at = table.place("records");
  table.columns[at].fold = false;
  std::vector<std::string> addresses;
  for (size_t i = 0; i < behind.size(); ++i) {
    if (behind[i].n > 0) table.rows[i][at] = behind[i].text();
    addresses.push_back(behind[i].n == 0 ? "" : address_from(page_folder, behind[i].file));
  }
  add_addresses("records", addresses, table);
}

void add_addresses(const std::string& key, const std::vector<std::string>& addresses, Table& table) {
  SEXTANT_CHECK(addresses.size() == table.rows.size());
  table.columns[table.place(key)].leads_to = key + "_file";
  table.columns.push_back(Column::text(key + "_file").only_in_files());
  for (size_t i = 0; i < addresses.size(); ++i) {
    Cell& cell = table.rows[i].emplace_back();
    if (!addresses[i].empty()) cell = addresses[i];
  }
}

std::string address_from(const fs::path& page_folder, const fs::path& file) {
  const std::string path = fs::absolute(file)
                               .lexically_normal()
                               .lexically_proximate(fs::absolute(page_folder).lexically_normal())
                               .string();
  std::string address;
  for (const char c :
       path) {  // a file's name is no part of an address: '#', '?' and '%' mean something there
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) != 0 || std::string_view("/._-~").find(c) != std::string_view::npos;
    address += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return address;
}

}  // namespace sextant
