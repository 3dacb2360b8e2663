#pragma once

// The two processes beside a program (process.h). The supervisor starts the program in a group of its own, copies its
// output into the logs up to their limit, keeps the time, and in the end kills every process that came from it: as
// their subreaper it is the parent of all that lose theirs. The guard is the supervisor's parent and a subreaper too:
// when the program kills or stops the supervisor, or the supervisor is late, the guard kills all that are left. When
// the guard is killed the supervisor ends the program; when it is stopped, or late, the process that waits for it
// (process.cc) kills all below it. Both run in a fork of a process that may have threads, so they call nothing but
// the system.

#include <spawn.h>

#include <cstdint>

#include "sextant/eval/external/process.h"

namespace sextant {

struct Supervised {
  // Prepared before the fork. All descriptors close on exec.
  const char* program = nullptr;  ///< as execvp takes it
  char* const* arguments = nullptr;
  char* const* environment = nullptr;
  const posix_spawn_file_actions_t* files = nullptr;  ///< they put `streams` in place
  const posix_spawnattr_t* attributes = nullptr;
  int alive = -1;                                    ///< the other end is closed when all is to be killed
  int report = -1;                                   ///< takes one SupervisorReport at the end
  int sources[2] = {-1, -1}, streams[2] = {-1, -1};  ///< of the pipes behind stdout and stderr
  int logs[2] = {-1, -1};
  double time_limit_s = 0;
  uint64_t most_log_bytes = 0;
};

struct SupervisorReport {
  int start_error = 0;  ///< errno; 0: it was started
  ProcessOutcome outcome;
};

/// What the guard does: forks the supervisor and watches it. Does not return.
[[noreturn]] void supervise(const Supervised& program);

/// fork() without what libraries have registered to be called by it: the copy uses none of them.
pid_t fork_alone();

/// The longest time that a supervisor takes for a program with that limit.
double supervision_limit_s(double time_limit_s);

/// Kills all processes below the guard, whatever state they are in, and then the guard. Its zombie is left to be collected.
void kill_below(pid_t guard);

}  // namespace sextant
