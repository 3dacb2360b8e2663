#pragma once

// Resources of the machine that this process may use, and a parallel loop over them.

#include <filesystem>
#include <functional>
#include <string>

namespace sextant {

/// Returns the number of cores that this process may use, at least 1: the smallest of the size of its
/// affinity mask (cpusets included), the CPU quota of its control groups rounded up, and SLURM_CPUS_PER_TASK
/// inside a Slurm job.
int available_cores();

/// Returns the name of the host, with '_' in place of all characters except letters, digits and '-';
/// "unknown" if the system has none. It is part of the names of files that two hosts must not share.
std::string host_name();

/// Returns the CPU quota of a control group in cores; 0 if there is none. `text` is the content of a cpu.max
/// file of cgroup version 2 ("50000 100000").
double cores_of_quota(const std::string& text);

/// Returns the folder for results that can be regenerated: $SEXTANT_CACHE, else $XDG_CACHE_HOME/sextant, else
/// ~/.cache/sextant; XDG_CACHE_HOME and HOME count only if they are absolute paths. Empty, which means that
/// nothing is cached, if SEXTANT_CACHE is set to an empty text or none of the variables is set.
std::filesystem::path cache_root();

// parallel_for(n, jobs, body) calls body(i) for every i in [0, n) on up to `jobs` threads, in any order. If a
// call throws, calls with higher indices may be left out; after all threads have ended, the exception of the
// lowest index is rethrown, so that the error does not depend on timing. Throws std::system_error if a thread
// cannot be created.

void parallel_for(int n, int jobs, const std::function<void(int)>& body);

}  // namespace sextant
