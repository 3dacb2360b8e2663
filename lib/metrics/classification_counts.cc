#include "sextant/metrics/classification_counts.h"

namespace sextant {

void ClassificationCounts::add(bool found_dynamic, bool is_dynamic) {
  if (is_dynamic) {
    ++(found_dynamic ? true_positive : false_negative);
  } else {
    ++(found_dynamic ? false_positive : true_negative);
  }
}

std::optional<double> ClassificationCounts::precision() const {
  if (true_positive + false_positive == 0) return std::nullopt;
  return static_cast<double>(true_positive) / (true_positive + false_positive);
}

std::optional<double> ClassificationCounts::recall() const {
  if (true_positive + false_negative == 0) return std::nullopt;
  return static_cast<double>(true_positive) / (true_positive + false_negative);
}

}  // namespace sextant
