#pragma once

// records.jsonl, read from its first line to its last with a few MB of it in memory: for what needs less of a record than the
// record. Reading it whole: read_records() in record.h.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "sextant/eval/records/record.h"

namespace sextant {

/// A longer line holds no record; those that this program writes have about 1 kB.
inline constexpr size_t max_record_bytes = size_t{1} << 20U;

/// The record is that of one line, and may be taken away; the next one overwrites it.
using RecordVisitor = std::function<void(Record&)>;

/// In order of the lines. Throws Error "FILE:LINE: ...", also for an unfinished last line.
void for_each_record(const std::filesystem::path& path, const RecordVisitor& visit);
/// The same of a text; `name` is the file in messages.
void for_each_record(std::string_view text, const std::string& name, const RecordVisitor& visit);

}  // namespace sextant
