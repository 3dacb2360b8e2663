#include "sextant/eval/benchmark/card_document.h"

#include <algorithm>
#include <functional>
#include <span>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/benchmark/card_figures.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {

std::span<const EmbeddedFile> reference_card_files();

namespace {

/// Row of a card: errors of one track and kind of body at the nominal level.
struct NominalRow {
  std::string estimator, track, body;
  double nominal = 0;
  double coverage_percent = 0;
  std::optional<double> Et_mm, Et_low_mm, Et_high_mm, ER_deg, Ev_kmh, efficiency, anees;
  std::string breakdown, breakdown_interval;
  std::string records;
};

NominalRow nominal_row(const CurvePoint& point, const Card& card, const std::string& folder) {
  NominalRow row{point.estimator, point.track, point.body, point.level, 100 * point.coverage()};
  if (point.Et_m) {
    row.Et_mm = 1e3 * point.Et_m->value;
    if (point.Et_m->interval) {
      row.Et_low_mm = 1e3 * point.Et_m->interval->low;
      row.Et_high_mm = 1e3 * point.Et_m->interval->high;
    }
  }
  const auto value = [](const std::optional<IntervalEstimate>& e) {
    return e ? std::optional(e->value) : std::nullopt;
  };
  row.ER_deg = value(point.ER_deg);
  row.Ev_kmh = value(point.Ev_kmh);
  row.efficiency = value(point.efficiency);
  row.anees = point.anees;
  for (const Breakdown& breakdown : card.breakdowns) {
    if (breakdown.estimator != point.estimator || breakdown.track != point.track ||
        breakdown.body != point.body)
      continue;
    row.breakdown = breakdown.at.text();
    row.breakdown_interval = breakdown.at.interval_text();
  }
  row.records = folder.empty() ? point.records : folder + "/" + point.records;
  return row;
}

Column significant(Column column) {
  column.significant = 3;
  return column;
}

Table nominal_table(const std::vector<NominalRow>& rows) {
  using Row = NominalRow;
  std::vector<Column> range = range_columns("Et_low_mm", "Et_high_mm", 2);
  for (Column& column : range) column.significant = 3;
  const Fields<Row> fields = {
      {Column::text("estimator").folded(), &Row::estimator},
      {Column::text("track"), &Row::track},
      {Column::text("body"), &Row::body},
      {significant(Column::number("nominal", "nominal level", 2)), &Row::nominal},
      {Column::number("coverage_percent", "coverage [%]", 1), &Row::coverage_percent},
      {significant(Column::number("Et_mm", "E_t [mm]", 2)).leading_to("records"), &Row::Et_mm},
      {range[0], &Row::Et_low_mm},
      {range[1], &Row::Et_high_mm},
      {significant(Column::number("ER_deg", "E_R [deg]", 4)), &Row::ER_deg},
      {significant(Column::number("Ev_kmh", "E_v [km/h]", 3)), &Row::Ev_kmh},
      {Column::text("breakdown", "breakdown level"), &Row::breakdown},
      {Column::text("breakdown_interval", "95 % interval"), &Row::breakdown_interval},
      {Column::number("efficiency", "efficiency", 2), &Row::efficiency},
      {Column::number("anees", "ANEES", 2), &Row::anees},
      {Column::text("records").only_in_files(), &Row::records}};
  return table_of(
      "At the nominal level",
      "Mean errors at the nominal level of each track, with the 95 % interval of E_t; the breakdown level is "
      "the level at which the mean of E_t has doubled or coverage falls below 90 % (\"> x\": not up to the "
      "highest level x). Efficiency: Cramer-Rao bound over RMS error. ANEES: 6 where the covariance of the "
      "estimator is right. E_t leads to the records.",
      fields, rows);
}

std::vector<NominalRow> nominal_rows(const Card& card, const std::string& folder) {
  std::vector<NominalRow> rows;
  for (const CurvePoint& point : card.curves) {
    if (point.is_nominal) rows.push_back(nominal_row(point, card, folder));
  }
  return rows;
}

std::string left_out_text(const Card& card) {
  std::string text;
  for (const auto& [track, reason] : card.left_out)
    text += fmt::format("{}{} ({})", text.empty() ? "Tracks without a result: " : ", ", track, reason);
  return text.empty() ? "" : text + ".";
}

std::vector<std::pair<std::string, std::string>> provenance_of(const Card& card) {
  return {
      {"suite", fmt::format("{}{}, SHA-256 {}", card.suite, card.quick ? " (quick)" : "", card.suite_sha256)},
      {"estimator", card.plan_estimator},
      {"program", json_line(card.program)}};
}

}  // namespace

std::vector<PlacedCard> reference_cards(const Suite& suite) {
  std::vector<PlacedCard> cards;
  for (const EmbeddedFile& file : reference_card_files()) {
    Card card = parse_card(file.text, "results/benchmark/" + std::string(file.name) + "/card.json");
    if (card.suite_sha256 == suite.sha256) cards.push_back({std::move(card), std::string(file.name)});
  }
  return cards;
}

ReportDocument card_document(const Card& card, const Suite& suite,
                             const std::vector<PlacedCard>& references) {
  ReportDocument document;
  document.title = fmt::format("{}: {}{}", card.estimator, card.suite, card.quick ? ", quick run" : "");
  document.abstract =
      suite.title + ". docs/benchmark.md of Sextant defines every number." +
      (card.quick ? " A quick run has one seed and few levels: use it to look, not to publish." : "");
  ReportSection nominal{.name = "nominal", .heading = "At the nominal level"};
  if (!card.left_out.empty()) nominal.paragraphs.push_back(left_out_text(card));
  nominal.tables.push_back({"nominal_level", nominal_table(nominal_rows(card, ""))});
  std::vector<const Card*> behind;
  for (const PlacedCard& reference : references) behind.push_back(&reference.card);
  ReportSection curves{.name = "curves", .heading = "Growth of the errors"};
  curves.figures = curve_figures(suite, {&card}, behind);
  curves.tables.push_back({"breakdown_levels", breakdown_table(card.breakdowns)});
  curves.tables.push_back({"errors_by_level", curve_table(card.curves)});
  ReportSection cost{.name = "cost", .heading = "Time and memory"};
  cost.tables.push_back({"cost_of_a_pair", cost_table(card.costs)});
  document.sections = {std::move(nominal), std::move(curves), std::move(cost)};
  document.provenance = provenance_of(card);
  document.citation = citation();
  return document;
}

OutputFiles card_files(const Card& card, const Suite& suite, int jobs) {
  const ReportDocument document = card_document(card, suite, reference_cards(suite));
  return {{"card.json", json_text(to_json(card))},
          {"card.md", to_markdown(document)},
          {"card.html", report_page(document, jobs)}};
}

double ProfileRow::share_within(double tau) const {
  const auto within = std::ranges::upper_bound(ratios, tau) - ratios.begin();
  return n_cases == 0 ? 0 : static_cast<double>(within) / n_cases;
}

/// Smaller errors are rounding of exact solutions of exact data.
constexpr double rounding_m = 1e-6;

std::vector<ProfileRow> performance_profile(const std::vector<PlacedCard>& cards, const Suite& suite) {
  std::map<std::string, ProfileRow> rows;
  std::map<std::tuple<std::string, std::string, double>, std::map<std::string, double>> errors;
  for (const PlacedCard& placed : cards) {
    for (const std::string& result : placed.card.results) rows[result].estimator = result;
    for (const CurvePoint& point : placed.card.curves) {
      if (!point.Et_m || point.coverage() < suite.min_coverage) continue;
      errors[{point.track, point.body, point.level}].emplace(point.estimator, point.Et_m->value);
    }
  }
  for (const auto& [key, by_estimator] : errors) {
    const double best =
        std::ranges::min_element(by_estimator, {}, [](const auto& e) { return e.second; })->second;
    if (best < rounding_m) continue;
    for (auto& [name, row] : rows) {
      ++row.n_cases;
      const auto error = by_estimator.find(name);
      if (error == by_estimator.end()) continue;
      ++row.n_solved;
      row.ratios.push_back(error->second / best);
    }
  }
  std::vector<ProfileRow> ranked;
  for (auto& [name, row] : rows) {
    std::ranges::sort(row.ratios);
    ranked.push_back(std::move(row));
  }
  std::ranges::stable_sort(ranked, std::greater(), [](const ProfileRow& row) {
    return std::tuple(row.share_within(1), row.share_within(2), row.n_solved);
  });
  return ranked;
}

namespace {

Table profile_table(const std::vector<ProfileRow>& rows) {
  using Row = ProfileRow;
  const auto within = [](double tau) {
    return [tau](const Row& row) { return Cell(100 * row.share_within(tau)); };
  };
  return table_of(
      "Performance profile",
      "Share of cases (track, kind of body, level) in which the mean E_t is within a factor tau of the best "
      "estimator; a case that an estimator does not solve with the required coverage, or did not run, "
      "counts against it.",
      Fields<Row>{{Column::text("estimator"), &Row::estimator},
                  {Column::count("n_cases", "cases"), &Row::n_cases},
                  {Column::count("n_solved", "solved"), &Row::n_solved},
                  {Column::number("within_1", "best [%]", 1), within(1)},
                  {Column::number("within_1_1", "tau 1.1 [%]", 1), within(1.1)},
                  {Column::number("within_2", "tau 2 [%]", 1), within(2)},
                  {Column::number("within_4", "tau 4 [%]", 1), within(4)},
                  {Column::number("within_16", "tau 16 [%]", 1), within(16)}},
      rows);
}

}  // namespace

ReportDocument page_document(const std::vector<PlacedCard>& cards, const Suite& suite) {
  ReportDocument document;
  document.title = "Benchmark " + suite.name;
  document.abstract =
      suite.title + ". Each number leads to its records; docs/benchmark.md of Sextant defines it.";
  std::vector<const Card*> shown;
  std::vector<NominalRow> nominal;
  std::vector<Breakdown> breakdowns;
  std::vector<Cost> costs;
  ReportSection left_out{.name = "left-out", .heading = "What did not run"};
  for (const PlacedCard& placed : cards) {
    shown.push_back(&placed.card);
    std::ranges::move(nominal_rows(placed.card, placed.folder), std::back_inserter(nominal));
    std::ranges::copy(placed.card.costs, std::back_inserter(costs));
    if (!placed.card.left_out.empty())
      left_out.paragraphs.push_back(placed.card.estimator + ": " + left_out_text(placed.card));
  }
  const std::vector<ProfileRow> profile = performance_profile(cards, suite);
  ReportSection overview{.name = "profile", .heading = "Overall"};
  if (cards.size() > 1) overview.figures.push_back(profile_figure(profile));
  overview.tables.push_back({"performance", profile_table(profile)});
  ReportSection table{.name = "nominal", .heading = "All tracks"};
  table.tables.push_back({"nominal_level", nominal_table(nominal)});
  ReportSection curves{.name = "curves", .heading = "Growth of the errors"};
  curves.figures = curve_figures(suite, shown, {});
  ReportSection cost{.name = "cost", .heading = "Time and memory"};
  cost.tables.push_back({"cost_of_a_pair", cost_table(costs)});
  document.sections = {std::move(overview), std::move(table), std::move(curves), std::move(cost)};
  if (!left_out.paragraphs.empty()) document.sections.push_back(std::move(left_out));
  document.provenance = {{"suite", fmt::format("{}, SHA-256 {}", suite.name, suite.sha256)}};
  document.citation = citation();
  return document;
}

OutputFiles page_files(const std::vector<fs::path>& folders, const fs::path& out, int jobs) {
  std::vector<PlacedCard> cards;
  for (const fs::path& folder : folders) {
    const fs::path file = folder / "card.json";
    Card card = parse_card(read_file(file, json_file), file.string());
    if (!cards.empty() &&
        (card.suite_sha256 != cards.front().card.suite_sha256 || card.quick != cards.front().card.quick))
      fail("{}: the card belongs to suite {}{}, the first card to {}{}: give cards of one suite",
           file.string(), card.suite, card.quick ? " (quick)" : "", cards.front().card.suite,
           cards.front().card.quick ? " (quick)" : "");
    cards.push_back({std::move(card),
                     fs::weakly_canonical(folder).lexically_relative(fs::weakly_canonical(out)).string()});
  }
  if (cards.empty()) fail("no cards: expected folders with a card.json");
  const Suite suite = find_suite(cards.front().card.suite);
  if (suite.sha256 != cards.front().card.suite_sha256)
    fail("{}: the card belongs to another version of its suite than this program has: make it again",
         (folders.front() / "card.json").string());
  return {{"index.html", report_page(page_document(cards, suite), jobs)}};
}

}  // namespace sextant
