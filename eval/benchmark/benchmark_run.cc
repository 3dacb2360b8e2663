#include "sextant/eval/benchmark/benchmark_run.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/new_file.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"

namespace sextant {
namespace {

/// Makes the plans of an estimator, track by track; throws the exceptions of parse_plan().
std::vector<BenchmarkSweep> sweeps_of(const BenchmarkRequest& request, const Suite& suite,
                                      const SuiteTrack& track, const std::string& estimator) {
  std::vector<BenchmarkSweep> sweeps;
  // The plan of an estimator of Python is checked with one of ours that has its label.
  Json present = estimator;
  if (request.only_plans && estimator.starts_with(python_prefix))
    present = {{"name", "joint_flow"}, {"label", estimator.substr(python_prefix.size())}};
  for (const SuiteSweep& sweep : track.sweeps) {
    std::string text = plan_text(suite, track, sweep, estimator, request.quick);
    if (text.empty()) continue;
    Plan plan = parse_plan(plan_text(suite, track, sweep, present, request.quick),
                           suite.name + ": " + sweep.name, request.data_root);
    sweeps.push_back({sweep.name, std::move(text), std::move(plan)});
  }
  return sweeps;
}

constexpr std::string_view not_requested = "not requested", no_part = "no part of a quick run",
                           no_data = "its data are not there", unusable_data = "its data cannot be used: ";

/// Returns true if plan_of() gives this reason for leaving out a track.
bool is_own_reason(std::string_view reason) {
  return reason == not_requested || reason == no_part || reason == no_data ||
         reason.starts_with(unusable_data);
}

/// Moves tracks from `left_out` to the sweeps of the plan if the folder holds all their sweeps, finished by
/// an earlier command. The card shows them, too, so sweep() must check that data and estimator are unchanged.
void add_finished(const BenchmarkRequest& request, const Suite& suite, const std::string& estimator,
                  BenchmarkPlan& plan) {
  const auto is_finished = [&](const auto& sweep) {
    return is_finished_sweep(request.out / plan.folder / sweep.name);
  };
  for (const SuiteTrack& track : suite.tracks) {
    if (!plan.left_out.contains(track.name) || std::ranges::none_of(track.sweeps, is_finished)) continue;
    std::vector<BenchmarkSweep> sweeps = sweeps_of(request, suite, track, estimator);
    if (sweeps.empty() || !std::ranges::all_of(sweeps, is_finished)) continue;
    plan.left_out.erase(track.name);
    for (BenchmarkSweep& sweep : sweeps) {
      sweep.was_finished = true;
      plan.sweeps.push_back(std::move(sweep));
    }
  }
}

BenchmarkPlan plan_of(const BenchmarkRequest& request, const Suite& suite, const std::string& estimator) {
  BenchmarkPlan plan;
  for (const SuiteTrack& track : suite.tracks) {
    const bool by_name = std::ranges::find(request.tracks, track.name) != request.tracks.end();
    if (!request.tracks.empty() && !by_name) {
      plan.left_out[track.name] = not_requested;
      continue;
    }
    try {
      std::vector<BenchmarkSweep> sweeps = sweeps_of(request, suite, track, estimator);
      if (sweeps.empty()) plan.left_out[track.name] = no_part;
      std::ranges::move(sweeps, std::back_inserter(plan.sweeps));
    } catch (const Error& error) {
      if (by_name || !track.needs_data) throw;
      plan.left_out[track.name] =
          request.data_root.empty() ? std::string(no_data) : fmt::format("{}{}", unusable_data, error.what());
    }
  }
  if (plan.sweeps.empty()) fail("suite {}: no track of it is left to run", suite.name);
  plan.label = plan.sweeps.front().plan.estimators.front().label;
  plan.folder = safe_file_name(plan.label);
  if (!request.out.empty()) add_finished(request, suite, estimator, plan);
  return plan;
}

}  // namespace

std::vector<BenchmarkPlan> plan_benchmark(const BenchmarkRequest& request, const Suite& suite) {
  for (const std::string& name : request.tracks) suite.track(name);
  std::vector<BenchmarkPlan> plans;
  for (const std::string& estimator : request.estimators) {
    plans.push_back(plan_of(request, suite, estimator));
    const auto same = std::ranges::count(plans, plans.back().folder, &BenchmarkPlan::folder);
    if (same > 1) fail("estimator '{}' is given twice", plans.back().label);
  }
  if (plans.empty()) fail("no estimator: expected a name, external:CONFIG.json or python:NAME");
  return plans;
}

namespace {

/// Brings left_out.json of the folder up to date. A reason that the user wrote there is kept, unless the
/// track is requested by name.
void write_left_out(const BenchmarkRequest& request, const Suite& suite, const BenchmarkPlan& plan) {
  const fs::path folder = request.out / plan.folder;
  std::map<std::string, std::string> reasons = plan.left_out;
  for (const auto& [track, reason] : left_out_of(suite, folder)) {
    if (!is_own_reason(reason) && std::ranges::find(request.tracks, track) == request.tracks.end())
      reasons[track] = reason;
  }
  if (reasons.empty())
    fs::remove(folder / left_out_name);
  else
    write_output_folder(folder, {{left_out_name, json_text(Json(reasons))}});
}

}  // namespace

SweepOutcome run_benchmark(const BenchmarkRequest& request, const Suite& suite, const BenchmarkPlan& plan) {
  SweepOutcome all;
  for (const BenchmarkSweep& part : plan.sweeps) {
    SweepConfig config = request.sweep;
    config.plan = part.plan;
    config.out = make_folder_below(request.out, fs::path(plan.folder) / part.name);
    config.force = config.force && !part.was_finished;
    const SweepOutcome outcome = sweep(config);
    all.n_cases += outcome.n_cases;
    all.n_before += outcome.n_before;
    all.n_stale += outcome.n_stale;
    all.n_records += outcome.n_records;
    all.wall_time_s += outcome.wall_time_s;
    std::ranges::copy(outcome.problems, std::back_inserter(all.problems));
  }
  write_left_out(request, suite, plan);
  return all;
}

void write_card(const Suite& suite, const fs::path& folder, int jobs) {
  write_output_folder(folder, card_files(make_card(suite, folder), suite, jobs));
}

std::vector<std::string> write_benchmark_plans(const std::vector<BenchmarkPlan>& plans, const fs::path& out) {
  OutputFiles files;
  std::vector<std::string> names;
  for (const BenchmarkPlan& plan : plans) {
    for (const BenchmarkSweep& part : plan.sweeps) {
      names.push_back(fmt::format("{}/{}.json", plan.folder, part.name));
      files[names.back()] = part.text;
    }
  }
  write_output_folder(out, files);
  return names;
}

SweepOutcome merge_benchmarks(const std::vector<fs::path>& shards, const fs::path& out, bool allow_mixed) {
  SweepOutcome all;
  const std::vector<fs::path> sweeps = benchmark_sweeps(shards.front());
  for (const fs::path& shard : shards) {
    if (benchmark_sweeps(shard) != sweeps)
      fail("{}: its sweeps differ from those of {}: a shard is unfinished or belongs to another request",
           shard.string(), shards.front().string());
  }
  for (const fs::path& sweep : sweeps) {
    std::vector<fs::path> folders;
    for (const fs::path& shard : shards) folders.push_back(shard / sweep);
    const SweepOutcome outcome = merge_sweeps(folders, make_folder_below(out, sweep), allow_mixed);
    all.n_cases += outcome.n_cases;
    all.n_records += outcome.n_records;
  }
  return all;
}

std::vector<fs::path> benchmark_sweeps(const fs::path& folder) {
  std::vector<fs::path> sweeps;
  std::error_code error;
  for (const auto& estimator : fs::directory_iterator(folder, error)) {
    if (!estimator.is_directory(error)) continue;
    for (const auto& sweep : fs::directory_iterator(estimator.path(), error)) {
      if (fs::exists(sweep.path() / "plan.json", error))
        sweeps.push_back(estimator.path().filename() / sweep.path().filename());
    }
  }
  if (sweeps.empty())
    fail(
        "{}: holds no sweeps of a benchmark: expected the folder that was given to `sextant benchmark --out`",
        folder.string());
  std::ranges::sort(sweeps);
  return sweeps;
}

std::vector<std::string> benchmark_estimators(const fs::path& folder) {
  std::vector<std::string> estimators;
  for (const fs::path& sweep : benchmark_sweeps(folder)) {
    const std::string estimator = sweep.begin()->string();
    if (estimators.empty() || estimators.back() != estimator) estimators.push_back(estimator);
  }
  return estimators;
}

}  // namespace sextant
