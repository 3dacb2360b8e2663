#pragma once

// Checks that two sides are comparable: same data, definitions, configuration and machine, and the same
// cases. Every difference is reported, including those that the policy accepts.

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/side.h"

namespace sextant {

/// A difference between the two sides.
struct Mismatch {
  /// Key of SamenessPolicy, "input", or a note: "build", "program" (fingerprints), "same program"
  std::string what;
  std::string subject;
  std::string base;
  std::string fresh;  ///< value in NEW
  bool invalidates = true;
};

/// Compares the provenance (run.json); cases are compared where they are paired (accuracy.h, speed.h).
std::vector<Mismatch> compare_provenance(const Side& base, const Side& fresh, const Policy& policy);

/// Makes a mismatch that invalidates the comparison if the rule is Strictness::must.
Mismatch mismatch(Strictness rule, std::string what, std::string subject, std::string base,
                  std::string fresh);

/// Collects findings of one kind, and lists only the first few of them individually.
class Tally {
 public:
  Tally(std::string what, Strictness rule) : what_(std::move(what)), rule_(rule) {}

  void add(const std::string& subject, const std::string& base, const std::string& fresh) {
    if (n_++ < shown) findings_.push_back(mismatch(rule_, what_, subject, base, fresh));
  }

  void move_told(std::vector<Mismatch>& all) {
    std::ranges::move(std::exchange(findings_, {}), std::back_inserter(all));
  }

  /// Moves the listed findings to `all`, with the number of further ones.
  void move_to(std::vector<Mismatch>& all) {
    if (n_ > shown) findings_.push_back(mismatch(rule_, what_, fmt::format("{} more", n_ - shown), "", ""));
    move_told(all);
  }

 private:
  static constexpr size_t shown = 5;
  std::string what_;
  Strictness rule_;
  std::vector<Mismatch> findings_;
  size_t n_ = 0;
};

}  // namespace sextant
