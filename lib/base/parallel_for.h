#pragma once

// parallel_for(n, jobs, body): calls body(i) for every i in [0, n) on up to `jobs` threads, in any order.
// The first exception (by index, so that it does not depend on timing) is rethrown after all threads end.

#include <functional>

namespace sextant {

void parallel_for(int n, int jobs, const std::function<void(int)>& body);

}  // namespace sextant
