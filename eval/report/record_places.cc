#include "sextant/eval/report/record_places.h"

#include <cctype>

#include "sextant/base/files.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

std::string RowRecords::text() const {
  if (worst_line == 0) return fmt::format("{}", n);
  return fmt::format("{}; largest E_t: seed {}, frame {}, line {}", n, worst_seed, worst_frame, worst_line);
}

std::map<NoiseLevelKey, RowRecords> record_places(const std::vector<fs::path>& folders) {
  std::map<NoiseLevelKey, RowRecords> places;
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
