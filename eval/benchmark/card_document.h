#pragma once

// Cards for readers: the card of one estimator as a document, and the page of all cards (docs/benchmark.md).
//
// Performance profile (Dolan and More, 2002): a case is a track, kind of body and level for which a card has
// frame pairs with truth. The ratio of an estimator in a case is its mean E_t divided by that of the best
// estimator, and infinite if its coverage is below that which the suite requires, or if it did not run.
// Errors below 1e-6 m, of exact solutions of exact data, count as 1e-6 m. The profile rho(tau) is the share
// of cases with a ratio of at most tau: rho(1) is the share of cases in which the estimator is the best, and
// for large tau rho is the share of cases that it solves. A case that no estimator solves counts against all.

#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/document.h"

namespace sextant {

/// A card, and the folder from which it was read, relative to the page.
struct PlacedCard {
  Card card;
  std::string folder;
};

/// Returns the cards of the reference systems that come with the program (results/benchmark) for this suite.
std::vector<PlacedCard> reference_cards(const Suite& suite);

/// Makes the document of a card. The curves of the references are drawn in grey behind those of the card.
ReportDocument card_document(const Card& card, const Suite& suite, const std::vector<PlacedCard>& references);
/// Returns card.json, card.md and card.html.
OutputFiles card_files(const Card& card, const Suite& suite, int jobs);

/// Profile of one estimator.
struct ProfileRow {
  std::string estimator;
  int n_cases = 0, n_solved = 0;
  std::vector<double> ratios;  ///< ratios of the solved cases, ascending

  double share_within(double tau) const;
};
/// Computes the profiles, ordered by rho(1), then rho(2), then the share of solved cases, best first.
/// Throws Error if two cards have a result of the same name.
std::vector<ProfileRow> performance_profile(const std::vector<PlacedCard>& cards);

/// Makes the page of all cards, which must belong to one suite. Results of several cards with the same name
/// are called "NAME (FOLDER)".
ReportDocument page_document(const std::vector<PlacedCard>& cards, const Suite& suite);

/// Makes index.html from the cards in these folders; `out` is the folder of the page. Throws Error on a
/// folder without a card or given twice, and on cards of other suites than that of the first (suite_of()).
OutputFiles page_files(const std::vector<std::filesystem::path>& folders, const std::string& requested_suite,
                       const std::filesystem::path& out, int jobs);

}  // namespace sextant
