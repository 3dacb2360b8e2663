#include "sextant/metrics/trajectory_association.h"

#include <cmath>

namespace sextant {
namespace {

/// For each stamp of `from` the nearest of `to` + offset, both ascending.
void match(const std::vector<double>& from, const std::vector<double>& to, double offset_s,
           double max_difference_s, std::vector<int>& from_out, std::vector<int>& to_out) {
  size_t j = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    const auto difference = [&](size_t k) { return std::abs((to[k] + offset_s) - from[i]); };
    while (j + 1 < to.size() && difference(j + 1) < difference(j)) ++j;
    if (!to.empty() && difference(j) <= max_difference_s) {
      from_out.push_back(static_cast<int>(i));
      to_out.push_back(static_cast<int>(j));
    }
  }
}

}  // namespace

Association associate_by_time(const std::vector<double>& reference_s, const std::vector<double>& estimate_s,
                              const AssociationOptions& options) {
  Association found;
  if (estimate_s.size() > reference_s.size()) {
    match(reference_s, estimate_s, options.offset_s, options.max_difference_s, found.reference,
          found.estimate);
  } else {
    match(estimate_s, reference_s, -options.offset_s, options.max_difference_s, found.estimate,
          found.reference);
  }
  return found;
}

Association associate_by_frame(const std::vector<int>& reference, const std::vector<int>& estimate) {
  Association found;
  for (size_t i = 0, j = 0; i < reference.size() && j < estimate.size();) {
    if (reference[i] < estimate[j]) {
      ++i;
    } else if (reference[i] > estimate[j]) {
      ++j;
    } else {
      found.reference.push_back(static_cast<int>(i++));
      found.estimate.push_back(static_cast<int>(j++));
    }
  }
  return found;
}

}  // namespace sextant
