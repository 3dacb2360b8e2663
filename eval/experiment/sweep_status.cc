#include "sextant/eval/experiment/sweep.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include "sextant/base/error.h"
#include "sextant/base/file_lock.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/case_summary.h"

namespace sextant {
namespace {

/// Returns the folders of the shards, ordered by name.
std::vector<fs::path> shard_folders(const fs::path& folder) {
  const fs::path parent = fs::is_directory(folder / "shards") ? folder / "shards" : folder;
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(parent)) {
    if (entry.is_directory() && fs::exists(entry.path() / "plan.json")) found.push_back(entry.path());
  }
  std::ranges::sort(found);
  return found;
}

/// Returns the number of finished cases: lines that begin with {"case": in the journal and in cases.jsonl.
uint64_t count_cases(const fs::path& file) {
  if (file.filename() == summary_file_name) return SummaryReader(file).n_cases();
  std::ifstream stream(file);
  uint64_t n = 0;
  for (std::string line; std::getline(stream, line);) n += line.starts_with("{\"case\":") ? 1 : 0;
  return n;
}

double seconds_between(const fs::path& from, const fs::path& to) {
  std::error_code error;
  const auto begin = fs::last_write_time(from, error);
  const auto end = fs::last_write_time(to, error);
  return error ? 0 : std::max(0.0, std::chrono::duration<double>(end - begin).count());
}

ShardStatus read_shard(const fs::path& folder, uint64_t number) {
  ShardStatus shard;
  shard.number = number;
  const fs::path journal = folder / "journal.jsonl";
  const bool open = fs::exists(journal);
  const char* index = fs::exists(folder / summary_file_name) ? summary_file_name : "cases.jsonl";
  const fs::path file = open ? journal : folder / index;
  shard.cases_done = count_cases(file) + (open ? FinishedCases::count(folder) : 0);
  shard.seconds = seconds_between(folder / "plan.json", file);
  if (is_finished_sweep(folder)) {
    shard.state = ShardStatus::State::done;
  } else {
    const bool is_free = !open || FileLock::take(journal).has_value();
    shard.state = is_free ? ShardStatus::State::stopped : ShardStatus::State::running;
  }
  return shard;
}

}  // namespace

uint64_t SweepStatus::count(ShardStatus::State state) const {
  return static_cast<uint64_t>(std::ranges::count(shards, state, &ShardStatus::state));
}

uint64_t SweepStatus::cases_done() const {
  uint64_t n = 0;
  for (const ShardStatus& shard : shards) n += shard.cases_done;
  return n;
}

std::optional<double> SweepStatus::remaining_s() const {
  double seconds = 0;
  for (const ShardStatus& shard : shards) seconds += shard.seconds;
  if (cases_done() == 0 || n_cases < cases_done()) return std::nullopt;
  const auto at_once = static_cast<double>(std::max<uint64_t>(1, count(ShardStatus::State::running)));
  return static_cast<double>(n_cases - cases_done()) * seconds / static_cast<double>(cases_done()) / at_once;
}

std::string SweepStatus::to_submit(const std::set<uint64_t>& except) const {
  std::vector<uint64_t> numbers;
  for (const ShardStatus& shard : shards) {
    const bool open =
        shard.state == ShardStatus::State::missing || shard.state == ShardStatus::State::stopped;
    if (open && !except.contains(shard.number)) numbers.push_back(shard.number);
  }
  return fmt::format("{}", fmt::join(ranges_of(numbers), ","));
}

SweepStatus sweep_status(const fs::path& folder, uint64_t n_shards) {
  if (!fs::is_directory(folder)) fail("{}: expected the folder of a sweep in shards", folder.string());
  SweepStatus status;
  Json plan;
  fs::path of_plan;
  std::map<uint64_t, fs::path> begun;
  for (const fs::path& shard : shard_folders(folder)) {
    const fs::path file = shard / "plan.json";
    const Json json = read_plan_file(shard);
    const auto [number, n] = shard_number(json, file.string());
    if (n_shards == 0) n_shards = n;
    if (n != n_shards)
      fail("{}: belongs to a sweep in {} shards, expected one in {}", shard.string(), n, n_shards);
    if (plan.is_null()) {
      plan = json["plan"];
      of_plan = shard;
      status.n_cases = planned_cases(plan, file.string());
    }
    if (plan_key(json["plan"]) != plan_key(plan))
      fail("{}: holds a shard of another plan than {}: expected shards of one sweep", shard.string(),
           of_plan.string());
    if (!begun.emplace(number, shard).second)
      fail("{}: shard {} is also in {}: expected each shard once", shard.string(), number,
           begun.at(number).string());
  }
  if (n_shards == 0) {
    fail(
        "{}: no shard has begun here; give --shards N, or begin one: sextant sweep PLAN.json --shard 1/N "
        "--out {}",
        folder.string(), (folder / "shards" / "1").string());
  }
  for (uint64_t number = 1; number <= n_shards; ++number) {
    const auto shard = begun.find(number);
    status.shards.push_back(shard == begun.end() ? ShardStatus{number} : read_shard(shard->second, number));
  }
  return status;
}

Json to_json(const SweepStatus& status) {
  Json shards = Json::array();
  for (const ShardStatus& shard : status.shards) {
    shards.push_back(
        {{"shard", shard.number}, {"state", to_string(shard.state)}, {"cases_done", shard.cases_done}});
  }
  Json json = {
      {"cases", status.n_cases}, {"cases_done", status.cases_done()}, {"to_submit", status.to_submit()}};
  if (const auto seconds = status.remaining_s()) json["remaining_s"] = *seconds;
  json["shards"] = std::move(shards);
  return json;
}

std::string to_text(const SweepStatus& status) {
  using State = ShardStatus::State;
  std::string text = fmt::format("shards  {} of {} done", status.count(State::done), status.shards.size());
  for (const State state : {State::running, State::stopped, State::missing}) {
    if (const uint64_t n = status.count(state)) text += fmt::format(", {} {}", n, to_string(state));
  }
  if (status.n_cases > 0) text += fmt::format("\ncases   {} of {} done", status.cases_done(), status.n_cases);
  const auto seconds = status.remaining_s();
  if (seconds && status.cases_done() < status.n_cases)
    text += fmt::format(", about {} left", duration_text(*seconds));
  if (const std::string open = status.to_submit(); !open.empty())
    text += fmt::format("\nsubmit  --array={}   (missing and stopped)", open);
  return text + "\n";
}

std::string duration_text(double seconds) {
  if (seconds < 120) return fmt::format("{:.0f} s", seconds);
  if (seconds < 7200) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace sextant
