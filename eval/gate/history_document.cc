#include <algorithm>
#include <numeric>

#include "sextant/base/error.h"
#include "sextant/eval/gate/history.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr size_t max_figures = 60;

/// Returns the known values of the points begin .. end - 1.
std::vector<double> known(const Series& series, size_t begin, size_t end = SIZE_MAX) {
  std::vector<double> values;
  for (size_t i = begin; i < std::min(end, series.values.size()); ++i) {
    if (series.values[i]) values.push_back(*series.values[i]);
  }
  return values;
}

/// Median of the level that begins at point `begin`.
double level_after(const Series& series, size_t begin) {
  const auto next = std::ranges::upper_bound(series.changes, begin);
  return median(known(series, begin, next == series.changes.end() ? SIZE_MAX : *next));
}

double level_before(const Series& series, size_t change) {
  const auto at = std::ranges::lower_bound(series.changes, change);
  return level_after(series, at == series.changes.begin() ? 0 : *(at - 1));
}

std::string number_title(const Series& series) { return fmt::format("{} [{}]", series.metric, series.unit); }

Table change_table(const History& history) {
  struct Change {
    std::string point;
    const Series* series;
    double before, after;
  };
  std::vector<Change> changes;
  for (size_t i = 0; i < history.labels.size(); ++i) {
    for (const Series& series : history.series) {
      if (std::ranges::find(series.changes, i) != series.changes.end())
        changes.push_back({history.labels[i], &series, level_before(series, i), level_after(series, i)});
    }
  }
  return table_of<Change>(
      "Changes of level", "Median before and after, over the points of the two levels.",
      {{Column::text("point", "from"), &Change::point},
       {Column::text("series"), [](const Change& c) { return c.series->name; }},
       {Column::text("metric", "number"), [](const Change& c) { return number_title(*c.series); }},
       {Column::number("before", 6), &Change::before},
       {Column::number("after", 6), &Change::after},
       {Column::number("change_percent", "change [%]", 1),
        [](const Change& c) { return c.before > 0 ? Cell(100 * (c.after / c.before - 1)) : Cell(); }}},
      changes);
}

Table latest_table(const History& history) {
  return table_of<Series>(
      "All series", "",
      {{Column::text("series"), &Series::name},
       {Column::text("metric", "number"), number_title},
       {Column::count("n", "points"), [](const Series& s) { return known(s, 0).size(); }},
       {Column::number("first", 6), [](const Series& s) { return known(s, 0).front(); }},
       {Column::number("last", 6), [](const Series& s) { return known(s, 0).back(); }},
       {Column::count("n_changes", "changes"), [](const Series& s) { return s.changes.size(); }}},
      history.series);
}

Figure series_figure(const History& history, const Series& series, size_t number) {
  Figure figure;
  figure.name = fmt::format("series-{}", number);
  figure.caption = fmt::format("{}: {}{}", series.name, number_title(series),
                               series.changes.empty() ? "" : "; lines: the level changed");
  std::vector<size_t> points(series.values.size());
  std::iota(points.begin(), points.end(), size_t{0});
  figure.data = table_of<size_t>("", "",
                                 {{Column::text("point"), [](size_t i) { return i; }},
                                  {Column::text("label"), [&](size_t i) { return history.labels[i]; }},
                                  {Column::text("value"), [&](size_t i) { return series.values[i]; }}},
                                 points);
  double highest = 0;
  for (const std::optional<double>& value : series.values) highest = std::max(highest, value.value_or(0));
  std::string& script = figure.script;
  std::string tics;
  const size_t step = (history.labels.size() + 7) / 8;  // at most eight labels on the axis
  for (size_t i = 0; i < history.labels.size(); i += step)
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", gp_tic(history.labels[i]), i);
  script = fmt::format("set xtics rotate by -30 noenhanced ({})\n", tics);
  script += fmt::format("set xrange [-0.5:{}]\nset yrange [0:{}]\nset ylabel {} noenhanced\nunset key\n",
                        static_cast<double>(series.values.size()) - 0.5, highest > 0 ? 1.15 * highest : 1.0,
                        gp_text(number_title(series)));
  for (const size_t change : series.changes) {
    const double x = static_cast<double>(change) - 0.5;
    script += fmt::format("set arrow from {0}, graph 0 to {0}, graph 1 nohead lw 1.5 dt 2 lc rgb \"{1}\"\n",
                          x, line_colour(1));
  }
  script += fmt::format(
      "plot data using (column(\"point\")):(column(\"value\")) with linespoints pt {} ps 0.5 lw 1.2 lc rgb "
      "\"{}\"\n",
      filled_point(0), line_colour(0));
  return figure;
}

}  // namespace

ReportDocument history_document(const History& history) {
  ReportDocument document;
  document.title = "Trend";
  document.abstract = fmt::format(
      "{} series over {} results, from {} to {}. A dashed line marks where a "
      "level changed. Times are medians; those of runs are wall-clock.",
      history.series.size(), history.labels.size(), history.labels.front(), history.labels.back());
  Table changes = change_table(history);
  ReportSection levels{"changes-section", "Changes", {}, {}, {}, {}};
  if (changes.rows.empty()) {
    levels.paragraphs = {"No level changed."};
  } else {
    levels.tables = {{"changes", std::move(changes)}};
  }
  document.sections.push_back(std::move(levels));
  std::vector<const Series*> sorted;
  for (const Series& series : history.series) sorted.push_back(&series);
  std::ranges::stable_sort(sorted, std::greater(), [](const Series* s) { return !s->changes.empty(); });
  ReportSection curves{"series-section", "Series", {}, {}, {}, {}};
  curves.tables = {{"series", latest_table(history)}};
  for (size_t i = 0; i < std::min(sorted.size(), max_figures); ++i)
    curves.figures.push_back(series_figure(history, *sorted[i], i));
  if (sorted.size() > max_figures) {
    curves.paragraphs = {
        fmt::format("{} of {} series are drawn, those that changed first.", max_figures, sorted.size())};
  }
  document.sections.push_back(std::move(curves));
  document.provenance = {{"results", fmt::format("{}", history.labels.size())},
                         {"page by", "sextant " + version()}};
  document.citation = citation();
  return document;
}

}  // namespace sextant
