#pragma once

// Cases of records in columns: a row is one seed and frame, for one estimator and body. Noise levels
// (noise_level.h) and the subjects of a comparison (eval/gate/subject_cases.h) keep their numbers beside
// these columns.

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace sextant {

/// A seed of the noise and a frame; estimators are paired by it.
using SeedFrame = std::pair<uint64_t, int>;

struct CaseColumns {
  std::vector<uint64_t> seeds;
  std::vector<int> frames;

  size_t size() const { return seeds.size(); }
  SeedFrame case_of(size_t row) const { return {seeds[row], frames[row]}; }
  void add(uint64_t seed, int frame) {
    seeds.push_back(seed);
    frames.push_back(frame);
  }
  /// Order of rows by case; rows of the same case keep their order. Empty if they are already in order.
  std::optional<std::vector<size_t>> sorting_order() const {
    std::vector<size_t> order(size());
    std::iota(order.begin(), order.end(), size_t{0});
    const auto case_at = [&](size_t row) { return case_of(row); };
    if (std::ranges::is_sorted(order, {}, case_at)) return std::nullopt;
    std::ranges::stable_sort(order, {}, case_at);
    return order;
  }
};

/// Puts a column into another order.
template <typename T>
void reorder(const std::vector<size_t>& order, std::vector<T>& values) {
  std::vector<T> ordered;
  ordered.reserve(values.size());
  for (const size_t i : order) ordered.push_back(values[i]);
  values = std::move(ordered);
}

/// Visits the cases of two sorted tables in order, with the row in each; empty if a table lacks the case.
template <typename Visit>
void for_each_case(const CaseColumns& first, const CaseColumns& second, const Visit& visit) {
  for (size_t a = 0, b = 0; a < first.size() || b < second.size();) {
    const bool only_first = b == second.size(), only_second = a == first.size();
    const bool in_first = only_first || (!only_second && first.case_of(a) <= second.case_of(b));
    const bool in_second = only_second || (!only_first && second.case_of(b) <= first.case_of(a));
    visit(in_first ? std::optional(a) : std::nullopt, in_second ? std::optional(b) : std::nullopt);
    a += in_first;
    b += in_second;
  }
}

}  // namespace sextant
