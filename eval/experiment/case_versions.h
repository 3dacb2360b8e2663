#pragma once

// Which version of an estimator made which case of a sweep, for estimators that are no part of Sextant
// (records/fingerprint.h). A finished case is stale when another version made it than the one that would run
// now, or when that is not known. Cases of Sextant's own estimators are never stale here: plan.json names the
// program.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/records/fingerprint.h"

namespace sextant {

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
