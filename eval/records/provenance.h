#pragma once

// run.json, the provenance of a folder of results: what this program writes about itself, and reading the
// file.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sextant/base/json.h"

namespace sextant {

std::string version();
/// Returns the commit of the source tree, with "-dirty" if it had changes; "unknown" outside git.
std::string git_commit();
/// Returns version and commit of this program; all results of one sweep must have the same.
Json program_identity();
/// Returns "0.1.0 (commit abc)" for the first program of a list of program_identity().
std::string program_text(const Json& programs);
/// Returns version, build and machine, with which every run.json begins.
Json build_provenance();

/// Reads run.json of `folder`. Members that this program uses must have their types if present:
/// configuration, machine, packages and inputs are objects; sources and noise are lists of objects with a
/// text `source`; inputs contain {"sha256"} or a text; version, git_commit, compiler and flags are texts;
/// cases is a number. Throws Error that names file and key.
Json read_run_json(const std::filesystem::path& folder);

// Checks of results that are compared or shown. `run`: content of run.json.

/// Calls `visit` with the dotted key and value of each leaf of a tree of options: every value that is no
/// object and, with `enters_lists`, no list. An empty object or list is a leaf. Keys begin with `path`.
void for_each_leaf(const Json& tree, bool enters_lists,
                   const std::function<void(const std::string& key, const Json& value)>& visit,
                   const std::string& path = "");
/// Returns a source of run.json without its folder, "vdo:/data/kitti_03_demo@0-19" ->
/// "vdo:kitti_03_demo@0-19", because the place of data is not a property of the data.
std::string without_folder(const std::string& source);
/// Data of the sources of a run, as texts by "SOURCE WHAT": description, rate, size and camera, and the
/// SHA-256 of the files, each named by the last two parts of its path. Files with the same name form a set.
using SourceData = std::map<std::string, std::set<std::string>>;
SourceData data_of(const Json& run);
/// Compares the data of sources that two runs have in common. Returns the first entry that differs,
/// "vdo:data depth/000000.png"; empty if there is none. Entries and files of one run only are ignored,
/// because the estimator and the version of the program decide which files are read.
std::string changed_data(const SourceData& before, const SourceData& now);
/// Throws Error if the data of the results in `folder` differ from those of `now`, the content of a run.json
/// of the same sources today.
void check_unchanged_data(const std::filesystem::path& folder, const Json& now);
/// Returns the number of the shard and the number of shards that run.json states; nullopt if it states none.
std::optional<std::pair<uint64_t, uint64_t>> shard_of(const Json& run);
/// Throws Error if the folder holds one of several shards of a sweep.
void check_whole_sweep(const Json& run, const std::filesystem::path& folder);
/// Returns a sentence if run.json states another number of records than the folder holds; otherwise "".
std::string missing_records(const Json& run, uint64_t n_records, const std::filesystem::path& folder);
/// Returns a warning that `n` records of the folder have status ok, but no errors.
std::string missing_errors(const std::filesystem::path& folder, uint64_t n);
/// Compares runs whose numbers are shown together with the first of them.
class SameDefinitions {
 public:
  /// Throws Error if the first run and this one define an error differently. `folder`: of its run.json.
  void check(const Json& run, const std::filesystem::path& folder);

 private:
  Json first_ = Json::object();
  std::string first_file_;
};

// ---- Fingerprint of an external estimator: a program that sextant starts, or a Python function. Two results
// come from the same estimator if its fingerprints are equal.
//
//   "fingerprints": {LABEL: [{"sha256": ..., "parts": {NAME: SHA-256}, "not_seen": [TEXT]}]}
//
// in plan.json and run.json: for each label of records, the versions of the estimator that computed the cases
// (more than one after --reuse-stale or merge --allow-mixed).
//
//   parts     the hashed parts: "program python3", "estimator.py", "configuration", "global SCALE"
//   not_seen  dependencies of the estimator that are not hashed, as texts
//   sha256    of the parts

struct Fingerprint {
  std::map<std::string, std::string> parts;
  std::vector<std::string> not_seen;

  std::string sha256() const;
  Json json() const;
  /// Parses a fingerprint. Throws Error that begins with `where` if a member is missing or malformed.
  static Fingerprint from(const Json& json, const std::string& where);
};

/// Compares the parts; `not_seen` is ignored.
bool operator==(const Fingerprint& a, const Fingerprint& b);

/// Describes how `now` differs from `before`: "estimator.py changed, params.txt is new, old.txt is gone,
/// 3 more"; empty if they are equal.
std::string difference(const Fingerprint& before, const Fingerprint& now);

/// Versions by the estimator's label.
using Fingerprints = std::map<std::string, std::vector<Fingerprint>>;

constexpr const char* fingerprints_key = "fingerprints";
Json fingerprints_json(const Fingerprints& fingerprints);
/// Returns the fingerprints in a plan.json or run.json; empty if the file has no such key. Throws Error that
/// begins with `where` if they are malformed.
Fingerprints fingerprints_in(const Json& file, const std::string& where);

}  // namespace sextant
