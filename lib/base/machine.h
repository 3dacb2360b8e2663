#pragma once

// What this process may use of the machine it is on.

#include <filesystem>
#include <functional>
#include <string>

namespace sextant {

/// Cores for this process, >= 1: the smallest of those it may run on (affinity, cpusets), the quota of its
/// control groups rounded up, and SLURM_CPUS_PER_TASK inside a job of Slurm.
int available_cores();

/// Name of the host in letters, digits, '-' and '_'; for names of files that two hosts must not share.
std::string host_name();

/// CPU quota of a control group, in cores; 0 for none. `text` is a cpu.max file of version 2 ("50000
/// 100000").
double cores_of_quota(const std::string& text);

/// Where what can be made again is kept: $SEXTANT_CACHE, else $XDG_CACHE_HOME/sextant, else ~/.cache/sextant.
/// Empty when SEXTANT_CACHE is set to nothing (keep nothing) or none of them is known.
std::filesystem::path cache_root();

// parallel_for(n, jobs, body): calls body(i) for every i in [0, n) on up to `jobs` threads, in any order.
// The first exception (by index, so that it does not depend on timing) is rethrown after all threads end.

void parallel_for(int n, int jobs, const std::function<void(int)>& body);

}  // namespace sextant
