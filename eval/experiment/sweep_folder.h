#pragma once

// The files of a sweep's folder (sweep.h): who may write there, and the join of finished shards.

#include <filesystem>

#include "sextant/base/json.h"
#include "sextant/eval/experiment/sweep.h"

namespace sextant {

/// plan.json: {"plan", "shard", "data", "programs"}. Throws Error that names the file.
Json read_plan_file(const std::filesystem::path& folder);

/// Which shard a plan file says that its folder holds: I and N, I in 1..N. Throws Error that begins with `where`.
struct ShardNumber {
  uint64_t number = 1;
  uint64_t n_shards = 1;
};
ShardNumber shard_number(const Json& plan_file, const std::string& where);

/// How many cases a plan (Plan::json()) has. Throws Error that begins with `where` when it is none, or has more than
/// max_plan_cases.
uint64_t planned_cases(const Json& plan, const std::string& where);

/// Writes plan.json, or sees that the one there is `wanted`. The caller holds the folder's lock. Throws Error when it is
/// another one, unless it may `replace` that one's results; or when another version of the program began it and it is not
/// finished, unless `allow_mixed`: then plan.json names both ("programs"). Returns what plan.json holds then.
Json claim_folder(const std::filesystem::path& folder, const Json& wanted, bool replace, bool allow_mixed);

/// Of write_file() in a process that was killed. Only for who holds the folder's lock.
void remove_temporaries(const std::filesystem::path& folder);

}  // namespace sextant
