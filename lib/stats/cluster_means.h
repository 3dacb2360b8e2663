#pragma once

// One value per cluster (bootstrap.h), for tests that ask for independent values.

#include <cstdint>
#include <span>
#include <vector>

namespace sextant {

/// Mean of the values of each cluster, clusters in order of their label. values[i] belongs to cluster[i].
std::vector<double> cluster_means(std::span<const double> values, std::span<const uint64_t> cluster);

}  // namespace sextant
