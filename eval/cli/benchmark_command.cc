
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/benchmark/benchmark_run.h"
#include "sextant/eval/benchmark/benchmark_verification.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"

namespace sextant {
namespace {

struct BenchmarkFlags : CommonFlags {
  BenchmarkRequest request;
  std::string out, cache, plans;
  std::string shard = "0/1";
  bool dry_run = false;
};

void print_size(const BenchmarkRequest& request, const std::vector<BenchmarkPlan>& plans) {
  for (const BenchmarkPlan& plan : plans) {
    for (const BenchmarkSweep& part : plan.sweeps) {
      SweepConfig config = request.sweep;
      config.plan = part.plan;
      const SweepSize size = size_of_sweep(config);
      fmt::print("{}: {}: {} cases, {} frame pairs\n", plan.label, part.name, size.n_cases, size.n_pairs);
    }
    for (const auto& [track, reason] : plan.left_out)
      fmt::print("{}: track {}: {}\n", one_line(plan.label), track, one_line(reason));
  }
}

/// Writes the card of an estimator's folder and prints its path.
void make_card(const Suite& suite, const fs::path& folder, int jobs) {
  write_card(suite, folder, jobs);
  fmt::print("Card: {}\n", (folder / "card.html").string());
}

void benchmark(BenchmarkFlags& flags) {
  BenchmarkRequest& request = flags.request;
  request.data_root = flags.data_root;
  request.out = flags.out;
  request.only_plans = !flags.plans.empty();
  set_common(flags.cache, flags, request.sweep);
  std::tie(request.sweep.shard, request.sweep.n_shards) = shard_of(flags.shard);
  const Suite suite = find_suite(request.suite);
  const std::vector<BenchmarkPlan> plans = plan_benchmark(request, suite);
  if (flags.dry_run) return print_size(request, plans);
  if (!flags.plans.empty()) {
    for (const std::string& name : write_benchmark_plans(plans, flags.plans))
      fmt::print("{}\n", (fs::path(flags.plans) / name).string());
    return;
  }
  if (flags.out.empty()) fail("--out is missing: expected a folder for the results");
  const auto lock = lock_folder(flags.out);
  for (const BenchmarkPlan& plan : plans) {
    const fs::path folder = request.out / plan.folder;
    print_sweep(run_benchmark(request, suite, plan), folder.string(), flags);
    if (request.sweep.n_shards > 1) continue;
    make_card(suite, folder, flags.jobs);
  }
}

struct CardFlags : CommonFlags {
  std::string suite = "sextant-1";
  std::vector<std::string> folders;
  std::string out, cache;
  bool allow_mixed = false, run_external = false, all = false;
  std::optional<uint64_t> sample_seed;
};

void make_cards(const CardFlags& flags) {
  const Suite suite = find_suite(flags.suite);
  for (const std::string& folder : flags.folders) {
    const auto lock = lock_folder(folder);
    make_card(suite, folder, flags.jobs);
  }
}

void merge(const CardFlags& flags) {
  const Suite suite = find_suite(flags.suite);
  const auto lock = lock_folder(flags.out);
  const SweepOutcome outcome =
      merge_benchmarks({flags.folders.begin(), flags.folders.end()}, flags.out, flags.allow_mixed);
  for (const std::string& folder : benchmark_estimators(flags.out))
    make_card(suite, fs::path(flags.out) / folder, flags.jobs);
  if (!flags.quiet) fmt::print("{} cases, {} records\n", outcome.n_cases, outcome.n_records);
}

void make_page(const CardFlags& flags) {
  const auto lock = lock_folder(flags.out);
  write_output_folder(flags.out, page_files({flags.folders.begin(), flags.folders.end()}, flags.suite,
                                            flags.out, flags.jobs));
  fmt::print("Page: {}\n", (fs::path(flags.out) / "index.html").string());
}

void verify(const CardFlags& flags) {
  VerifyOptions options{.suite = flags.suite,
                        .run_external = flags.run_external,
                        .all = flags.all,
                        .sample_seed = flags.sample_seed,
                        .data_root = flags.data_root};
  options.sweep.cache = pack_cache(flags.cache);
  options.sweep.jobs = flags.jobs;
  for (const std::string& folder : flags.folders) {
    for (const std::string& line : verify_benchmark(folder, options)) fmt::print("{}\n", line);
    fmt::print("{}: verified\n", folder);
  }
}

void compare(const CardFlags& flags) {
  const fs::path folder = flags.folders.at(0);
  const Suite suite = suite_of(stored_card(folder), flags.suite, folder);
  const Table table = comparison_table(compare_benchmarks(suite, folder, flags.folders.at(1)), suite);
  fmt::print("{}", flags.json ? rows_to_json_text(table) : screen_text(table));
}

/// Adds a subcommand that takes folders of estimators and runs `part`.
FlaggedCommand<CardFlags> add_part(CLI::App& benchmark, const std::string& name, const std::string& help,
                                   const std::string& folders, void (*part)(const CardFlags&)) {
  const auto added = add_command<CardFlags>(benchmark, name, help, part);
  add_value(added.command, "dir", added.flags.folders, folders,
            "Folders of estimators: OUT/ESTIMATOR of a benchmark")
      ->required();
  return added;
}

void add_suite_flag(CLI::App& command, std::string& suite) {
  add_value(command, "--suite", suite, "NAME", "A suite of this program, or a file NAME.json")
      ->capture_default_str();
}

/// Adds --suite for commands on cards, which name their suite.
void add_suite_of_cards_flag(CLI::App& command, std::string& suite) {
  suite.clear();
  add_value(command, "--suite", suite, "NAME.json", "The suite, where it does not come with this program");
}

void add_card_command(CLI::App& benchmark) {
  auto [command, flags] =
      add_part(benchmark, "card", "Write the card of finished sweeps again", "DIR", make_cards);
  add_suite_flag(command, flags.suite);
  add_jobs_flag(command, flags);
  command.footer("Example:\n  sextant benchmark card out/joint_flow");
}

void add_benchmark_merge_command(CLI::App& benchmark) {
  auto [command, flags] =
      add_part(benchmark, "merge", "Join the shards of a benchmark, and write the cards", "SHARD", merge);
  add_suite_flag(command, flags.suite);
  add_value(command, "--out", flags.out, "DIR", "Folder for the results")->required();
  command.add_flag("--allow-mixed", flags.allow_mixed,
                   "Join shards of different versions; run.json names them");
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No summary");
  command.footer("Example:\n  sextant benchmark merge shard1 shard2 --out out");
}

void add_page_command(CLI::App& benchmark) {
  auto [command, flags] = add_part(benchmark, "page", "One page of several cards", "CARD", make_page);
  add_value(command, "--out", flags.out, "DIR",
            "Folder for index.html, and performance_profile.svg of several cards")
      ->required();
  add_suite_of_cards_flag(command, flags.suite);
  add_jobs_flag(command, flags);
  command.footer("Example:\n  sextant benchmark page out/joint_flow out/my_estimator --out site");
}

void add_verify_command(CLI::App& benchmark) {
  auto [command, flags] = add_part(
      benchmark, "verify", "Check a submitted card against its records, and run a sample of its cases again",
      "DIR", verify);
  add_suite_of_cards_flag(command, flags.suite);
  command.add_flag(
      "--run-external", flags.run_external,
      "Also run cases of external programs again: starts the command of the recorded configuration");
  command.add_flag("--all", flags.all, "Run every case again, not only a sample");
  add_value(command, "--sample-seed", flags.sample_seed, "N",
            "Draw the sample of an earlier verification, which printed N");
  add_cache_flag(command, flags.cache);
  add_data_flag(command, flags);
  add_jobs_flag(command, flags);
  command.footer("Example:\n  sextant benchmark verify out/my_estimator");
}

void add_benchmark_compare_command(CLI::App& benchmark) {
  auto [command, flags] = add_part(
      benchmark, "compare", "Paired tests of one estimator against another, track by track", "DIR", compare);
  command.get_option("dir")->expected(2);
  add_suite_of_cards_flag(command, flags.suite);
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer("Example:\n  sextant benchmark compare out/my_estimator results/benchmark/joint_flow");
}

}  // namespace

void add_benchmark_command(CLI::App& app) {
  auto [command, flags] = add_command<BenchmarkFlags>(
      app, "benchmark",
      "Run a standard suite of noise, outliers and motion through estimators, and write a card of each",
      [](BenchmarkFlags& given, const CLI::App& given_command) {
        if (given_command.get_subcommands().empty()) benchmark(given);
      });
  BenchmarkRequest& request = flags.request;
  add_value(command, "estimator", request.estimators, "ESTIMATOR",
            "joint_flow, external:CONFIG.json, ... (sextant options lists them)");
  add_suite_flag(command, request.suite);
  add_value(command, "--tracks", request.tracks, "A,B,...", "Only these tracks of the suite")->delimiter(',');
  command.add_flag("--quick", request.quick,
                   "Only the first seed and few levels: minutes, not for publication");
  add_value(command, "--out", flags.out, "DIR",
            "Folder for the results; an unfinished benchmark in it is resumed");
  add_value(command, "--shard", flags.shard, "I/N", "Only the I-th of N equal shares of every sweep")
      ->capture_default_str();
  command.add_flag("--dry-run", flags.dry_run, "Print how many cases there are; runs and writes nothing");
  add_value(command, "--plans", flags.plans, "DIR",
            "Only write the plan of each sweep there, for `sextant sweep` and scripts/slurm_sweep");
  add_cache_flag(command, flags.cache);
  command.add_flag("--reuse-stale", request.sweep.reuse_stale,
                   "Keep finished cases of another version of an external or Python estimator");
  command.add_flag("--force", request.sweep.force, "Start over: first remove the sweeps that --out holds");
  add_jobs_flag(command, flags);
  add_data_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress and no summary");
  command.footer(
      "Ctrl-C or a crash loses no finished case: give the same command again.\n"
      "Examples:\n  sextant benchmark joint_flow --quick --out out\n"
      "  sextant benchmark external:my_estimator.json --out out");
  for (auto* const add : {add_card_command, add_benchmark_merge_command, add_page_command, add_verify_command,
                          add_benchmark_compare_command})
    add(command);
}

}  // namespace sextant
