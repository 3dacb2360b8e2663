#pragma once

// Cards for people: the card of one estimator as a document, and the page of all cards (docs/benchmark.md).
//
// Performance profile (Dolan and More, 2002): a case is a track, kind of body and level at which at least one
// estimator reaches the coverage that the suite asks for. The ratio of an estimator in a case is its mean E_t over
// that of the best estimator there, infinite where its coverage is too low or it did not run. The profile rho(tau)
// is the share of cases with a ratio of at most tau: rho(1) is the share of cases in which it is the best, and for
// large tau the share of cases that it solves at all. Cases in which
// the best error is below 1e-6 m, an exact solution of exact data, do not count.

#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/document.h"

namespace sextant {

/// A card and where it was read, relative to the page.
struct PlacedCard {
  Card card;
  std::string folder;
};

/// Cards of reference systems that come with the program (results/benchmark), of this suite.
std::vector<PlacedCard> reference_cards(const Suite& suite);

/// The points of the references are drawn in grey behind those of the card.
ReportDocument card_document(const Card& card, const Suite& suite, const std::vector<PlacedCard>& references);
/// card.json, card.md and card.html.
OutputFiles card_files(const Card& card, const Suite& suite, int jobs);

/// One estimator of a profile.
struct ProfileRow {
  std::string estimator;
  int n_cases = 0, n_solved = 0;
  std::vector<double> ratios;  ///< ratios of the solved cases, ascending

  double share_within(double tau) const;
};
/// Best first: by rho(1), then rho(2), then the share of solved cases.
std::vector<ProfileRow> performance_profile(const std::vector<PlacedCard>& cards, const Suite& suite);

/// The page of all cards, which are of one suite.
ReportDocument page_document(const std::vector<PlacedCard>& cards, const Suite& suite);

/// index.html of the cards in these folders, for a page that will lie in `out`. Throws Error on a folder without a card
/// and on cards of several suites.
OutputFiles page_files(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& out, int jobs);

}  // namespace sextant
