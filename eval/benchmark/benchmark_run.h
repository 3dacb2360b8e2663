#pragma once

// Runs a suite: the sweeps of its tracks, each an ordinary sweep (experiment/sweep.h) in its own folder.
//
//   OUT/<estimator>/<sweep>/            plan.json, records.jsonl, cases.jsonl, run.json
//   OUT/<estimator>/left_out.json       tracks that did not run, with the reason; only if there are any
//   OUT/<estimator>/card.json .md .html (card.h), written when all sweeps are finished
//
// <estimator> is the label of the estimator, converted to a file name.

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/experiment/sweep.h"

namespace sextant {

struct BenchmarkRequest {
  std::string suite = "sextant-1";      ///< name of a suite, or NAME.json
  std::vector<std::string> estimators;  ///< "joint_flow", "external:CONFIG.json", "python:NAME"
  std::vector<std::string> tracks;      ///< tracks to run; empty: all
  bool quick = false;
  bool only_plans = false;  ///< nothing is run: estimators of Python need not exist
  std::string data_root;
  std::filesystem::path out;
  SweepConfig sweep;  ///< cache, shard, jobs and the like; plan and out are set for each sweep
};

/// A sweep of the suite for one estimator, ready to run.
struct BenchmarkSweep {
  std::string name;
  std::string text;  ///< the plan as text, for `sextant sweep` and scripts/slurm_sweep
  Plan plan;
  /// An earlier command finished it and this one does not request it: it only runs again if it is stale
  bool was_finished = false;
};

struct BenchmarkPlan {
  std::string label;   ///< label of the estimator
  std::string folder;  ///< name of the folder below OUT
  std::vector<BenchmarkSweep> sweeps;
  std::map<std::string, std::string> left_out;  ///< reason for each track that does not run
};

/// Returns one plan per estimator. Throws Error on an unknown track or estimator, and if no track is left to
/// run. A track with `needs_data` is left out if its data are missing, unless it is requested by name. Tracks
/// that are finished in `out` belong to the plan, requested or not; throws Error if their data are missing.
std::vector<BenchmarkPlan> plan_benchmark(const BenchmarkRequest& request, const Suite& suite);

/// Runs the sweeps of one estimator, or resumes them, and updates left_out.json. Throws the exceptions of
/// sweep().
SweepOutcome run_benchmark(const BenchmarkRequest& request, const Suite& suite, const BenchmarkPlan& plan);

/// Writes card.json, card.md and card.html of the sweeps in FOLDER into FOLDER.
void write_card(const Suite& suite, const std::filesystem::path& folder, int jobs);

/// Writes OUT/<estimator>/<sweep>.json for every sweep and returns the names of these files.
std::vector<std::string> write_benchmark_plans(const std::vector<BenchmarkPlan>& plans,
                                               const std::filesystem::path& out);

/// Returns <estimator>/<sweep> of all sweeps below OUT, sorted. Throws Error if there are none.
std::vector<std::filesystem::path> benchmark_sweeps(const std::filesystem::path& folder);

/// Returns each <estimator> of benchmark_sweeps() once, sorted.
std::vector<std::string> benchmark_estimators(const std::filesystem::path& folder);

/// Joins the folders of shards (OUT of `--shard I/N`) sweep by sweep (merge_sweeps()). Throws Error like
/// merge_sweeps(), and if the shards do not have the same sweeps.
SweepOutcome merge_benchmarks(const std::vector<std::filesystem::path>& shards,
                              const std::filesystem::path& out, bool allow_mixed);

}  // namespace sextant
