#include "sextant/eval/benchmark/breakdown.h"

#include <algorithm>
#include <set>
#include <span>
#include <tuple>

#include "sextant/base/error.h"

namespace sextant {
namespace {

/// Frame pairs of one cluster at one level.
struct SeedFrameCell {
  double n_truth = 0, n_estimated = 0, error_sum = 0;

  void add(const SeedFrameCell& more) {
    n_truth += more.n_truth;
    n_estimated += more.n_estimated;
    error_sum += more.error_sum;
  }
};

/// Indexed as cells[level][cluster].
struct Grid {
  std::vector<double> levels;
  std::vector<std::vector<SeedFrameCell>> cells;
  size_t n_clusters = 0;
};

Grid grid_of(const std::vector<LevelCounts>& levels) {
  std::set<uint64_t> seeds, frames;
  for (const LevelCounts& level : levels) {
    for (const auto& pair : level.pairs) {
      seeds.insert(pair.seed);
      frames.insert(static_cast<uint64_t>(pair.frame));
    }
  }
  const bool by_seed = seeds.size() >= min_seed_clusters;
  const std::set<uint64_t>& labels = by_seed ? seeds : frames;
  Grid grid{.n_clusters = labels.size()};
  for (const LevelCounts& level : levels) {
    grid.levels.push_back(level.level);
    std::vector<SeedFrameCell>& cells = grid.cells.emplace_back(grid.n_clusters);
    for (const auto& pair : level.pairs) {
      const auto at = labels.find(by_seed ? pair.seed : static_cast<uint64_t>(pair.frame));
      cells[static_cast<size_t>(std::distance(labels.begin(), at))].add(
          {1, pair.error ? 1.0 : 0.0, pair.error.value_or(0)});
    }
  }
  return grid;
}

struct Limits {
  double nominal = 0, error_ratio = 2, min_coverage = 0.9;
};

struct Crossing {
  BreakdownCause cause = BreakdownCause::none;
  double level = 0;
};

/// Abscissa at which the line from (a, value_a) to (b, value_b) reaches `limit`.
double crossing(double a, double value_a, double b, double value_b, double limit) {
  return value_b == value_a ? b : a + (b - a) * (limit - value_a) / (value_b - value_a);
}

Crossing find_crossing(const Grid& grid, std::span<const size_t> clusters, const Limits& limits) {
  std::optional<double> nominal_error;
  std::optional<double> before_level, before_error, before_coverage;
  for (size_t i = 0; i < grid.levels.size(); ++i) {
    if (grid.levels[i] < limits.nominal) continue;
    SeedFrameCell sum;
    for (const size_t cluster : clusters) sum.add(grid.cells[i][cluster]);
    if (sum.n_truth == 0) continue;  // none of the resampled frames exists at this level
    const double level = grid.levels[i], coverage = sum.n_estimated / sum.n_truth;
    const std::optional<double> error =
        sum.n_estimated > 0 ? std::optional(sum.error_sum / sum.n_estimated) : std::nullopt;
    if (!nominal_error) {
      if (coverage < limits.min_coverage || !error) return {BreakdownCause::nominal, limits.nominal};
      nominal_error = error;
    } else {
      Crossing found{BreakdownCause::none, level};
      const double limit = limits.error_ratio * *nominal_error;
      if (error && *error >= limit)
        found = {BreakdownCause::error, crossing(*before_level, *before_error, level, *error, limit)};
      if (coverage < limits.min_coverage) {
        const double at = crossing(*before_level, *before_coverage, level, coverage, limits.min_coverage);
        if (found.cause == BreakdownCause::none || at < found.level) found = {BreakdownCause::coverage, at};
      }
      if (found.cause != BreakdownCause::none) return found;
    }
    std::tie(before_level, before_error, before_coverage) = std::tuple(level, error, coverage);
  }
  return {BreakdownCause::none, grid.levels.back()};
}

}  // namespace

std::string BreakdownLevel::text() const {
  if (cause == BreakdownCause::nominal) return "at nominal";
  return cause == BreakdownCause::none ? fmt::format("> {:g}", highest) : fmt::format("{:.3g}", level);
}

std::string BreakdownLevel::interval_text() const {
  if (!interval) return "";
  const auto end = [&](double at) {
    return at >= highest ? fmt::format("> {:g}", highest) : fmt::format("{:.3g}", at);
  };
  return fmt::format("[{}, {}]", end(interval->low), end(interval->high));
}

BreakdownLevel breakdown_of(const std::vector<LevelCounts>& levels, double nominal, double error_ratio,
                            double min_coverage) {
  SEXTANT_CHECK(!levels.empty());
  const Grid grid = grid_of(levels);
  const Limits limits{nominal, error_ratio, min_coverage};
  std::vector<size_t> all(grid.n_clusters);
  for (size_t i = 0; i < all.size(); ++i) all[i] = i;
  const Crossing found = find_crossing(grid, all, limits);
  BreakdownLevel out{nominal, grid.levels.back(), found.cause, found.level, std::nullopt};
  out.interval = cluster_bootstrap(
      grid.n_clusters,
      [&](std::span<const size_t> chosen) { return find_crossing(grid, chosen, limits).level; },
      {.method = BootstrapMethod::percentile});
  return out;
}

}  // namespace sextant
