#pragma once

// Reading records.jsonl is what comparing and reporting wait for. This reader takes a line only in the very
// form in which write_records() writes it (keys in order, no spaces, no escapes) and is several times
// as fast as a general JSON parser; every other line is left to record_from_json(), which also says what is
// wrong. Compiled for any x86-64, simdjson is no faster (bench/records_bench.cc).

#include <string_view>

#include "sextant/eval/records/record.h"

namespace sextant {

/// Makes `record` equal to that of record_from_json(). False, and any record, when the line is not in the writer's form.
bool scan_record(std::string_view line, Record& record);

}  // namespace sextant
