#pragma once

// Breakdown level of a curve of errors over the noise level: the smallest level above the nominal one at
// which the mean error is `error_ratio` times that of the nominal level, or at which coverage falls below
// `min_coverage`.
//
//   between levels   error and coverage are interpolated linearly in the level
//   interval         95 %, percentile bootstrap of the same function (stats/bootstrap.h); a cluster is a seed
//                    with its frame pairs at all levels, or, with fewer than min_seed_clusters seeds, a frame
//                    number with its pairs of all seeds and levels
//   no crossing      neither happens up to the highest level: `level` is the highest level, without a cause
//   nominal          coverage is below the limit already at the nominal level: `level` is the nominal level

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// Smallest number of seeds for a bootstrap over seeds; fewer seeds are too few clusters.
inline constexpr size_t min_seed_clusters = 5;

/// Frame pairs with truth at one level.
struct LevelCounts {
  double level = 0;
  struct Pair {
    uint64_t seed = 0;
    int frame = 0;
    std::optional<double> error;  ///< empty if the pair was not estimated
  };
  std::vector<Pair> pairs{};

  void add(uint64_t seed, int frame, std::optional<double> error) { pairs.push_back({seed, frame, error}); }
};

enum class BreakdownCause { none, error, coverage, nominal };
constexpr Names<4> names_of(BreakdownCause) { return {"none", "error", "coverage", "nominal"}; }

struct BreakdownLevel {
  double nominal = 0, highest = 0;
  BreakdownCause cause = BreakdownCause::none;
  double level = 0;
  std::optional<Interval> interval;  ///< an end at `highest` means at least that level

  /// Formats "0.41", or "> 0.8" without a crossing.
  std::string text() const;
  /// Formats "[0.38, > 0.8]"; empty without an interval.
  std::string interval_text() const;
};

/// Computes the breakdown level of a curve, given its levels in ascending order (at least one).
BreakdownLevel breakdown_of(const std::vector<LevelCounts>& levels, double nominal, double error_ratio,
                            double min_coverage);

}  // namespace sextant
