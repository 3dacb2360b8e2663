#pragma once

// Runs the cases of a plan, from the correspondence cache, into a folder from which the sweep can be resumed
// at any case:
//
//   plan.json      the plan with all defaults, the shard, the content of its cache files, and the
//                  fingerprints of external estimators (records/provenance.h)
//   journal.jsonl  while it runs: per finished case one line {"case","records","sha256"} and the records, or
//                  {"case","bytes","sha256"} and the summary. A truncated block (kill -9, full disk) is
//                  dropped on resuming, and its case computed again
//   .finished/     while it runs with "keep": "summary": the content of the journal when it had grown to
//                  journal_bytes (case_results.h)
//   records.jsonl  at the end: all records in order of case
//   cases.jsonl    per case {"case","records"}: the number of its lines; with noise also "noise", the sums of
//                  the added noise (as in the journal)
//   summary.bin    with "keep": "summary" instead of these two (records/case_summary.h)
//   external/      files of external estimators, a folder per case
//   run.json       provenance, fingerprints and, per source and level, the noise requested and achieved in
//                  the cases of the folder
//
// The bytes of records.jsonl (without times) and of summary.bin do not depend on jobs, interruptions or
// shards: shard I of N processes its cases_of_shard() (0..N-1 and 1..N both name all shards), and
// merge_sweeps() restores the order.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/base/names.h"
#include "sextant/eval/experiment/pack.h"
#include "sextant/eval/experiment/plan.h"

namespace sextant {

struct SweepConfig {
  Plan plan;
  std::filesystem::path out;
  PackCache cache{default_cache_folder()};
  bool use_packs = true;  ///< false: sources are decoded again for every case, for comparison only
  uint64_t shard = 0;
  uint64_t n_shards = 1;
  int jobs = 1;
  bool quiet = false;
  /// Folder of a finished sweep of the same cases, whose files of external programs are read again instead of
  /// running the programs. Empty: they run.
  std::filesystem::path rescored;
  bool allow_mixed = false;  ///< resumes a sweep of another version of the program; run.json names both
  /// When a journal of summaries reaches this size, its cases are moved into a file of DIR/.finished.
  uint64_t journal_bytes = uint64_t{32} << 20U;
  /// removes a sweep of another plan, shard or data from the folder instead of failing
  bool replace = false;
  bool force = false;  ///< starts over: any sweep in the folder is removed first
  /// Keeps finished cases of another version of an estimator (sweep_folder.h) instead of running them again.
  bool reuse_stale = false;
  /// Receives lines about stale cases and about programs that changed while they ran, even if `quiet`, and
  /// otherwise also about changes that cannot be detected; may be empty.
  std::function<void(const std::string& line)> on_message;
};

struct SweepOutcome {
  uint64_t n_cases = 0;   ///< number of cases of this shard
  uint64_t n_before = 0;  ///< number of those finished by an earlier run and kept
  uint64_t n_stale =
      0;  ///< finished before by another version of an estimator: run again, or kept with reuse_stale
  uint64_t n_records = 0;
  double wall_time_s = 0;  ///< time of the cases run now, without filling the cache
  /// Depth noise of another baseline than the camera's, then problems of the estimators in the cases run now,
  /// in order of case
  std::vector<std::string> problems;
};

/// Returns {"out", "cases", "cases_before", "cases_stale", "records", "problems", "wall_time_s"} of the sweep
/// in `out`.
Json to_json(const SweepOutcome& outcome, const std::filesystem::path& out);

/// Runs or resumes a sweep. Throws Error if the folder contains another plan, shard or data (unless `replace`
/// or `force`), if another version of the program began it (unless `allow_mixed` or `force`), if it is in
/// use, or cannot be written (finished cases stay); Interrupted on Ctrl-C (resumable). Unless `reuse_stale`,
/// finished cases whose estimator has another fingerprint now are run again; if one of them is in a finished
/// sweep with summaries, which cannot be separated, all cases of this sweep are run again.
SweepOutcome sweep(const SweepConfig& config);

struct SweepSize {
  uint64_t n_cases = 0;
  uint64_t n_pairs = 0;  ///< number of frame pairs over all cases
};
/// Returns the amount of work of sweep(). Sources are opened; no case is run, no external program started and
/// nothing written.
SweepSize size_of_sweep(const SweepConfig& config);

/// Fills the correspondence cache for the cases of sweep(), and does nothing else.
void make_packs(const SweepConfig& config);

/// Merges the finished shards of one plan. Throws Error if plans or data differ; if versions of the program
/// or of an estimator differ, unless `allow_mixed`; if a shard is not finished, or a case is missing or
/// repeated. The shards are streamed: memory grows with the number of cases only. run.json contains the
/// provenance of every shard.
SweepOutcome merge_sweeps(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& out,
                          bool allow_mixed = false, bool quiet = true);

// ---- Progress of a sweep in shards (sweep_status.cc), from the folders of its shards only: DIR/shards/NAME,
// or DIR/NAME if there is no DIR/shards, each with the plan.json of a sweep. Nothing is written and no source
// is read.

struct ShardStatus {
  enum class State { missing, stopped, running, done };  ///< stopped: begun, but no process writes it

  uint64_t number = 0;  ///< 1..N
  State state = State::missing;
  uint64_t cases_done = 0;
  double seconds = 0;  ///< from the beginning to the last case
};

constexpr Names<4> names_of(ShardStatus::State) { return {"missing", "stopped", "running", "done"}; }

struct SweepStatus {
  uint64_t n_cases = 0;  ///< number of cases in the plan; 0 until a shard has begun
  std::vector<ShardStatus> shards;

  uint64_t count(ShardStatus::State state) const;
  uint64_t cases_done() const;
  /// Returns the estimated time for the unfinished cases, from the time per finished case and the number of
  /// shards running now (at least one); nullopt if no case is finished.
  std::optional<double> remaining_s() const;
  /// Returns the missing and stopped shards except `except`, in the format of `sbatch --array`: "3,8-9";
  /// empty if there are none.
  std::string to_submit(const std::set<uint64_t>& except = {}) const;
};

/// Returns the status. With `n_shards` 0 the number is taken from the shards that have begun. Throws Error if
/// a shard has another plan or another number of shards, or is repeated, or if nothing has begun and
/// `n_shards` is 0.
SweepStatus sweep_status(const std::filesystem::path& folder, uint64_t n_shards);

Json to_json(const SweepStatus& status);
/// Returns a few lines for a terminal.
std::string to_text(const SweepStatus& status);

/// Returns "90 s", "12 min", "3.4 h".
std::string duration_text(double seconds);

}  // namespace sextant
