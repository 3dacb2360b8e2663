#include "sextant/base/machine.h"

#include <sched.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <sstream>
#include <thread>
#include <vector>

#include "sextant/base/files.h"

namespace sextant {
namespace {

/// Returns the number of CPUs in the process's affinity mask, which may be of any size.
int cores_by_affinity() {
  for (int size = 1024; size <= 1 << 20; size *= 4) {
    cpu_set_t* set = CPU_ALLOC(size);
    const size_t bytes = CPU_ALLOC_SIZE(size);
    const bool known = ::sched_getaffinity(0, bytes, set) == 0;
    const int n = known ? CPU_COUNT_S(bytes, set) : 0;
    CPU_FREE(set);
    if (n > 0) return n;
  }
  return static_cast<int>(std::thread::hardware_concurrency());
}

std::string first_line(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// Returns the smallest quota of this process's control group and its ancestors; 0 if there is none. The
/// group is given as "0::/a/b" in version 2 and as "4:cpu,cpuacct:/a/b" in version 1. If the path does not
/// exist, as inside a container, the root group is used.
double cores_by_quota() {
  double least = 0;
  const auto take = [&](double cores) {
    if (cores > 0) least = least > 0 ? std::min(least, cores) : cores;
  };
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const size_t first = line.find(':');
    const size_t second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool unified = controllers == ",,";
    if (!unified && controllers.find(",cpu,") == std::string::npos) continue;
    const fs::path root = unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/cpu";
    for (fs::path group = line.substr(second + 1);; group = group.parent_path()) {
      const fs::path folder = root / group.relative_path();
      if (unified) {
        take(cores_of_quota(first_line(folder / "cpu.max")));
      } else {
        take(cores_of_quota(first_line(folder / "cpu.cfs_quota_us") + " " +
                            first_line(folder / "cpu.cfs_period_us")));
      }
      if (group.empty() || group == group.root_path()) break;
    }
  }
  return least;
}

}  // namespace

double cores_of_quota(const std::string& text) {
  std::istringstream words(text);
  double quota = 0;
  double period = 0;
  if (!(words >> quota >> period) || quota <= 0 || period <= 0)
    return 0;  // "max 100000", "-1 100000": no limit
  return quota / period;
}

int available_cores() {
  int cores = cores_by_affinity();
  if (const double quota = cores_by_quota(); quota > 0)
    cores = std::min(cores, static_cast<int>(std::ceil(quota)));
  if (const char* text = std::getenv("SLURM_CPUS_PER_TASK")) {
    if (const int of_task = std::atoi(text); of_task > 0) cores = std::min(cores, of_task);
  }
  return std::max(cores, 1);
}

std::string host_name() {
  char name[256] = {};
  if (::gethostname(name, sizeof(name) - 1) != 0 || name[0] == '\0') return "unknown";
  std::string host = name;
  for (char& c : host) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-') c = '_';
  }
  return host;
}

fs::path cache_root() {
  if (const char* own = std::getenv("SEXTANT_CACHE")) return own;
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && *cache == '/') return fs::path(cache) / "sextant";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return fs::path(home) / ".cache" / "sextant";
  return {};
}

void parallel_for(int n, int jobs, const std::function<void(int)>& body) {
  if (jobs <= 1 || n <= 1) {
    for (int i = 0; i < n; ++i) body(i);
    return;
  }
  std::vector<std::exception_ptr> errors(n);
  std::atomic<int> next = 0;
  std::atomic<int> first_error = n;
  const auto work = [&] {
    for (int i = next++; i < n; i = next++) {
      // Indices below a failed one still run, so that the reported error is always that of the lowest index.
      if (i > first_error) continue;
      try {
        body(i);
      } catch (...) {
        errors[i] = std::current_exception();
        int seen = first_error;
        while (i < seen && !first_error.compare_exchange_weak(seen, i)) {
        }
      }
    }
  };
  std::vector<std::jthread> threads;
  try {
    for (int t = 1; t < std::min(jobs, n); ++t) threads.emplace_back(work);
  } catch (...) {  // no further thread can be created: the others end after their present index
    next = n;
    throw;
  }
  work();
  threads.clear();
  if (first_error < n) std::rethrow_exception(errors[first_error]);
}

}  // namespace sextant
