#pragma once

// The two processes next to a program (process.h). The supervisor starts the program in its own process
// group, copies its output into the logs up to their limit, enforces the time limit, and at the end kills
// every process that descends from it: as their subreaper it becomes the parent of all orphans. The guard is
// the supervisor's parent and a subreaper too: if the program kills or stops the supervisor, or the
// supervisor is late, the guard kills all remaining processes. If the guard is killed, the supervisor ends
// the program; if the guard is stopped or late, the waiting process (process.cc) kills all processes below
// it. Both run in a fork of a process that may have threads, so they only use system calls.

#include <spawn.h>

#include <cstdint>

#include "sextant/eval/external/process.h"

namespace sextant {

struct Supervised {
  // Prepared before the fork. All descriptors are closed on exec.
  const char* program = nullptr;  ///< argument of execvp
  char* const* arguments = nullptr;
  char* const* environment = nullptr;
  const posix_spawn_file_actions_t* files = nullptr;  ///< puts `streams` in place
  const posix_spawnattr_t* attributes = nullptr;
  int alive = -1;                                    ///< end of a pipe; closing the other end kills all
  int report = -1;                                   ///< receives one SupervisorReport at the end
  int sources[2] = {-1, -1}, streams[2] = {-1, -1};  ///< pipes behind stdout and stderr
  int logs[2] = {-1, -1};
  double time_limit_s = 0;
  uint64_t most_log_bytes = 0;
};

struct SupervisorReport {
  int start_error = 0;  ///< errno; 0: started
  ProcessOutcome outcome;
};

/// Runs the guard: forks the supervisor and watches it. Does not return.
[[noreturn]] void supervise(const Supervised& program);

/// fork() without the handlers registered by libraries, none of which the child uses.
pid_t fork_alone();

/// Returns the longest time that a supervisor takes for a program with this limit.
double supervision_limit_s(double time_limit_s);

/// Kills all processes below the guard, in any state, and then the guard. Its zombie remains to be collected.
void kill_below(pid_t guard);

}  // namespace sextant
