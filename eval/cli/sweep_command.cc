#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/experiment/sweep.h"

namespace sextant {
namespace {

struct SweepFlags : CommonFlags {
  std::string plan;
  std::string out;
  std::string cache;
  std::string shard = "0/1";
  bool dry_run = false;
  bool packs_only = false;
  SweepConfig config;
};

void run_sweep(SweepFlags& flags) {
  if (flags.plan.empty()) fail("PLAN.json is missing: see sextant sweep --help");
  SweepConfig& config = flags.config;
  config.plan = parse_plan(read_file(flags.plan, json_file), flags.plan, flags.data_root);
  config.out = flags.out;
  set_common(flags.cache, flags, config);
  std::tie(config.shard, config.n_shards) = shard_of(flags.shard);
  if (flags.dry_run) {
    const SweepSize size = size_of_sweep(config);
    if (flags.json) {
      print_json(Json{{"cases", size.n_cases}, {"pairs", size.n_pairs}, {"estimated_s", nullptr}});
    } else {
      fmt::print("{} cases, {} frame pairs; nothing was run, so the time is unknown\n", size.n_cases,
                 size.n_pairs);
    }
    return;
  }
  if (flags.packs_only) {
    make_packs(config);
    if (!flags.quiet) fmt::print("Correspondence caches: {}\n", config.cache.folder().string());
    return;
  }
  if (flags.out.empty()) fail("--out is missing: expected a folder for the results");
  print_sweep(sweep(config), flags.out, flags);
}

struct StatusFlags {
  std::string folder;
  uint64_t n_shards = 0;
  bool json = false, only_missing = false;
  std::vector<uint64_t> except;
};

void print_status(const StatusFlags& flags) {
  const SweepStatus status = sweep_status(flags.folder, flags.n_shards);
  if (flags.only_missing) {
    fmt::print("{}\n", status.to_submit({flags.except.begin(), flags.except.end()}));
  } else {
    fmt::print("{}", flags.json ? json_text(to_json(status)) : to_text(status));
  }
}

void add_sweep_status_command(CLI::App& sweep) {
  auto [command, flags] = add_command<StatusFlags>(
      sweep, "status", "Show the progress of a sweep in shards, and its missing shards", print_status);
  command.add_option("dir", flags.folder, "Folder with the shards' folders, or with shards/")
      ->required()
      ->type_name("DIR");
  add_value(command, "--shards", flags.n_shards, "N",
            "Number of shards (default: as recorded by the shards that have begun)");
  command.add_flag("--missing", flags.only_missing,
                   "Print only missing and stopped shards, as sbatch --array takes them");
  add_value(command, "--except", flags.except, "I,J,...", "Shards to leave out of this list")->delimiter(',');
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer(
      "Examples:\n  sextant sweep status out\n  sbatch --array=$(sextant sweep status out --missing) "
      "shard.sh");
}

struct MergeFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string out;
  bool allow_mixed = false;
};

void run_merge(const MergeFlags& flags) {
  const SweepOutcome outcome = merge_sweeps({flags.folders.begin(), flags.folders.end()},
                                            std::filesystem::path(flags.out), flags.allow_mixed, flags.quiet);
  if (!flags.quiet) fmt::print("{} cases, {} records\n", outcome.n_cases, outcome.n_records);
  fmt::print("Results: {}\n", flags.out);
}

}  // namespace

std::pair<uint64_t, uint64_t> shard_of(const std::string& text) {
  const std::vector<std::string> parts = split(text, '/');
  const auto number = whole_number<uint64_t>(parts.front()), n = whole_number<uint64_t>(parts.back());
  if (parts.size() != 2 || !number || !n) fail("--shard {}: expected I/N, for example 1/4", text);
  return {*number, *n};
}

void set_common(const std::string& cache, const CommonFlags& flags, SweepConfig& config) {
  config.cache = pack_cache(cache);
  config.jobs = flags.jobs;
  config.quiet = flags.quiet;
  config.on_message = [](const std::string& line) { print_message("note", line); };
}

void print_sweep(const SweepOutcome& outcome, const std::string& out, const CommonFlags& flags) {
  if (!flags.quiet) warn_of_problems(outcome.problems);
  const uint64_t n_now = outcome.n_cases - outcome.n_before;
  if (flags.json) {
    print_json(to_json(outcome, out));
    return;
  }
  if (!flags.quiet) {
    fmt::print("{} cases, {} of them done before; {} records; {:.1f} s ({:.1f} cases/s)\n", outcome.n_cases,
               outcome.n_before, outcome.n_records, outcome.wall_time_s,
               outcome.wall_time_s > 0 ? static_cast<double>(n_now) / outcome.wall_time_s : 0.0);
  }
  fmt::print("Results: {}\n", out);
}

void add_sweep_command(CLI::App& app) {
  auto [command, flags] =
      add_command<SweepFlags>(app, "sweep", "Run a plan: sources x estimators x noise levels x seeds",
                              [](SweepFlags& given, const CLI::App& given_command) {
                                if (given_command.get_subcommands().empty()) run_sweep(given);
                              });
  add_value(command, "plan", flags.plan, "PLAN.json", "JSON file; see docs/sweeps.md and eval/plans/");
  add_value(command, "--out", flags.out, "DIR",
            "Folder for the results; an unfinished sweep in it is resumed");
  add_value(command, "--shard", flags.shard, "I/N", "Only the I-th of N equal shares; a folder per shard")
      ->capture_default_str();
  command.add_flag("--dry-run", flags.dry_run,
                   "Print how many cases and frame pairs there are; runs and writes nothing");
  command.add_flag("--packs-only", flags.packs_only, "Decode the sources into the cache and run no case");
  add_cache_flag(command, flags.cache);
  command.add_flag("--allow-mixed", flags.config.allow_mixed,
                   "Continue a sweep that another version of Sextant began; run.json names both");
  command.add_flag(
      "--reuse-stale", flags.config.reuse_stale,
      "Keep finished cases of another version of an external or Python estimator, instead of running them "
      "again");
  command.add_flag("--force", flags.config.force, "Start over: first remove the sweep that --out holds");
  add_jobs_flag(command, flags);
  add_data_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress and no summary");
  command.add_flag("--json", flags.json, "Print the summary as JSON");
  command.footer(
      "Ctrl-C or a crash loses no finished case: give the same command again.\n"
      "Examples:\n  sextant sweep eval/plans/depth_s18.json --out out\n"
      "  sextant sweep eval/plans/depth_s18.json --shard 1/4 --out part1   (and 2/4 .. 4/4, then merge)");
  add_sweep_status_command(command);
}

void add_merge_command(CLI::App& app) {
  auto [command, flags] = add_command<MergeFlags>(app, "merge", "Join the shards of a sweep", run_merge);
  add_value(command, "dir", flags.folders, "DIR", "Folders of finished shards")->required();
  add_value(command, "--out", flags.out, "DIR", "Folder for the results")->required();
  command.add_flag("--allow-mixed", flags.allow_mixed,
                   "Join shards of different versions of Sextant or of an estimator; run.json names them");
  command.add_flag("--quiet", flags.quiet, "No summary");
  command.footer("Example:\n  sextant merge part1 part2 part3 part4 --out out");
}

}  // namespace sextant
