#pragma once

// What every table asks of a record.

#include <optional>
#include <string>

#include "sextant/eval/experiment/record.h"

namespace sextant {

/// The number of that name, if the record has it.
std::optional<double> find_number(const Record::Numbers& numbers, const std::string& key);

/// Truth in both frames, and worth estimating: an object that is static by truth is not.
bool has_truth(const Record& record);

/// Where a body stands in tables: 0 for ego, else its id.
int body_order(const Record& record);

}  // namespace sextant
