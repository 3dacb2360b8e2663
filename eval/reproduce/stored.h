#pragma once

// Published systems, measured once with the external protocol (docs/external-estimators.md) and stored:
// results/systems/PART/records.jsonl holds their errors, run.json by what and on which machine they were
// measured. The files come with the program.
//
// The stored records have no truth values: of real data those are not ours to copy. They are taken from the
// records of the part that was measured here on the same frames.

#include <filesystem>

#include "sextant/eval/records/output.h"

namespace sextant {

/// records.jsonl and run.json of a stored part. Records of frames and bodies that `beside` does not have are
/// left out. Throws Error where there is no such part, or `beside` has no records.jsonl.
OutputFiles stored_files(const std::string& part, const std::filesystem::path& beside);

}  // namespace sextant
