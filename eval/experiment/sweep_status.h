#pragma once

// How far a sweep in shards is, from the folders of its shards alone: DIR/shards/NAME, or DIR/NAME where
// there is no DIR/shards, each with the plan.json of a sweep. Nothing is written and no source is read.

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
  enum class State { missing, stopped, running, done };  ///< stopped: begun, and no process writes it

  uint64_t number = 0;  ///< 1..N
  State state = State::missing;
  uint64_t cases_done = 0;
  double seconds = 0;  ///< from its beginning to its last case
};

constexpr Names<4> names_of(ShardStatus::State) { return {"missing", "stopped", "running", "done"}; }

struct SweepStatus {
  uint64_t n_cases = 0;  ///< of the whole plan; 0 as long as no shard has begun
  std::vector<ShardStatus> shards;

  uint64_t count(ShardStatus::State state) const;
  uint64_t cases_done() const;
  /// Of the cases that are not done, by the time that those done took, as many at once as run now (one if
  /// none does).
  std::optional<double> remaining_s() const;
  /// Missing and stopped shards but `except`, as `sbatch --array` takes them: "3,8-9"; empty for none.
  std::string to_submit(const std::set<uint64_t>& except = {}) const;
};

/// `n_shards` 0: as the shards that have begun say. Throws Error when a shard is of another plan or another
/// number of shards, is there twice, or when nothing has begun and `n_shards` is 0.
SweepStatus sweep_status(const std::filesystem::path& folder, uint64_t n_shards);

Json to_json(const SweepStatus& status);
/// A few lines for a terminal.
std::string to_text(const SweepStatus& status);

/// "90 s", "12 min", "3.4 h".
std::string duration_text(double seconds);

}  // namespace sextant
