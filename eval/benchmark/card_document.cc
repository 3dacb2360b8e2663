#include "sextant/eval/benchmark/card_document.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <set>
#include <span>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {

std::span<const EmbeddedFile> reference_card_files();

namespace {

/// Returns the interval of an error, in mm.
std::optional<Interval> in_mm(const std::optional<IntervalEstimate>& error_m) {
  if (!error_m || !error_m->interval) return std::nullopt;
  return Interval{1e3 * error_m->interval->low, 1e3 * error_m->interval->high};
}

// ---- figures

/// One point of a figure; E_t in mm.
struct PlotPoint {
  std::string body, series;
  double level = 0, error_mm = 0;
  std::optional<Interval> interval{};
};

struct Series {
  std::string name;
  bool is_reference = false;
};

/// The points of a track by series; the references come first, so that they are drawn behind.
struct TrackPoints {
  const SystemStyles& styles;  ///< of the series of all tracks
  std::vector<Series> series;
  std::vector<PlotPoint> points;

  void add(const Card& card, const std::string& track, bool is_reference) {
    for (const CurvePoint& p : card.curves) {
      if (p.track != track || !p.Et_m || p.Et_m->value <= 0) continue;
      const auto same = [&](const Series& s) {
        return s.name == p.estimator && s.is_reference == is_reference;
      };
      if (std::ranges::none_of(series, same)) series.push_back({p.estimator, is_reference});
      points.push_back({p.body, key(series.back()), p.level, 1e3 * p.Et_m->value, in_mm(p.Et_m)});
    }
  }
  static std::string key(const Series& s) { return (s.is_reference ? "reference " : "") + gp_cell(s.name); }
};

/// References are thin dashed lines behind the cards.
std::string style_of(const Series& series, const TrackPoints& of) {
  return series.is_reference
             ? fmt::format("with lines lc rgb \"{}\" lw 1 dt 2", of.styles.colour(series.name))
             : of.styles.line(series.name);
}

Panel panel_of(const SuiteTrack& track, const std::string& body, const TrackPoints& of) {
  Panel panel{body == "camera" ? "camera" : "objects", "", {}};
  panel.settings = fmt::format(
      "set logscale y\nset format y \"%g\"\nset ylabel \"mean E_t [mm]\" noenhanced\n"
      "set xlabel {} noenhanced offset 0,0.4\n"
      "set arrow from first {},graph 0 to first {},graph 1 nohead lc rgb \"#404040\" dt 3 lw 0.7\n",
      gp_text(track.level_title), gp_number(track.nominal), gp_number(track.nominal));
  for (const Series& series : of.series) {
    const std::string x =
        only_where({{"body", body}, {"series", TrackPoints::key(series)}}, "column(\"level\")");
    if (!series.is_reference)
      panel.plots.push_back(interval_plot(x, "low", "high", of.styles.colour(series.name), 1));
    panel.plots.push_back(fmt::format("data using {}:(column(\"error_mm\")) {}", x, style_of(series, of)));
  }
  return panel;
}

Figure figure_of(const SuiteTrack& track, const TrackPoints& of) {
  Figure figure{.name = "track_" + track.name};
  Fields<PlotPoint> fields = {{Column::text("body"), &PlotPoint::body},
                              {Column::text("series"), &PlotPoint::series},
                              {Column::text("level"), &PlotPoint::level},
                              {Column::text("error_mm"), &PlotPoint::error_mm}};
  fields.add_range({Column::text("low"), Column::text("high")}, &PlotPoint::interval);
  figure.data = table_of("", "", fields, of.points);
  std::vector<Panel> panels;
  for (const std::string_view body : names_of(BodyKind{})) {
    const auto has_body = [&](const PlotPoint& point) { return point.body == body; };
    if (std::ranges::any_of(of.points, has_body)) panels.push_back(panel_of(track, std::string(body), of));
  }
  std::vector<LegendEntry> legend;
  for (const bool is_reference : {false, true}) {
    for (const Series& series : of.series) {
      if (series.is_reference == is_reference)
        legend.push_back(
            {estimator_title(series.name) + (is_reference ? ", reference" : ""), style_of(series, of)});
    }
  }
  set_panels({.columns = panels.size(), .width_cm = 9.0 * static_cast<double>(panels.size())}, legend, panels,
             figure);
  figure.caption = fmt::format(
      "{}: mean E_t with 95 % intervals; the dotted line is the nominal level. A point is missing where "
      "nothing was estimated.",
      track.title);
  return figure;
}

/// Returns figures of the errors over the noise level, one for each track with two levels or more: E_t of the
/// camera and of the objects, each with its 95 % interval. References are dashed lines behind the cards; one
/// whose estimator is also among `cards` is left out.
std::vector<Figure> curve_figures(const Suite& suite, const std::vector<const Card*>& cards,
                                  const std::vector<const Card*>& references) {
  std::set<std::string> shown;
  for (const Card* card : cards) shown.insert(card->results.begin(), card->results.end());
  std::vector<const Card*> behind = references;
  std::erase_if(behind, [&](const Card* card) {
    return std::ranges::any_of(card->results, [&](const auto& r) { return shown.contains(r); });
  });
  std::vector<std::string> names;
  for (const auto& group : {cards, behind}) {  // a card has its usual colour
    std::vector<std::string> of_group;
    for (const Card* card : group) {
      for (const CurvePoint& p : card->curves) of_group.push_back(p.estimator);
    }
    std::ranges::move(sorted_systems(std::move(of_group)), std::back_inserter(names));
  }
  const SystemStyles styles(names);
  std::vector<Figure> figures;
  for (const SuiteTrack& track : suite.tracks) {
    TrackPoints of{styles, {}, {}};
    for (const Card* card : behind) of.add(*card, track.name, /*is_reference=*/true);
    for (const Card* card : cards) of.add(*card, track.name, /*is_reference=*/false);
    std::set<double> levels;
    for (const PlotPoint& point : of.points) levels.insert(point.level);
    if (levels.size() > 1) figures.push_back(figure_of(track, of));
  }
  return figures;
}

constexpr const char* profile_name = "performance_profile";

Figure profile_figure(const std::vector<ProfileRow>& rows) {
  constexpr double largest = 16;
  Figure figure{.name = profile_name, .data = figure_data({"estimator", "tau", "share"})};
  for (const ProfileRow& row : rows) {
    const auto add = [&](double tau) {
      figure.data.add_row({gp_cell(row.estimator), tau, row.share_within(tau)});
    };
    add(1);
    for (const double ratio : row.ratios) {
      if (ratio > 1 && ratio <= largest) add(ratio);
    }
    add(largest);
  }
  Panel panel{"",
              "set logscale x 2\nset xrange [1:16]\nset yrange [0:1.02]\nset ylabel \"share of cases\"\n"
              "set xlabel \"tau: mean E_t over that of the best estimator\" noenhanced\n",
              {}};
  std::vector<LegendEntry> legend;
  const SystemStyles styles = styles_of(rows);
  for (const ProfileRow& row : rows) {
    // Different dashes, so that of two equal curves both are seen.
    const std::string style = fmt::format("with steps lc rgb \"{}\" dt {} lw 2", styles.colour(row.estimator),
                                          legend.size() % 4 + 1);
    panel.plots.push_back(fmt::format("data using {}:(column(\"share\")) {}",
                                      only_where({{"estimator", gp_cell(row.estimator)}}, "column(\"tau\")"),
                                      style));
    legend.push_back({estimator_title(row.estimator), style});
  }
  set_panels({.columns = 1, .width_cm = 16, .panel_height_cm = 7}, legend, {panel}, figure);
  figure.caption =
      "Performance profile: the share of cases (track, kind of body, level) in which the error of an "
      "estimator is at most tau times that of the best one.";
  return figure;
}

// ---- tables

/// Row of a card: errors of one track and kind of body at the nominal level.
struct NominalRow {
  const CurvePoint* point;
  const BreakdownLevel* breakdown;  ///< null if the track has one level only
  std::string records;
};

Table nominal_table(const std::vector<NominalRow>& rows, const Suite& suite) {
  using Row = NominalRow;
  const auto value = [](std::optional<IntervalEstimate> CurvePoint::*estimate, double factor = 1) {
    return [=](const Row& row) {
      const auto& of_point = row.point->*estimate;
      return of_point ? Cell(factor * of_point->value) : Cell();
    };
  };
  Fields<CurvePoint> labels = {
      {Column::text("estimator").folded(), &CurvePoint::estimator},
      {Column::text("track"), &CurvePoint::track},
      {Column::text("body"), &CurvePoint::body},
      {Column::number("nominal", "nominal level", 2).with_significant(3), &CurvePoint::level},
      {Column::number("coverage_percent", "coverage [%]", 1),
       [](const CurvePoint& point) { return 100 * point.coverage(); }}};
  Fields<Row> fields;
  fields.add(labels, &Row::point);
  fields.add(Column::number("Et_mm", "E_t [mm]", 2).with_significant(3).leading_to("records"),
             value(&CurvePoint::Et_m, 1e3));
  std::vector<Column> range = range_columns("Et_low_mm", "Et_high_mm", 2);
  fields.add_range({range[0].with_significant(3), range[1].with_significant(3)},
                   [](const Row& row) { return in_mm(row.point->Et_m); });
  fields.add({{Column::number("ER_deg", "E_R [deg]", 4).with_significant(3), value(&CurvePoint::ER_deg)},
              {Column::number("Ev_kmh", "E_v [km/h]", 3).with_significant(3), value(&CurvePoint::Ev_kmh)},
              {Column::text("breakdown", "breakdown level"),
               [](const Row& row) { return row.breakdown ? row.breakdown->text() : ""; }},
              {Column::text("breakdown_interval", "95 % interval"),
               [](const Row& row) { return row.breakdown ? row.breakdown->interval_text() : ""; }},
              {Column::number("efficiency", "efficiency", 2), value(&CurvePoint::efficiency)},
              {Column::number("anees", "ANEES", 2), [](const Row& row) { return row.point->anees; }},
              {Column::text("records").only_in_files(), &Row::records}});
  return table_of(
      "At the nominal level",
      fmt::format(
          "Mean errors at the nominal level of each track, with the 95 % interval of E_t; the breakdown "
          "level is the level at which {} (\"> x\": not up to the highest level x). Efficiency: "
          "Cramer-Rao bound over RMS error. ANEES: 6 where the covariance of the estimator is right. E_t "
          "leads to the records.",
          suite.breakdown_text()),
      fields, rows);
}

std::vector<NominalRow> nominal_rows(const Card& card, const std::string& folder) {
  std::vector<NominalRow> rows;
  for (const CurvePoint& point : card.curves) {
    if (!point.is_nominal) continue;
    const auto breakdown = std::ranges::find_if(card.breakdowns, [&](const Breakdown& of) {
      return of.estimator == point.estimator && of.track == point.track && of.body == point.body;
    });
    rows.push_back({&point, breakdown == card.breakdowns.end() ? nullptr : &breakdown->at,
                    folder.empty() ? point.records : folder + "/" + point.records});
  }
  return rows;
}

std::string left_out_text(const Card& card) {
  std::string text;
  for (const auto& [track, reason] : card.left_out)
    text += fmt::format("{}{} ({})", text.empty() ? "Tracks without a result: " : ", ", track, reason);
  return text.empty() ? "" : text + ".";
}

/// Returns the recorded options that differ from the defaults of the estimator; all options of one that is
/// not part of this program.
Json changed_options(const Card& card) {
  const auto known = all_estimators();
  const auto same = std::ranges::find(known, card.plan_estimator, &EstimatorEntry::name);
  if (same == known.end()) return card.options;
  const Json defaults = make_case_estimator(card.plan_estimator)->options();
  Json changed = Json::object();
  for (const auto& item : card.options.items()) {
    if (defaults.value(item.key(), Json()) != item.value()) changed[item.key()] = item.value();
  }
  return changed;
}

std::vector<std::pair<std::string, std::string>> provenance_of(const Card& card) {
  std::vector<std::pair<std::string, std::string>> rows = {
      {"suite", fmt::format("{}{}, SHA-256 {}", card.suite, card.quick ? " (quick)" : "", card.suite_sha256)},
      {"estimator", card.plan_estimator}};
  const Json changed = changed_options(card);
  if (!changed.empty()) rows.emplace_back("options", json_line(changed));
  if (!card.fingerprint.empty()) rows.emplace_back("fingerprint", card.fingerprint);
  rows.emplace_back("program", json_line(card.program));
  return rows;
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
  ReportSection nominal{.name = "nominal", .heading = "At the nominal level", .paragraphs = card_notes(card)};
  if (!card.left_out.empty()) nominal.paragraphs.push_back(left_out_text(card));
  nominal.tables.push_back({"nominal_level", nominal_table(nominal_rows(card, ""), suite)});
  std::vector<const Card*> behind;
  for (const PlacedCard& reference : references) behind.push_back(&reference.card);
  ReportSection curves{.name = "curves", .heading = "Growth of the errors"};
  curves.figures = curve_figures(suite, {&card}, behind);
  Table breakdowns = breakdown_table(card.breakdowns);
  breakdowns.caption = fmt::format(
      "The level at which {}, linearly interpolated between levels; \"> x\": not up to the highest level x.",
      suite.breakdown_text());
  curves.tables.push_back({"breakdown_levels", std::move(breakdowns)});
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

namespace {

/// Smaller errors are rounding of exact solutions of exact data: they count as this error.
constexpr double rounding_m = 1e-6;

}  // namespace

std::vector<ProfileRow> performance_profile(const std::vector<PlacedCard>& cards) {
  std::map<std::string, ProfileRow> rows;
  // Errors of the estimators that solve a case; the entry of a case that nobody solves is empty.
  std::map<std::tuple<std::string, std::string, double>, std::map<std::string, double>> errors;
  for (const PlacedCard& placed : cards) {
    for (const std::string& result : placed.card.results) {
      if (!rows.emplace(result, ProfileRow{result}).second)
        fail("two cards have results with the name '{}': expected different names", result);
    }
    for (const CurvePoint& point : placed.card.curves) {
      if (point.n_truth == 0) continue;
      std::map<std::string, double>& by_estimator = errors[{point.track, point.body, point.level}];
      if (point.best_Et_m) by_estimator.emplace(point.estimator, std::max(*point.best_Et_m, rounding_m));
    }
  }
  for (const auto& [key, by_estimator] : errors) {
    double best = std::numeric_limits<double>::infinity();
    for (const auto& [name, error] : by_estimator) best = std::min(best, error);
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

Table profile_table(const std::vector<ProfileRow>& rows, const Suite& suite) {
  using Row = ProfileRow;
  const auto within = [](double tau) {
    return [tau](const Row& row) { return Cell(100 * row.share_within(tau)); };
  };
  return table_of(
      "Performance profile",
      fmt::format(
          "Share of cases (track, kind of body, level) in which the mean E_t of the best {:g} % of the frame "
          "pairs is within a factor tau of the best estimator. Pairs without a motion are the worst ones; a "
          "case with fewer motions than that, or that an estimator did not run, counts against it, and one "
          "that no estimator solves against all. Errors below 1 um count as 1 um.",
          100 * suite.min_coverage),
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

/// Adds the folder of a card to the names of its results that other cards have as well.
std::vector<PlacedCard> with_different_names(std::vector<PlacedCard> cards) {
  std::map<std::string, int> uses;
  for (const PlacedCard& placed : cards) {
    for (const std::string& result : placed.card.results) ++uses[result];
  }
  for (PlacedCard& placed : cards) {
    const auto rename = [&](std::string& name) {
      const auto of_name = uses.find(name);
      if (of_name != uses.end() && of_name->second > 1) name += fmt::format(" ({})", placed.folder);
    };
    Card& card = placed.card;
    rename(card.estimator);
    for (std::string& result : card.results) rename(result);
    for (CurvePoint& point : card.curves) rename(point.estimator);
    for (Breakdown& breakdown : card.breakdowns) rename(breakdown.estimator);
    for (Cost& cost : card.costs) rename(cost.estimator);
  }
  return cards;
}

}  // namespace

ReportDocument page_document(const std::vector<PlacedCard>& placed_cards, const Suite& suite) {
  const std::vector<PlacedCard> cards = with_different_names(placed_cards);
  ReportDocument document;
  document.title = "Benchmark " + suite.name;
  document.abstract =
      suite.title + ". Each number leads to its records; docs/benchmark.md of Sextant defines it.";
  std::vector<const Card*> shown;
  std::vector<NominalRow> nominal;
  std::vector<Breakdown> breakdowns;
  std::vector<Cost> costs;
  ReportSection overview{.name = "profile", .heading = "Overall"};
  ReportSection left_out{.name = "left-out", .heading = "What did not run"};
  for (const PlacedCard& placed : cards) {
    for (const std::string& note : card_notes(placed.card))
      overview.paragraphs.push_back(placed.card.estimator + ": " + note);
    shown.push_back(&placed.card);
    std::ranges::move(nominal_rows(placed.card, placed.folder), std::back_inserter(nominal));
    std::ranges::copy(placed.card.costs, std::back_inserter(costs));
    if (!placed.card.left_out.empty())
      left_out.paragraphs.push_back(placed.card.estimator + ": " + left_out_text(placed.card));
  }
  const std::vector<ProfileRow> profile = performance_profile(cards);
  if (cards.size() > 1) overview.figures.push_back(profile_figure(profile));
  overview.tables.push_back({"performance", profile_table(profile, suite)});
  ReportSection table{.name = "nominal", .heading = "All tracks"};
  table.tables.push_back({"nominal_level", nominal_table(nominal, suite)});
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

OutputFiles page_files(const std::vector<fs::path>& folders, const std::string& requested_suite,
                       const fs::path& out, int jobs) {
  if (folders.empty()) fail("no cards: expected folders with a card.json");
  const Suite suite = suite_of(stored_card(folders.front()), requested_suite, folders.front());
  std::vector<PlacedCard> cards;
  std::set<fs::path> places;
  for (const fs::path& folder : folders) {
    Card card = stored_card(folder);
    check_suite(card, suite, folder);
    if (!cards.empty() && card.quick != cards.front().card.quick)
      fail("{}: is the card of a {} run, the first card of a {} one: give cards of one kind",
           (folder / "card.json").string(), card.quick ? "quick" : "complete",
           card.quick ? "complete" : "quick");
    const fs::path place = fs::weakly_canonical(folder);
    if (!places.insert(place).second) fail("{}: the card is given twice", (folder / "card.json").string());
    cards.push_back({std::move(card), place.lexically_relative(fs::weakly_canonical(out)).string()});
  }
  const ReportDocument document = page_document(cards, suite);
  OutputFiles files = {{"index.html", report_page(document, jobs)}};
  const std::string picture = std::string(profile_name) + ".svg";  // for a README
  for (const ReportSection& section : document.sections) {
    for (const Figure& figure : section.figures)
      if (figure.name == profile_name) files[picture] = draw_svg({figure}, jobs).at(picture);
  }
  return files;
}

}  // namespace sextant
