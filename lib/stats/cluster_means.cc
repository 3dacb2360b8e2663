#include "sextant/stats/cluster_means.h"

#include "sextant/stats/bootstrap.h"

namespace sextant {

std::vector<double> cluster_means(std::span<const double> values, std::span<const uint64_t> cluster) {
  std::vector<double> means;
  for (const std::vector<size_t>& members : members_of_clusters(cluster)) {
    double sum = 0;
    for (const size_t i : members) sum += values[i];
    means.push_back(sum / static_cast<double>(members.size()));
  }
  return means;
}

}  // namespace sextant
