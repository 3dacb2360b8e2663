#pragma once

// The "noise" of a sweep's run.json: per source and level that adds any, what was asked for and what the
// cases' points really got, over seeds. It is made of the sums that each case leaves (cases.jsonl), so that
// nothing is drawn again for cases done earlier or in other shards.

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

  /// The sums of a case, NoiseVerification::sums(), null without noise. Cases come in order of number.
  /// Estimators that are given the same points have the same draws, which count once. Throws Error where a
  /// case of a noisy level has no sums.
  void add(uint64_t number, const Json& sums);
  /// Those of a level, added up elsewhere.
  void set(const std::pair<size_t, size_t>& source_and_level, const NoiseVerification& noise);

  /// Whether its level adds noise, and no earlier estimator of the plan is given the same points.
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
  std::vector<size_t> kind_;    ///< by estimator: which points it is given
  std::vector<bool> counted_;   ///< by source, level, seed and kind
  std::map<std::pair<size_t, size_t>, NoiseVerification> achieved_;  ///< by source and level
};

// ---- Sums of the noise that was added (NoiseVerification::sums()), so that adding them up in any order
// gives the same bits: every sum of a case is rounded to a multiple of 2^-60 and added as a whole number of
// 128 bits.

class ExactNoise {
 public:
  /// Throws Error for sums of 2^40 or more.
  void add(const NoiseVerification& noise);
  void add(const ExactNoise& other);
  NoiseVerification total() const;

  std::string bytes() const;
  /// Throws Error that begins with `where`.
  static ExactNoise decode(std::string_view bytes, const std::string& where);

 private:
  __extension__ using Int128 = __int128;
  /// What does not depend on bodies, and a body's flow.
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

  std::map<int, Part> parts_;  ///< by body; -1: all but flow
};

/// By place in the plan: source and level.
using ExactNoises = std::map<std::pair<size_t, size_t>, ExactNoise>;
std::string encode_exact_noises(const ExactNoises& noises);
ExactNoises decode_exact_noises(std::string_view bytes, const std::string& where);

}  // namespace sextant
