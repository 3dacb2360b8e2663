#pragma once

// Sums of the noise that was added (NoiseVerification::sums()), so that adding them up in any order gives the same bits:
// every sum of a case is rounded to a multiple of 2^-60 and added as a whole number of 128 bits.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sextant/noise/verification.h"

namespace sextant {

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
