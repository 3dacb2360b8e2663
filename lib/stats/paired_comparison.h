#pragma once

// The comparison of two things that were measured on the same cases, from the differences case by case. What was
// drawn independently is a cluster (bootstrap.h); a test sees one value of each cluster, the mean of its
// differences. Empty or non-finite samples throw Error.
//
//   difference   mean over all cases; its interval by cluster bootstrap
//   p            two-sided, of the clusters' means: Wilcoxon's signed ranks or flipped signs (tests.h)
//   p_corrected  by Holm over the comparisons that are made together: correct_by_holm()
//   detectable   smallest mean that so many clusters find at 5 % with probability 80 % (trend.h)

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"
#include "sextant/stats/tests.h"

namespace sextant {

struct PairedComparison {
  double difference = 0;
  std::optional<Interval> interval;  ///< none with fewer than 2 clusters
  int n_clusters = 0;
  int n_used = 0;  ///< clusters whose mean is not 0
  std::optional<double> p;
  std::optional<double> p_corrected;
  std::optional<double> detectable;  ///< none with fewer than 2 clusters
};

enum class PairedTest { signed_ranks, sign_flip };

/// differences[i] belongs to the cluster labelled cluster[i]; without labels each is a cluster of its own.
PairedComparison compare_pairs(std::span<const double> differences, std::span<const uint64_t> cluster = {},
                               const BootstrapOptions& bootstrap = {},
                               PairedTest test = PairedTest::signed_ranks);

/// Holm's correction over tests that are made together: each that has a `p` gets its `p_corrected`.
template <typename Test>
void correct_by_holm(const std::vector<Test*>& family) {
  std::vector<double> p;
  for (const Test* test : family) {
    if (test->p) p.push_back(*test->p);
  }
  const std::vector<double> corrected = holm(p);
  size_t k = 0;
  for (Test* test : family) {
    if (test->p) test->p_corrected = corrected[k++];
  }
}

}  // namespace sextant
