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
#include "sextant/eval/records/provenance.h"

namespace sextant {

/// Reads plan.json: {"plan", "shard", "data", "programs"} and, if there are any, "fingerprints". Throws Error
/// that names the file if it is missing or is not the plan file of a sweep.
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
/// caller holds the folder's lock. Throws Error if the folder has results that do not belong to a sweep; if
/// plan, shard or data of the present sweep differ, unless `replace`, which removes its results; or if
/// another version of the program began it and it is not finished, unless `allow_mixed`, in which case
/// plan.json names both ("programs"). Returns the new content of plan.json, which names the versions of
/// estimators behind the cases and, unless the sweep is finished, those of `wanted`.
Json claim_folder(const std::filesystem::path& folder, const Json& wanted, bool replace, bool allow_mixed);

/// Adds the program and the estimator versions of `wanted` to the plan file `present`, whose cases are kept;
/// writes plan.json if its content changes, and returns the content. Throws Error if the program is another
/// version, unless `allow_mixed`.
Json join_claim(const std::filesystem::path& folder, Json present, const Json& wanted, bool allow_mixed);

/// Removes the results of a finished sweep, but not its plan.json.
void remove_results(const std::filesystem::path& folder);

/// Removes everything that a sweep wrote into the folder, finished or not. Does nothing if there is no
/// plan.json; throws Error if that is not the plan file of a sweep. The caller holds the folder's lock.
void remove_sweep(const std::filesystem::path& folder);

/// Removes temporary files of plan.json that a killed process has left. The caller holds the folder's lock.
void remove_temporaries(const std::filesystem::path& folder);

// ---- Versions of external estimators behind the cases of a sweep (records/provenance.h). A finished case
// is stale if another version than the present one computed it, or if the version is unknown. Cases of
// Sextant's own estimators are never stale here: plan.json names the program.

/// Returns `plan`, a Plan::json(), without the options of estimators called PREFIX:REST (is_of_a_kind()),
/// which are part of their fingerprints. Sweeps with equal keys differ at most by versions of their
/// estimators.
Json plan_key(Json plan);

/// Returns the present fingerprints of the plan's estimators, by label, without Sextant's own estimators.
/// Throws Error if a file of an estimator cannot be read.
Fingerprints present_fingerprints(const Plan& plan);
/// Returns the fingerprints of the plan's estimators if their files in the folder `rescored` are read again:
/// the versions that ran there, with the present configuration.
Fingerprints rescored_fingerprints(const Plan& plan, const std::filesystem::path& rescored);

class CaseVersions {
 public:
  /// `sweep` identifies the plan, shard and data of the sweep, but no versions; `now` are the present
  /// versions of its estimators, `known` the versions behind its finished cases.
  CaseVersions(const Plan& plan, std::string sweep, Fingerprints now, Fingerprints known);

  /// Returns the owners of a case for the Journal, one for each version of its estimator: the present version
  /// first, then the other known ones.
  std::vector<std::string> owners(uint64_t number) const;
  /// Returns the owner of cases of all estimators: a name made of `sweep` and all present versions.
  std::string owner_of_all() const;
  /// Returns true if a case of a finished sweep is stale.
  bool is_stale(uint64_t number) const;
  /// Returns "'mine': another version of it made 6 finished cases (estimator.py changed)".
  std::string stale_text(const std::string& label, uint64_t n_cases) const;
  const std::string& label(uint64_t number) const {
    return plan_.estimators[plan_.at(number).estimator].label;
  }
  /// Adds the version at index `place` of owners(number) to `used`.
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
