#pragma once

// The files of a sweep's folder (sweep.h): who may write there, and the join of finished shards.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/records/fingerprint.h"

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

// ---- Which version of an estimator made which case of a sweep, for estimators that are no part of Sextant
// (records/fingerprint.h). A finished case is stale when another version made it than the one that would run
// now, or when that is not known. Cases of Sextant's own estimators are never stale here: plan.json names the
// program.

/// Plan::json() without the options of estimators of a kind, which are in their fingerprints. Sweeps with
/// equal keys differ by versions of their estimators at most.
Json plan_key(Json plan);

/// Of the plan's estimators, as they are now. Throws Error.
Fingerprints present_fingerprints(const Plan& plan);
/// Of the plan's estimators where those of a kind are scored again from what they left in the folder
/// `rescored`: the versions that ran there, with the configuration of now.
Fingerprints rescored_fingerprints(const Plan& plan, const std::filesystem::path& rescored);

class CaseVersions {
 public:
  /// `sweep` is the name of the sweep apart from versions; `known` are the versions that made its finished
  /// cases.
  CaseVersions(const Plan& plan, std::string sweep, Fingerprints now, Fingerprints known);

  /// Journal::Owners: the version of now, then the other known ones.
  std::vector<std::string> owners(uint64_t number) const;
  /// The name of the sweep together with all versions of now.
  std::string owner_of_all() const;
  /// Of a case of a finished sweep.
  bool is_stale(uint64_t number) const;
  /// "'mine' is another version than before (estimator.py changed): 6 finished cases".
  std::string stale_text(const std::string& label, uint64_t n_cases) const;
  const std::string& label(uint64_t number) const {
    return plan_.estimators[plan_.at(number).estimator].label;
  }
  /// The version in a place of owners().
  void add_used(uint64_t number, size_t place, Fingerprints& used) const;

  const Fingerprints& now() const { return now_; }
  const Fingerprints& known() const { return known_; }

 private:
  /// Of the case's estimator, in the order of owners(); none where it has no fingerprint.
  std::vector<Fingerprint> versions(uint64_t number) const;

  const Plan& plan_;
  std::string sweep_;
  Fingerprints now_, known_;
};

}  // namespace sextant
