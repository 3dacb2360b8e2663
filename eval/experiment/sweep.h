#pragma once

// Runs the cases of a plan from packs into a folder that can be resumed at any case:
//
//   plan.json      the plan with every default spelled out, the shard, the content of its packs, and the
//                  fingerprints of
//                  estimators that are no part of Sextant (records/fingerprint.h)
//   journal.jsonl  while it runs: per finished case one line {"case","records","sha256"} and the records, or
//                  {"case","bytes","sha256"} and the summary. A block that was cut off (kill -9, full disk)
//                  is dropped on resuming, and its case done again
//   .finished/     while it runs with "keep": "summary": what the journal held when it had grown to
//                  journal_bytes (case_results.h)
//   records.jsonl  at the end: all records in order of case
//   cases.jsonl    per case {"case","records"}: how many lines are its own; with noise "noise", the sums of
//                  what was added (as in the journal)
//   summary.bin    with "keep": "summary" instead of these two (records/case_summary.h)
//   external/      what external estimators leave, a folder per case
//   run.json       provenance, fingerprints and, per source and level, the noise that was asked for and
//                  achieved in the
//                  cases of the folder
//
// The bytes of records.jsonl (times apart) and of summary.bin do not depend on jobs, interruptions or shards:
// shard I of N takes its cases_of_shard() (0..N-1 and 1..N both name all shards), and merge_sweeps() puts
// them back in order.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

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
  /// The folder of a finished sweep of the same cases: what external programs left there is read again
  /// instead of running them. Empty: they run.
  std::filesystem::path rescored;
  bool allow_mixed = false;  ///< resumes what another version of the program began; run.json names both
  uint64_t journal_bytes = uint64_t{32} << 20U;  ///< of summaries, before they are moved out of it
  bool replace = false;  ///< a sweep of another plan, shard or data in the folder is removed, not refused
  bool force = false;    ///< starts over: whatever sweep the folder holds is removed first
  /// Finished cases of another version of an estimator (sweep_folder.h) are kept, not run again.
  bool reuse_stale = false;
  /// Takes a line about stale cases, which the user is to see also when `quiet`; may be empty.
  std::function<void(const std::string& line)> tell;
};

struct SweepOutcome {
  uint64_t n_cases = 0;   ///< of this shard
  uint64_t n_before = 0;  ///< of them, done by an earlier run
  uint64_t n_stale =
      0;  ///< finished before by another version of an estimator: run again, or kept with reuse_stale
  uint64_t n_records = 0;
  double wall_time_s = 0;             ///< of the cases done now, packs apart
  std::vector<std::string> problems;  ///< of the estimators in the cases done now, in order of case
};

/// {"out", "cases", "cases_before", "cases_stale", "records", "problems", "wall_time_s"} of the sweep in
/// `out`.
Json to_json(const SweepOutcome& outcome, const std::filesystem::path& out);

/// Throws Error when the folder holds another plan, shard or data, is in use, or cannot be written (what is
/// done stays); Interrupted on Ctrl-C (resumable). Finished cases whose estimator has another fingerprint now
/// are run again; summaries of a finished sweep cannot be taken apart, so that all its cases are.
SweepOutcome sweep(const SweepConfig& config);

struct SweepSize {
  uint64_t n_cases = 0;
  uint64_t n_pairs = 0;  ///< frame pairs over all cases
};
/// How much sweep() would do. Sources are opened; no case is run, no external program started and nothing
/// written.
SweepSize size_of_sweep(const SweepConfig& config);

/// Makes the packs that the cases of sweep() run from, and nothing else.
void make_packs(const SweepConfig& config);

/// Joins the finished shards of one plan. Throws Error when plans or data differ, or versions of the program
/// or of an estimator unless `allow_mixed`; when a case is missing or there twice. The shards are read along,
/// not held: memory grows with the number of cases only. run.json has the provenance of every shard.
SweepOutcome merge_sweeps(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& out,
                          bool allow_mixed = false, bool quiet = true);

}  // namespace sextant
