#pragma once

// Statements of the paper, checked on records. To add some, write eval/report/claims/NAME_claims.cc with a
// function `std::vector<Claim> NAME_claims()`, which the build finds by its name. A Claim contains its
// statement or, with paper_claim(), takes it from results/published/zhang2020_data.json.
//
// A result is one number with its 95 % interval, and the value that the paper states. Verdicts:
//   reproduced      the whole interval agrees with the statement
//   not_reproduced  the whole interval contradicts it
//   undecided       the interval contains values of both kinds, or there is no interval
// A claim for which there are no records has no results: it was not tested.

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/report/document.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// How statements without numbers of their own are judged, in the caption of claim_table().
constexpr double least_of_about_300_percent = 100;  ///< "about 300 %": at least a third of it
constexpr double nearly = 0.25;                     ///< "nearly": within this share of the stated value

enum class Verdict { reproduced, not_reproduced, undecided };
constexpr Names<3> names_of(Verdict) { return {"reproduced", "not reproduced", "undecided"}; }

/// The values between two limits, which agree with a statement.
struct Limits {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// One measured value of a claim.
struct ClaimResult {
  std::string dataset, sequence, estimator;
  std::string subject;   ///< "camera", "object 2 (id 3)"
  std::string quantity;  ///< "largest mean E_t, delta_d <= 0.2 [m]"
  std::string stated;    ///< "< 0.02"
  double value = 0;
  std::optional<Interval> interval{};
  Verdict verdict = Verdict::undecided;
  std::string records{};  ///< the experiment that measured it
};
/// Returns the result with this value, and with the verdict on the statement that it lies within the limits.
ClaimResult judged(ClaimResult result, const IntervalEstimate& estimate, const Limits& limits);

using ClaimCheck = std::function<std::vector<ClaimResult>(const Evidence&)>;

struct Claim : Statement {
  std::string name;
  int order = 0;  ///< place among the claims of a report
  ClaimCheck check;
};

/// Makes a claim whose statement is the entry `name` of zhang2020_data.json.
Claim paper_claim(int order, const std::string& name, ClaimCheck check);

/// Returns all claims in the order of reports.
std::span<const Claim> claims();

struct CheckedClaim {
  const Claim* claim;
  std::vector<ClaimResult> results;
};
/// Checks all claims() in order.
std::vector<CheckedClaim> check_claims(const Evidence& evidence);

/// Returns a table with one row per result; notes list the claims without results as not tested.
Table claim_table(const std::vector<CheckedClaim>& checked);

/// Returns one line per claim with the joint verdict of its results. A line with results links to its part of
/// claim_table(), which the document must contain under the name `table`, split by "statement".
std::vector<VerdictLine> claim_verdicts(const std::vector<CheckedClaim>& checked, const std::string& table);

}  // namespace sextant
