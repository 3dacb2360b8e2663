#include "sextant/eval/reproduce/reproduce.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/pictures/pictures.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

std::span<const EmbeddedFile> plan_files();

namespace {

std::string plan_named(const char* name) { return std::string(find_entry(plan_files(), name, "plan").text); }

/// Makes an experiment with a plan of eval/plans; `data` is the name of the data that it needs.
Part plan_part(const char* name, PartRole role, const char* plan, const char* needs = "",
               const char* data = "") {
  Part part{name, role, "", needs, paper().fetch(data), plan_named(plan)};
  part.title = json_member<std::string>(parse_json(part.plan, plan), "name", plan);
  return part;
}

/// Makes an experiment on the text files of Virtual KITTI, from the folder of the root that contains them.
Part replay_part(const char* name, PartRole role, const char* plan, const std::string& data_root) {
  Part part = plan_part(name, role, plan, "vkitti_1.3.1_text", "vkitti1_text");
  const std::filesystem::path root(data_root);
  if (data_root.empty() || std::filesystem::is_directory(root / part.needs)) return part;
  part.plan = replaced(part.plan, part.needs, "vkitti_1.3.1");
  part.needs = "vkitti_1.3.1";
  return part;
}

}  // namespace

std::vector<Part> reproduction_parts(const std::string& data_root) {
  using enum PartRole;
  std::vector<Part> parts = {
      plan_part("sets", sets, "sets"),
      plan_part("sets_release", sets_paper, "sets_release"),
      plan_part("sets_table", sets_paper, "sets_table"),
      plan_part("sets_text", sets_paper, "sets_text"),
      plan_part("attribution_release", attribution, "attribution_release"),
      plan_part("attribution_draws", attribution, "attribution_draws"),
      plan_part("attribution", attribution, "attribution"),
      plan_part("depth", noise, "depth_s18"),
      plan_part("flow", noise, "flow_s18"),
      plan_part("correlated", noise_correlated, "correlated"),
      plan_part("classification", classification, "classification"),
      {"timing", timing, "run time, scenario s18, one thread", "", "", plan_named("timing")},
      plan_part("showcase", showcase, "showcase"),
      plan_part("demo", real, "demo", "kitti_03_demo", "demo"),
      plan_part("showcase_demo", showcase, "showcase_demo", "kitti_03_demo", "demo"),
      {"recorded", recorded, "recorded trajectories on KITTI tracking", "kitti_tracking_peers",
       paper().fetch("peers"), ""},
      {"recorded_objects", recorded_objects, "DynOSAM's logs of KITTI tracking 0000", "dynosam_kitti_0000",
       paper().fetch("peers"), ""},
      replay_part("sets_replay", sets, "sets_replay", data_root),
      replay_part("sets_release_replay", sets_paper, "sets_release_replay", data_root),
      replay_part("sets_table_replay", sets_paper, "sets_table_replay", data_root),
      replay_part("sets_text_replay", sets_paper, "sets_text_replay", data_root),
      replay_part("attribution_release_replay", attribution, "attribution_release_replay", data_root),
      replay_part("attribution_draws_replay", attribution, "attribution_draws_replay", data_root),
      replay_part("attribution_replay", attribution, "attribution_replay", data_root),
      replay_part("depth_replay", noise, "depth_vkitti18", data_root),
      replay_part("flow_replay", noise, "flow_vkitti18", data_root),
      replay_part("classification_replay", classification, "classification_replay", data_root),
      plan_part("sets_vkitti1", sets, "sets_vkitti1", "vkitti_1.3.1", "vkitti1"),
      plan_part("classification_vkitti1", classification, "classification_vkitti1", "vkitti_1.3.1",
                "vkitti1"),
      plan_part("sets_vkitti2", sets, "sets_vkitti2", "vkitti_2.0.3", "vkitti2"),
      plan_part("classification_vkitti2", classification, "classification_vkitti2", "vkitti_2.0.3",
                "vkitti2"),
      {"systems_sets", sets, "published systems on the three sets", "", "", "", "sets"},
      {"systems_depth", systems_noise, "published systems under depth noise, scenario s18", "", "", "",
       "depth"},
      {"systems_demo", real, "published systems on the authors' sample of KITTI tracking 0003",
       "kitti_03_demo", paper().fetch("demo"), "", "demo"},
      {"systems_run", systems, "published systems and ours in one run", "", "", "", "sets"},
  };
  for (const std::string& sequence : recorded_sequences()) {
    Part& part = parts.emplace_back(plan_part("kitti", real, "kitti", "kitti_tracking", "kitti"));
    part.name += "_" + sequence;
    part.title = replaced(part.title, "SEQUENCE", sequence);
    part.plan = replaced(part.plan, "SEQUENCE", sequence);
  }
  return parts;
}

std::string what_is_missing(const Part& part, const std::string& data_root) {
  if (part.needs.empty()) return "";
  if (data_root.empty()) return "no data folder given (--data ROOT or SEXTANT_DATA)";
  if (!std::filesystem::is_directory(std::filesystem::path(data_root) / part.needs))
    return fmt::format("ROOT has no folder {}", part.needs);
  if (part.plan.empty()) return "";
  try {
    for (const SourceSpec& spec : parse_plan(part.plan, part.name, data_root).sources)
      check_runnable(spec, *open_source(spec));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

namespace {

/// Returns the SHA-256 of the program's file: results depend on the program, the plan and the data.
std::string program_id() {
  static const std::string id = sha256(read_file("/proc/self/exe"));
  return id;
}

/// File of an experiment that records the program and, unless a sweep keeps track of them, the inputs.
constexpr const char* stamp_name = "part.json";

Json stamp_of(const Part& part, const ReproduceConfig& config) {
  Json stamp = {{"program", program_id()}, {"plan", part.plan}};
  if (part.role == PartRole::recorded) stamp["inputs"] = recorded_inputs(config.data_root);
  if (part.role == PartRole::recorded_objects) stamp["inputs"] = recorded_object_inputs(config.data_root);
  if (part.is_stored()) {
    const fs::path truth = config.out / "parts" / part.beside / "records.jsonl";
    stamp["truth"] = fs::exists(truth) ? sha256(read_file(truth)) : "";
  }
  return stamp;
}

bool has_stamp(const fs::path& folder, const Json& stamp) {
  if (!fs::exists(folder / stamp_name)) return false;
  return try_parse_json(read_file(folder / stamp_name, json_file)) == stamp;
}

void run_sweep_part(const Part& part, const ReproduceConfig& config, const fs::path& folder) {
  SweepConfig sweep_config;
  sweep_config.plan = parse_plan(part.plan, part.name, config.data_root);
  sweep_config.out = folder;
  sweep_config.cache = config.cache;
  sweep_config.jobs = config.jobs;
  sweep_config.quiet = config.quiet;
  sweep_config.replace = true;
  sweep(sweep_config);
}

/// Returns true if the files that a run has read are unchanged according to its run.json.
bool read_the_same(const fs::path& folder) {
  try {
    return std::ranges::all_of(
        json_list(read_run_json(folder), "sources", "run.json"),
        [](const Json& source) { return same_inputs(json_object(source, "inputs", "run.json")); });
  } catch (const Error&) {
    return false;  // damaged: run again
  }
}

/// Runs an experiment whose files are all written at once, unless its records exist and the files that it
/// read are unchanged.
void run_whole_part(const fs::path& folder, const std::function<OutputFiles()>& make) {
  if (!fs::exists(folder / "records.jsonl") || !read_the_same(folder)) write_output_folder(folder, make());
}

OutputFiles make_showcase_part(const Part& part, const ReproduceConfig& config) {
  const Plan plan = parse_plan(part.plan, part.name, config.data_root);
  ShowcaseRequest request;
  request.source = plan.sources.front();
  request.frame = open_source(request.source)->info().last_frame;
  request.estimator = plan.estimators.front().name;
  request.jobs = config.jobs;
  request.quiet = config.quiet;
  return showcase_files(request);
}

/// Runs the estimators one after the other on one thread, so that stages do not share cores.
OutputFiles time_estimators(const Part& part, const ReproduceConfig& config) {
  const Plan plan = parse_plan(part.plan, part.name, config.data_root);
  OutputFiles files;
  std::string records;
  for (const PlanEstimator& estimator : plan.estimators) {
    RunConfig run_config{.sources = plan.sources, .estimator = estimator.name};
    run_config.options = {{"estimator", estimator.options}};
    run_config.jobs = 1;
    run_config.quiet = config.quiet;
    const RunResult result = run(run_config);
    records += write_records(result.records);
    files["run.json"] = json_text(run_provenance(result));
  }
  files["records.jsonl"] = std::move(records);
  return files;
}

void run_part(const Part& part, const ReproduceConfig& config, const fs::path& folder) {
  if (part.is_stored())
    return write_output_folder(folder, stored_files(part.name, config.out / "parts" / part.beside));
  switch (part.role) {
    case PartRole::recorded:
      return run_whole_part(folder, [&] { return evaluate_recorded(config.data_root); });
    case PartRole::recorded_objects:
      return run_whole_part(folder, [&] { return evaluate_recorded_objects(config.data_root); });
    case PartRole::timing:
      return run_whole_part(folder, [&] { return time_estimators(part, config); });
    case PartRole::showcase:
      return run_whole_part(folder, [&] { return make_showcase_part(part, config); });
    default:
      return run_sweep_part(part, config, folder);
  }
}

/// Progress on standard error: for each experiment a line "[3/9] flow noise, scenario s18" and, when it has
/// ended, a line "4.1 s; 6 experiments left, about 25 s".
class PartLines {
 public:
  PartLines(size_t n, bool quiet) : n_(n), quiet_(quiet) {}

  void begin(const Part& part, bool finished) {
    ++at_;
    start_ = Clock::now();
    name_ = part.name;
    if (quiet_) return;
    print_error(fmt::format("[{}/{}] {}{}\n", at_, n_, part.title, finished ? " (finished before)" : ""));
  }
  void end() {
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    total_s_ += seconds;
    times_.emplace_back(seconds, name_);
    if (quiet_) return;
    const size_t left = n_ - at_;
    const double left_s = total_s_ / static_cast<double>(at_) * static_cast<double>(left);
    print_error(fmt::format("      {:.1f} s", seconds));
    if (left > 0)
      print_error(fmt::format("; {} experiment{} left, about {:.0f} s", left, left == 1 ? "" : "s", left_s));
    print_error("\n");
  }

  /// Prints the experiments that took longest.
  void summary() {
    constexpr size_t most = 8;
    constexpr double worth_reporting_s = 0.5;
    std::ranges::stable_sort(times_, std::greater(), &std::pair<double, std::string>::first);
    std::string text;
    for (size_t i = 0; i < std::min(most, times_.size()) && times_[i].first >= worth_reporting_s; ++i)
      text += fmt::format("{}{} {:.1f} s", i > 0 ? ", " : "", times_[i].second, times_[i].first);
    if (!quiet_ && !text.empty())
      print_error(fmt::format("{} experiments in {:.1f} s: {}\n", at_, total_s_, text));
  }

 private:
  using Clock = std::chrono::steady_clock;
  size_t n_, at_ = 0;
  bool quiet_;
  std::string name_;
  std::vector<std::pair<double, std::string>> times_;
  double total_s_ = 0;
  Clock::time_point start_;
};

}  // namespace

void run_parts(const ReproduceConfig& config) {
  const FolderLock lock(config.out);
  Json data = Json::array();
  std::vector<const Part*> available;
  for (const Part& part : config.parts) {
    const std::string missing = what_is_missing(part, config.data_root);
    data.push_back({{"part", part.name},
                    {"title", part.title},
                    {"missing", missing},
                    {"needs", part.needs},
                    {"fetch", part.fetch}});
    if (missing.empty()) available.push_back(&part);
    if (!missing.empty()) fs::remove_all(config.out / "parts" / part.name);
  }
  write_file(config.out / "data.json", json_text(data));
  PartLines lines(available.size(), config.quiet);
  for (const Part* part : available) {
    const fs::path folder = make_folder_below(config.out, fs::path("parts") / part->name);
    const Json stamp = stamp_of(*part, config);
    lines.begin(*part, has_stamp(folder, stamp) && fs::exists(folder / "records.jsonl") &&
                           !fs::exists(folder / "journal.jsonl"));
    if (!has_stamp(folder, stamp)) {  // written by another program or from other inputs
      fs::remove_all(folder);
      make_folder_below(config.out, fs::path("parts") / part->name);
      write_file(folder / stamp_name, json_text(stamp));
    }
    run_part(*part, config, folder);
    lines.end();
  }
  lines.summary();
}

}  // namespace sextant
