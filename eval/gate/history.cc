#include "sextant/eval/gate/history.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/gate/accuracy.h"
#include "sextant/eval/gate/speed.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {

namespace {

/// Values of one point by (name, metric).
using Key = std::pair<std::string, std::string>;
using Point = std::map<Key, double>;

/// Returns a file's name with every run of digits padded to the same length, so that the order of such texts
/// is the natural order of the names.
std::string natural_key(const fs::path& path) {
  constexpr size_t longest_name = 255;
  const std::string name = path.filename().string();
  std::string key;
  for (size_t i = 0; i < name.size();) {
    const size_t digits = std::min(name.find_first_not_of("0123456789", i), name.size()) - i;
    if (digits > 0) key.append(longest_name - digits, '0');
    key += name.substr(i, std::max<size_t>(digits, 1));
    i += std::max<size_t>(digits, 1);
  }
  return key;
}

std::vector<fs::path> points_of(const std::vector<fs::path>& paths) {
  std::vector<fs::path> points;
  for (const fs::path& path : paths) {
    if (!fs::exists(path)) fail("{}: does not exist: expected past results", path.string());
    if (fs::is_regular_file(path) || has_results(path) || fs::exists(path / "journal.jsonl") ||
        std::ranges::any_of(fs::directory_iterator(path), is_benchmark_file)) {
      points.push_back(path);
      continue;
    }
    std::vector<fs::path> inside;
    for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
      if (entry.is_directory() || entry.path().extension() == ".json") inside.push_back(entry.path());
    }
    if (inside.empty())
      fail("{}: holds no results: expected records.jsonl, benchmark*.json, or folders with these",
           path.string());
    std::ranges::sort(inside, std::ranges::lexicographical_compare, natural_key);
    points.insert(points.end(), inside.begin(), inside.end());
  }
  return points;
}

std::string label_of(const fs::path& path, const Side& side) {
  std::string label =
      path.filename().empty() ? path.parent_path().filename().string() : path.filename().string();
  if (side.runs.empty() || side.runs.front().provenance.is_null()) return label;
  const std::string commit = side.runs.front().provenance.value("git_commit", std::string());
  if (commit.size() >= 9 && commit.find_first_not_of("0123456789abcdef") >= 9)
    label += " " + commit.substr(0, 9);
  return label;
}

/// Mean errors of one point by subject and metric; the camera and all objects are one subject each.
using PointErrors = std::map<Subject, std::map<std::string, double>, SubjectOrder>;

PointErrors errors_of(const RunFolder& run) {
  std::map<Subject, std::map<std::string, std::vector<double>>, SubjectOrder> samples;
  for (const auto& [subject, cases] : run.subjects) {
    Subject pooled = subject;
    pooled.body = subject.body == "ego" ? "camera" : "objects";
    std::map<std::string, std::vector<double>>& of_subject = samples[pooled];
    for (size_t row = 0; row < cases.size(); ++row) {
      if (!cases.have_truth[row]) continue;
      const bool is_estimated = cases.statuses[row] == Status::ok;
      of_subject["coverage"].push_back(is_estimated ? 1 : 0);
      for (const Interned name : compared_names()) {
        const auto error = number_at(find_in(cases.errors, name), row);
        if (is_estimated && error) of_subject[name].push_back(*error);
      }
    }
  }
  PointErrors errors;
  for (const auto& [subject, of_subject] : samples) {
    for (const auto& [metric, values] : of_subject) {
      if (!values.empty()) errors[subject][metric] = mean(values);
    }
  }
  return errors;
}

/// Returns the first run of a side with its run.json and without its cases.
Side without_cases(const Side& side) {
  const RunFolder& run = side.runs.front();
  return {side.path, {{run.path, {}, run.n_cases, false, run.provenance}}, {}};
}

/// Returns a sentence if a result has another configuration or other data than the result before it;
/// otherwise "".
std::string changed_conditions(const Side& before, const Side& now, const std::string& label,
                               const Policy& policy) {
  if (before.runs.front().provenance.is_null() || now.runs.front().provenance.is_null()) return "";
  std::vector<Mismatch> found = compare_provenance(before, now, policy);
  std::erase_if(found, [](const Mismatch& m) { return m.what != "configuration" && m.what != "data"; });
  if (found.empty()) return "";
  const auto shown_value = [](const std::string& value) { return value.empty() ? "nothing" : value; };
  return fmt::format(
      "{}: its {} differs from that of the result before it ({}: {}, before it {}{}), so its numbers "
      "may differ for this reason alone",
      label, found[0].what, found[0].subject, shown_value(found[0].fresh), shown_value(found[0].base),
      found.size() > 1 ? fmt::format("; and {} more", found.size() - 1) : "");
}

void add_times(const Side& side, const Subjects& reference, BenchmarkTime time, Point& point) {
  if (!side.runs.empty()) {
    for (const auto& [name, of_run] : run_times(side.runs.front().subjects, reference))
      point[{name, "time"}] = of_run.reference_ms * of_run.ratio;
  }
  std::map<Key, std::vector<double>> samples;
  for (const BenchmarkFile& file : side.benchmarks) {
    for (const auto& [name, times] : file.times_ns(time)) {
      for (const double ns : times) samples[{name, "benchmark"}].push_back(ns / 1e6);
    }
  }
  for (const auto& [key, values] : samples) point[key] = median(values);
}

std::string unit_of_series(const std::string& metric) {
  if (const MetricDefinition* error = find_metric(NumberMap::errors, metric)) return error->unit;
  return metric == "coverage" ? "share" : "ms";
}

bool is_time(const std::string& metric) { return unit_of_series(metric) == "ms"; }

/// Smallest number of results that shows their noise; with fewer, no change is marked.
constexpr size_t enough_results = 6;

void find_changes(Series& series, const Policy& policy) {
  std::vector<double> values;
  std::vector<size_t> points;
  for (size_t i = 0; i < series.values.size(); ++i) {
    if (!series.values[i]) continue;
    values.push_back(*series.values[i]);
    points.push_back(i);
  }
  if (values.size() < enough_results) return;
  const double effect = !is_time(series.metric)        ? policy.accuracy.of(series.metric).minimum_effect
                        : series.metric == "benchmark" ? policy.speed.minimum_effect
                                                       : policy.speed.unrepeated_effect;
  for (const size_t i : change_points(values, std::max(1e-9, effect * std::abs(median(values)))))
    series.changes.push_back(points[i]);
}

/// Returns a sentence for each way in which the records of a run are incomplete.
std::vector<std::string> defects_of(const RunFolder& run) {
  std::vector<std::string> defects;
  if (std::string missing = missing_records(run.provenance, run.n_cases, run.path); !missing.empty())
    defects.push_back(std::move(missing));
  uint64_t n_without_errors = 0;
  for (const auto& [subject, cases] : run.subjects) n_without_errors += cases.n_without_errors;
  if (n_without_errors > 0) defects.push_back(missing_errors(run.path, n_without_errors));
  return defects;
}

/// Seeds and frames with truth, by subject: what the means of a point are computed from.
using CasesWithTruth = std::map<Subject, std::vector<SeedFrame>, SubjectOrder>;

CasesWithTruth cases_with_truth(const Subjects& subjects) {
  CasesWithTruth all;
  for (const auto& [subject, cases] : subjects) {
    for (size_t row = 0; row < cases.size(); ++row)
      if (cases.have_truth[row]) all[subject].push_back(cases.case_of(row));
  }
  return all;
}

/// Returns a sentence if a result lacks cases of the result before it, or has further ones of the same data
/// set, estimator and level; otherwise "".
std::string changed_cases(const CasesWithTruth& before, const CasesWithTruth& now, const std::string& label) {
  size_t n_missing = 0, n_new = 0;
  std::string example;
  const std::vector<SeedFrame> none;
  const auto count = [&](const CasesWithTruth& from, const CasesWithTruth& in, size_t& n, const char* what) {
    for (const auto& [subject, cases] : from) {
      const auto other = in.find(subject);
      std::vector<SeedFrame> lost;
      std::ranges::set_difference(cases, other == in.end() ? none : other->second, std::back_inserter(lost));
      if (!lost.empty() && example.empty())
        example = fmt::format("{}: {} of its cases {}", to_string(subject), lost.size(), what);
      n += lost.size();
    }
  };
  count(before, now, n_missing, "missing");
  count(now, before, n_new, "new");
  if (n_missing + n_new == 0) return "";
  return fmt::format(
      "{}: {} cases of the result before it are missing and {} are new ({}), so its means and times may "
      "differ for this reason alone",
      label, n_missing, n_new, example);
}

}  // namespace

History read_history(const std::vector<fs::path>& paths, const Policy& policy) {
  History history;
  std::map<Key, std::vector<std::optional<double>>> all;
  const std::vector<fs::path> points = points_of(paths);
  Subjects reference;  // of the first point that has a run; its times are the reference
  SameDefinitions definitions;
  SubjectNames names;  // of all points, because two points may have one level of different noise
  std::vector<PointErrors> errors;
  std::optional<Side> before;  // without its cases
  CasesWithTruth cases_before;
  const auto put = [&](const Key& key, size_t point, double value) {
    auto& values = all[key];
    values.resize(points.size());
    values[point] = value;
  };
  for (size_t i = 0; i < points.size(); ++i) {
    Side side = read_side(points[i]);
    if (!side.runs.empty() && side.runs.front().provenance.is_object())
      definitions.check(side.runs.front().provenance, side.runs.front().path);
    history.labels.push_back(label_of(points[i], side));
    Point point;
    errors.push_back(side.runs.empty() ? PointErrors() : errors_of(side.runs.front()));
    for (const auto& [subject, ignored] : errors.back()) names.add(subject);
    if (!side.runs.empty()) {
      Side now = without_cases(side);
      std::string changed = before ? changed_conditions(*before, now, history.labels.back(), policy) : "";
      for (std::string& defect : defects_of(side.runs.front())) history.warnings.push_back(std::move(defect));
      CasesWithTruth cases = cases_with_truth(side.runs.front().subjects);
      // Another configuration has other cases.
      if (before && changed.empty()) changed = changed_cases(cases_before, cases, history.labels.back());
      if (!changed.empty()) history.warnings.push_back(std::move(changed));
      before = std::move(now);
      cases_before = std::move(cases);
    }
    const bool is_first = reference.empty() && !side.runs.empty();
    add_times(side, is_first ? side.runs.front().subjects : reference, policy.speed.time, point);
    if (is_first) reference = std::move(side.runs.front().subjects);
    for (const auto& [key, value] : point) put(key, i, value);
  }
  for (size_t i = 0; i < errors.size(); ++i) {
    for (const auto& [subject, by_metric] : errors[i]) {
      for (const auto& [metric, value] : by_metric) put({names(subject), metric}, i, value);
    }
  }
  if (points.size() < 2) fail("{}: one result has no trend: expected at least two", points.front().string());
  for (auto& [key, values] : all) {
    Series series{key.first, key.second, unit_of_series(key.second), std::move(values), {}};
    find_changes(series, policy);
    history.series.push_back(std::move(series));
  }
  return history;
}

Json history_json(const History& history) {
  Json json = {{"points", history.labels}, {"series", Json::array()}};
  for (const Series& series : history.series) {
    Json values = Json::array();
    for (const auto& value : series.values) values.push_back(value ? Json(*value) : Json());
    json["series"].push_back({{"name", series.name},
                              {"metric", series.metric},
                              {"unit", series.unit},
                              {"values", values},
                              {"changes", series.changes}});
  }
  return json;
}

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
  figure.data = figure_data({"point", "label", "value"});
  for (size_t i = 0; i < series.values.size(); ++i)
    figure.data.add_row({i, history.labels[i], series.values[i]});
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
      "{} series over {} results, from {} to {}. A dashed line marks where a level changed. Times are "
      "medians; those of runs are wall-clock.",
      history.series.size(), history.labels.size(), history.labels.front(), history.labels.back());
  Table changes = change_table(history);
  ReportSection levels{"changes-section", "Changes", {}, {}, {}, {}};
  if (changes.rows.empty()) {
    levels.paragraphs = {fmt::format("No level changed. Changes are marked in series of at least {} results.",
                                     enough_results)};
  } else {
    levels.tables = {{"changes", std::move(changes)}};
  }
  document.warnings = history.warnings;
  for (const std::string& warning : document.warnings) document.abstract += " Warning: " + warning + ".";
  document.sections.push_back(std::move(levels));
  std::vector<const Series*> sorted;
  for (const Series& series : history.series) sorted.push_back(&series);
  std::ranges::stable_sort(sorted, std::greater(), [](const Series* s) { return !s->changes.empty(); });
  ReportSection curves{"series-section", "Series", {}, {}, {}, {}};
  curves.tables = {{"series", latest_table(history)}};
  for (size_t i = 0; i < std::min(sorted.size(), max_figures); ++i)
    curves.figures.push_back(series_figure(history, *sorted[i], i));
  if (sorted.size() > max_figures) {
    curves.paragraphs = {fmt::format("{} of {} series are drawn; series whose level changed come first.",
                                     max_figures, sorted.size())};
  }
  document.sections.push_back(std::move(curves));
  document.provenance = {{"results", fmt::format("{}", history.labels.size())},
                         {"page by", "sextant " + version()}};
  document.citation = citation();
  return document;
}

}  // namespace sextant
