#include "sextant/eval/report/record_places.h"

#include <algorithm>
#include <cctype>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

namespace {

/// What a row says in that column; null where the table has no such column, or the row nothing in it.
const Cell* cell_in(const Table& table, const std::vector<Cell>& row, std::string_view key) {
  const auto column = std::ranges::find(table.columns, key, &Column::key);
  if (column == table.columns.end()) return nullptr;
  const Cell& cell = row[static_cast<size_t>(column - table.columns.begin())];
  return std::holds_alternative<std::monostate>(cell) ? nullptr : &cell;
}

bool is_behind(const NoiseLevelKey& key, const std::string& parameter, const Table& table,
               const std::vector<Cell>& row) {
  const auto agrees = [&](std::string_view column, const Cell& value) {
    const Cell* cell = cell_in(table, row, column);
    return cell == nullptr || *cell == value;
  };
  const Cell estimator(key.estimator.str());
  const Cell *first = cell_in(table, row, "first"), *second = cell_in(table, row, "second");
  const bool is_compared =
      first == nullptr || second == nullptr || *first == estimator || *second == estimator;
  return is_compared && agrees("parameter", parameter) && agrees("dataset", key.dataset.str()) &&
         agrees("sequence", key.sequence.str()) && agrees("body", key.body.str()) &&
         agrees("estimator", estimator) && agrees("level", key.level) && agrees("noise", key.noise.str());
}

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

RecordPlaces record_places(const std::vector<fs::path>& folders) {
  RecordPlaces places;
  for (const fs::path& folder : folders) {
    const fs::path file = folder / "records.jsonl";
    if (!fs::exists(file)) continue;
    size_t line = 0;
    for_each_record(file, [&](Record& record) {
      ++line;
      if (!has_truth(record)) return;
      RowRecords& row = places[NoiseLevelKey::of(record)];
      row.file = file;
      ++row.n;
      const auto Et_m = find_number(record.errors, "Et_m");
      if (record.status != Status::ok || !Et_m || (row.worst_line != 0 && *Et_m <= row.worst_Et_m)) return;
      row.worst_line = line;
      row.worst_seed = record.seed;
      row.worst_frame = record.frame;
      row.worst_Et_m = *Et_m;
    });
  }
  return places;
}

void add_record_links(const RecordPlaces& places, const std::vector<NoiseSweep>& sweeps,
                      const fs::path& page_folder, Table& table) {
  if (places.empty() || table.rows.empty() ||
      std::ranges::find(table.columns, "dataset", &Column::key) == table.columns.end())
    return;
  std::vector<RowRecords> behind(table.rows.size());
  for (const NoiseSweep& sweep : sweeps) {
    for (const NoiseLevelRef& level : sweep.levels) {
      const RowRecords* place = find_in(places, level->key());
      if (place == nullptr) continue;
      for (size_t i = 0; i < behind.size(); ++i) {
        if (is_behind(level->key(), sweep.parameter, table, table.rows[i])) behind[i].add(*place);
      }
    }
  }
  auto column = std::ranges::find(table.columns, "records", &Column::key);
  if (column == table.columns.end()) {
    column = table.columns.insert(column, Column::text("records"));
    for (std::vector<Cell>& row : table.rows) row.emplace_back();
  }
  column->fold = false;
  const auto at = static_cast<size_t>(column - table.columns.begin());
  std::vector<std::string> addresses;
  for (size_t i = 0; i < behind.size(); ++i) {
    if (behind[i].n > 0) table.rows[i][at] = behind[i].text();
    addresses.push_back(behind[i].n == 0 ? "" : address_from(page_folder, behind[i].file));
  }
  add_addresses("records", addresses, table);
}

void add_addresses(const std::string& key, const std::vector<std::string>& addresses, Table& table) {
  SEXTANT_CHECK(addresses.size() == table.rows.size());
  const auto column = std::ranges::find(table.columns, key, &Column::key);
  SEXTANT_CHECK(column != table.columns.end());
  column->leads_to = key + "_file";
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
