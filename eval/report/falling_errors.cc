#include "sextant/eval/report/falling_errors.h"

#include <cmath>

#include "sextant/stats/summary.h"

namespace sextant {
namespace {

std::optional<FallingError::Mean> common_mean(const NoiseLevel& low, const NoiseLevel& high, size_t error) {
  FallingError::Mean mean;
  const auto add = [&](size_t n, double sum_low, double sum_high) {
    mean.n += n;
    mean.lowest += sum_low;
    mean.highest += sum_high;
  };
  if (low.is_summed()) {
    const auto by_seed = low.paired_sums(high, error);
    if (!by_seed) return std::nullopt;
    for (const auto& sums : *by_seed) add(static_cast<size_t>(sums.first.n), sums.first.x, sums.second.x);
  } else {
    for (const auto& [a, b] : low.pairs(high)) {
      const double at_low = low.error(error, a), at_high = high.error(error, b);
      if (std::isfinite(at_low) && std::isfinite(at_high)) add(1, at_low, at_high);
    }
  }
  if (mean.n == 0) return std::nullopt;
  mean.lowest /= static_cast<double>(mean.n);
  mean.highest /= static_cast<double>(mean.n);
  return mean;
}

double mean_of(const NoiseLevel& level, size_t error) {
  return summarize_sample(level.sample(error, level.clusters())).mean.value;
}

}  // namespace

std::string FallingError::reason() const {
  if (!common_Et_m)
    return "not known: no pair is estimated at both levels, or the sweep kept summaries of other pairs";
  if (common_Et_m->highest >= least_fall * common_Et_m->lowest)
    return "coverage: it does not fall on the pairs that both levels estimated";
  return "selection of points, or chance: it falls on the pairs that both levels estimated";
}

std::vector<FallingError> falling_errors(const std::vector<NoiseSweep>& sweeps) {
  const size_t error = compared_error("Et_m");
  std::vector<FallingError> rows;
  for (const NoiseSweep& sweep : sweeps) {
    for (const auto& curve : curves_of(sweep.levels)) {
      const NoiseLevel &low = *curve.front(), &high = *curve.back();
      if (low.key().level == high.key().level || !low.has(error) || !high.has(error)) continue;
      const FallingError::Mean all = {high.n_estimated(), mean_of(low, error), mean_of(high, error)};
      if (!(all.highest < least_fall * all.lowest)) continue;
      rows.push_back({sweep.parameter, low.key().dataset.str(), low.key().sequence.str(),
                      low.key().body.str(), low.key().estimator.str(), low.key().level, high.key().level, all,
                      low.n_estimated(), common_mean(low, high, error)});
    }
  }
  return rows;
}

Table falling_error_table(const std::vector<FallingError>& rows) {
  const auto common = [](double FallingError::Mean::*value) {
    return [value](const FallingError& row) {
      return row.common_Et_m ? Cell((*row.common_Et_m).*value) : Cell();
    };
  };
  return table_of<FallingError>(
      "Errors that fall as noise rises",
      "Mean E_t at the lowest and the highest level: over all estimated pairs, and over the pairs that both levels "
      "estimated.",
      {{Column::text("parameter"), &FallingError::parameter},
       {Column::text("dataset"), &FallingError::dataset},
       {Column::text("sequence"), &FallingError::sequence},
       {Column::text("body"), &FallingError::body},
       {Column::text("estimator"), &FallingError::estimator},
       {Column::number("lowest", "from level", 3), &FallingError::lowest},
       {Column::number("highest", "to", 3), &FallingError::highest},
       {Column::count("n_lowest", "pairs"), &FallingError::n_lowest},
       {Column::count("n_highest", "pairs"), [](const FallingError& row) { return row.Et_m.n; }},
       {Column::number("Et_lowest_m", "E_t [m]", 4), [](const FallingError& row) { return row.Et_m.lowest; }},
       {Column::number("Et_highest_m", "E_t [m]", 4),
        [](const FallingError& row) { return row.Et_m.highest; }},
       {Column::count("n_common", "of both"),
        [](const FallingError& row) { return row.common_Et_m ? Cell(row.common_Et_m->n) : Cell(); }},
       {Column::number("common_Et_lowest_m", "E_t [m]", 4), common(&FallingError::Mean::lowest)},
       {Column::number("common_Et_highest_m", "E_t [m]", 4), common(&FallingError::Mean::highest)},
       {Column::text("reason"), &FallingError::reason}},
      rows);
}

}  // namespace sextant
