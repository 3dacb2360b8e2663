#pragma once

// Progress of a sweep in shards, from the folders of its shards only: DIR/shards/NAME, or DIR/NAME if there
// is no DIR/shards, each with the plan.json of a sweep. Nothing is written and no source is read.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/base/names.h"

namespace sextant {

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
