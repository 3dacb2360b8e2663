#pragma once

// The files of a sweep's folder (sweep.h): claiming the folder, and merging finished shards.

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

/// Reads plan.json: {"plan", "shard", "data", "programs"} and, if there are any, "fingerprints". Throws Error
/// that names the file.
Json read_plan_file(const std::filesystem::path& folder);

/// Shard I of N, I in 1..N, according to a plan file. Throws Error that begins with `where`.
struct ShardNumber {
  uint64_t number = 1;
  uint64_t n_shards = 1;
};
ShardNumber shard_number(const Json& plan_file, const std::string& where);

/// Returns the number of cases of a plan (Plan::json()). Throws Error that begins with `where` if it is
/// invalid, or has more than max_plan_cases.
uint64_t planned_cases(const Json& plan, const std::string& where);

/// Writes plan.json, or checks that the existing one equals `wanted` except for versions of estimators. The
/// caller holds the folder's lock. Throws Error if it is another plan, unless its results may be replaced
/// (`replace`); or if another version of the program began it and it is not finished, unless `allow_mixed`,
/// in which case plan.json names both ("programs"). Returns the new content of plan.json: the versions of
/// estimators behind its cases and, unless it is finished, those of `wanted`.
Json claim_folder(const std::filesystem::path& folder, const Json& wanted, bool replace, bool allow_mixed);

/// Continues a plan file `present` whose cases are kept, like claim_folder() with an unfinished sweep: writes
/// plan.json and returns its content.
Json join_claim(const std::filesystem::path& folder, Json present, const Json& wanted, bool allow_mixed);

/// Removes the results of a finished sweep, but not its plan.json.
void remove_results(const std::filesystem::path& folder);

/// Removes everything that a sweep wrote into the folder, finished or not. Does nothing if there is no sweep.
/// The caller holds the folder's lock.
void remove_sweep(const std::filesystem::path& folder);

/// Removes temporary files of write_file() in a killed process. The caller holds the folder's lock.
void remove_temporaries(const std::filesystem::path& folder);

// ---- Versions of external estimators behind the cases of a sweep (records/fingerprint.h). A finished case
// is stale if another version than the present one computed it, or if the version is unknown. Cases of
// Sextant's own estimators are never stale here: plan.json names the program.

/// Returns Plan::json() without the options of estimators of a kind, which are part of their fingerprints.
/// Sweeps with equal keys differ at most by versions of their estimators.
Json plan_key(Json plan);

/// Returns the present fingerprints of the plan's estimators. Throws Error.
Fingerprints present_fingerprints(const Plan& plan);
/// Returns the fingerprints of the plan's estimators if their files in the folder `rescored` are read again:
/// the versions that ran there, with the present configuration.
Fingerprints rescored_fingerprints(const Plan& plan, const std::filesystem::path& rescored);

class CaseVersions {
 public:
  /// `sweep` is the name of the sweep without versions; `known` are the versions behind its finished cases.
  CaseVersions(const Plan& plan, std::string sweep, Fingerprints now, Fingerprints known);

  /// Returns the owners for the Journal: the present version, then the other known ones.
  std::vector<std::string> owners(uint64_t number) const;
  /// Returns the name of the sweep together with all present versions.
  std::string owner_of_all() const;
  /// Returns true if a case of a finished sweep is stale.
  bool is_stale(uint64_t number) const;
  /// Returns "'mine' is another version than before (estimator.py changed): 6 finished cases".
  std::string stale_text(const std::string& label, uint64_t n_cases) const;
  const std::string& label(uint64_t number) const {
    return plan_.estimators[plan_.at(number).estimator].label;
  }
  /// Adds the version at index `place` of owners().
  void add_used(uint64_t number, size_t place, Fingerprints& used) const;

  const Fingerprints& now() const { return now_; }
  const Fingerprints& known() const { return known_; }

 private:
  /// Returns the versions of the case's estimator, in the order of owners(); empty if it has no fingerprint.
  std::vector<Fingerprint> versions(uint64_t number) const;

  const Plan& plan_;
  std::string sweep_;
  Fingerprints now_, known_;
};

}  // namespace sextant
