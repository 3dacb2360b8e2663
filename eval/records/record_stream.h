#pragma once

// records.jsonl, one record per line: written, read completely, or streamed from the first line to the last
// with a few MB in memory.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/records/record.h"

namespace sextant {

/// Returns one line per record, each ended by a newline.
std::string write_records(const std::vector<Record>& records);
/// Parses records; messages have the form "NAME:LINE: ...". An unfinished last line is an error.
std::vector<Record> parse_records(std::string_view text, const std::string& name);
std::vector<Record> read_records(const std::filesystem::path& path);

/// Largest length of a line; longer lines are refused. Lines written by this program have about 1 kB.
inline constexpr size_t max_record_bytes = size_t{1} << 20U;

/// Receives the record of one line, which it may move from; the next line overwrites it.
using RecordVisitor = std::function<void(Record&)>;

/// Visits the records in order of the lines. Throws Error "FILE:LINE: ...", also for an unfinished last line.
void for_each_record(const std::filesystem::path& path, const RecordVisitor& visit);
/// Overload for a text; `name` is the file in messages.
void for_each_record(std::string_view text, const std::string& name, const RecordVisitor& visit);

// ---- scanning: reading records.jsonl dominates the time of comparing and reporting. This reader accepts a
// line only in the exact form in which write_records() writes it (keys in order, no spaces, no escapes) and
// is several times as fast as a general JSON parser. Every other line is left to record_from_json(), which
// also reports errors. Compiled for any x86-64, simdjson is not faster (bench/records_bench.cc).

/// Sets `record` to the result of record_from_json(). Returns false, with `record` undefined, if the line is
/// not in the writer's form.
bool scan_record(std::string_view line, Record& record);

}  // namespace sextant
