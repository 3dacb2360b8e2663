#include "sextant/base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

namespace sextant {

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
      // Indices below a failed one still run, so that the error reported is always that of the lowest index.
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
  } catch (...) {  // no more threads are to be had: those that run take nothing new
    next = n;
    throw;
  }
  work();
  threads.clear();
  if (first_error < n) std::rethrow_exception(errors[first_error]);
}

}  // namespace sextant
