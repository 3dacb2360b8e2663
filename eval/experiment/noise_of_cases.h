#pragma once

// The member "noise" of a sweep's run.json: for each source and noisy level, the requested noise and the
// noise achieved on the points of all cases. It is computed from the sums stored with each case
// (cases.jsonl), so that the noise of cases of earlier runs or other shards is not generated again.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/noise/verification.h"

namespace sextant {

class NoiseOfCases {
 public:
  /// `plan` is Plan::json().
  explicit NoiseOfCases(Json plan);

  /// Adds the sums of a case, NoiseVerification::sums(), null without noise. Cases come in order of number.
  /// Estimators with the same points have the same noise, which is counted once. Throws Error if a case of a
  /// noisy level has no sums.
  void add(uint64_t number, const Json& sums);
  /// Sets the sums of a source and level, which were added up elsewhere. Throws Error if the plan adds no
  /// noise there.
  void set(const std::pair<size_t, size_t>& source_and_level, const NoiseVerification& noise);

  /// Returns true if the level of the case adds noise, and no earlier estimator of the plan has the same
  /// points.
  bool is_counted(uint64_t number) const;
  std::pair<size_t, size_t> source_and_level(uint64_t number) const;

  Json json() const;

 private:
  struct Place {
    size_t source, estimator, level, seed;
  };
  Place place_of(uint64_t number) const;

  Json plan_;
  size_t n_levels_ = 0, n_seeds_ = 0, n_estimators_ = 0, n_kinds_ = 0;
  std::vector<bool> is_noisy_;  ///< by level
  std::vector<size_t> kind_;    ///< by estimator: number of its set of points
  std::vector<bool> counted_;   ///< by source, level, seed and kind
  std::map<std::pair<size_t, size_t>, NoiseVerification> achieved_;  ///< by source and level
};

// ---- Exact sums of the added noise (NoiseVerification::sums()), which have the same bits for any order of
// addition: every sum of a case is rounded to a multiple of 2^-60 and added as an integer of 128 bits.

class ExactNoise {
 public:
  /// Throws Error if the absolute value of a sum is not below 2^40.
  void add(const NoiseVerification& noise);
  void add(const ExactNoise& other);
  NoiseVerification total() const;

  std::string bytes() const;
  /// Decodes bytes(). Throws Error that begins with `where` if they are damaged.
  static ExactNoise decode(std::string_view bytes, const std::string& where);

 private:
  __extension__ using Int128 = __int128;
  /// One group of sums: either those over all bodies (depth and errors of neighbours), or those of the flow
  /// of one body.
  struct Part {
    std::vector<double> requested;
    std::vector<uint64_t> counts;
    std::vector<Int128> sums;
  };
  template <typename Sums>
  static Part part_of(Sums sums);
  template <typename Sums>
  static void fill(const Part& part, Sums& sums);
  void add(int key, const Part& part);
  struct Common;

  std::map<int, Part> parts_;  ///< by body; -1: everything except flow
};

/// Sums by index of source and level in the plan.
using ExactNoises = std::map<std::pair<size_t, size_t>, ExactNoise>;
std::string encode_exact_noises(const ExactNoises& noises);
ExactNoises decode_exact_noises(std::string_view bytes, const std::string& where);

}  // namespace sextant
