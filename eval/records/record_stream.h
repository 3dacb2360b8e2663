#pragma once

// records.jsonl, one record a line: written, read whole, or read from its first line to its last with a few
// MB of it in memory, for what needs less of a record than the record.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/records/record.h"

namespace sextant {

/// One line a record, each ended by a newline.
std::string write_records(const std::vector<Record>& records);
/// `name` is used in messages as "NAME:LINE: ...". An unfinished last line is an error.
std::vector<Record> parse_records(std::string_view text, const std::string& name);
std::vector<Record> read_records(const std::filesystem::path& path);

/// A longer line holds no record; those that this program writes have about 1 kB.
inline constexpr size_t max_record_bytes = size_t{1} << 20U;

/// The record is that of one line, and may be taken away; the next one overwrites it.
using RecordVisitor = std::function<void(Record&)>;

/// In order of the lines. Throws Error "FILE:LINE: ...", also for an unfinished last line.
void for_each_record(const std::filesystem::path& path, const RecordVisitor& visit);
/// The same of a text; `name` is the file in messages.
void for_each_record(std::string_view text, const std::string& name, const RecordVisitor& visit);

// ---- scanning: reading records.jsonl is what comparing and reporting wait for. This reader takes a line
// only in the very form in which write_records() writes it (keys in order, no spaces, no escapes) and is
// several times as fast as a general JSON parser; every other line is left to record_from_json(), which also
// says what is wrong. Compiled for any x86-64, simdjson is no faster (bench/records_bench.cc).

/// Makes `record` equal to that of record_from_json(). False, and any record, when the line is not in the
/// writer's form.
bool scan_record(std::string_view line, Record& record);

}  // namespace sextant
