#include "sextant/eval/report/record_places.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

namespace {

using RecordsByLevel = std::map<NoiseLevelKey, RowRecords>;

void add_place(const Record& record, size_t line, const fs::path& file, RecordsByLevel& places) {
  if (!has_truth(record)) return;
  RowRecords& row = places[NoiseLevelKey::of(record)];
  row.file = file;
  row.add(record, line);
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
  if (!table.find_column("records")) table.add_column(Column::text("records"), [](size_t) { return Cell(); });
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
  table.add_column(Column::text(key + "_file").only_in_files(),
                   [&](size_t i) { return addresses[i].empty() ? Cell() : Cell(addresses[i]); });
}

std::string address_from(const fs::path& page_folder, const fs::path& file) {
  const std::string path = fs::absolute(file)
                               .lexically_normal()
                               .lexically_proximate(fs::absolute(page_folder).lexically_normal())
                               .string();
  std::string address;
  for (const char c :
       path) {  // '#', '?' and '%' have a meaning in addresses and must be escaped in a file name
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) != 0 || std::string_view("/._-~").find(c) != std::string_view::npos;
    address += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return address;
}

}  // namespace sextant
