#pragma once

// The files of a sweep's folder (sweep.h): who may write there, and the join of finished shards.

#include <filesystem>

#include "sextant/base/json.h"
#include "sextant/eval/experiment/sweep.h"

namespace sextant {

/// plan.json: {"plan", "shard", "data", "programs"} and, where there are any, "fingerprints". Throws Error
/// that names the file.
Json read_plan_file(const std::filesystem::path& folder);

/// Which shard a plan file says that its folder holds: I and N, I in 1..N. Throws Error that begins with
/// `where`.
struct ShardNumber {
  uint64_t number = 1;
  uint64_t n_shards = 1;
};
ShardNumber shard_number(const Json& plan_file, const std::string& where);

/// How many cases a plan (Plan::json()) has. Throws Error that begins with `where` when it is none, or has
/// more than max_plan_cases.
uint64_t planned_cases(const Json& plan, const std::string& where);

/// Writes plan.json, or sees that the one there is `wanted`, versions of estimators apart. The caller holds
/// the folder's lock. Throws Error when it is another one, unless it may `replace` that one's results; or
/// when another version of the program began it and it is not finished, unless `allow_mixed`: then plan.json
/// names both ("programs"). Returns what plan.json holds then: the versions of estimators that made its cases
/// and, unless it is finished, those of `wanted`.
Json claim_folder(const std::filesystem::path& folder, const Json& wanted, bool replace, bool allow_mixed);

/// Goes on with `present`, a plan file whose cases are kept, as claim_folder() does with a sweep that is not
/// finished: writes plan.json and returns its content.
Json join_claim(const std::filesystem::path& folder, Json present, const Json& wanted, bool allow_mixed);

/// Removes the results of a finished sweep, not its plan.json.
void remove_results(const std::filesystem::path& folder);

/// Removes what a sweep has left in the folder, finished or not, so that the next one begins anew. Nothing
/// where no sweep is. The caller holds the folder's lock.
void remove_sweep(const std::filesystem::path& folder);

/// Of write_file() in a process that was killed. Only for who holds the folder's lock.
void remove_temporaries(const std::filesystem::path& folder);

}  // namespace sextant
