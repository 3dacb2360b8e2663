#include "sextant/eval/gate/history.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sextant/base/files.h"
#include "sextant/eval/gate/accuracy.h"
#include "sextant/eval/gate/speed.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

/// Values of one point by (name, metric).
using Key = std::pair<std::string, std::string>;
using Point = std::map<Key, double>;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Natural order: runs of digits compare by value, other characters one by one.
bool natural_less(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const size_t end_a = std::min(a.find_first_not_of("0123456789", i), a.size());
      const size_t end_b = std::min(b.find_first_not_of("0123456789", j), b.size());
      const std::string x = a.substr(i, end_a - i), y = b.substr(j, end_b - j);
      const size_t width = std::max(x.size(), y.size());
      const std::string padded_x = std::string(width - x.size(), '0') + x;
      const std::string padded_y = std::string(width - y.size(), '0') + y;
      if (padded_x != padded_y) return padded_x < padded_y;
      i = end_a;
      j = end_b;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i;
      ++j;
    }
  }
  return a.size() - i < b.size() - j;
}

std::vector<fs::path> points_of(const std::vector<fs::path>& paths) {
  std::vector<fs::path> points;
  for (const fs::path& path : paths) {
    if (!fs::exists(path)) fail("{}: does not exist: expected past results", path.string());
    if (fs::is_regular_file(path) || fs::exists(path / "records.jsonl") ||
        std::ranges::any_of(fs::directory_iterator(path), is_benchmark_file)) {
      points.push_back(path);
      continue;
    }
    std::vector<fs::path> inside;
    for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
      if (entry.is_directory() || entry.path().extension() == ".json") inside.push_back(entry.path());
    }
    if (inside.empty()) fail("{}: holds no results", path.string());
    std::ranges::sort(inside, [](const fs::path& a, const fs::path& b) {
      return natural_less(a.filename().string(), b.filename().string());
    });
    points.insert(points.end(), inside.begin(), inside.end());
  }
  return points;
}

std::string label_of(const fs::path& path, const Side& side) {
  std::string label =
      path.filename().empty() ? path.parent_path().filename().string() : path.filename().string();
  if (side.runs.empty() || side.runs.front().provenance.is_null()) return label;
  const std::string commit = side.runs.front().provenance.value("git_commit", std::string());
  if (commit.size() >= 9 && commit.find_first_not_of("0123456789abcdef-dirty") == std::string::npos)
    label += " " + commit.substr(0, 9);
  return label;
}

void add_errors(const RunFolder& run, Point& point) {
  std::map<Key, std::vector<double>> samples;
  for (const SubjectCases& cases : run.subjects) {
    Subject subject = cases.subject;
    subject.body = subject.body == "ego" ? "camera" : "objects";
    const std::string group = to_string(subject);
    std::vector<double>& coverage = samples[{group, "coverage"}];
    for (size_t row = 0; row < cases.size(); ++row) {
      if (cases.have_truth[row]) coverage.push_back(cases.statuses[row] == Status::ok ? 1 : 0);
    }
    for (const MetricDefinition* metric : metrics_for(compared)) {
      const NumberColumn* errors = find_column(cases.errors, metric->name);
      if (errors == nullptr) continue;
      std::vector<double>& sample = samples[{group, metric->name}];
      for (size_t row = 0; row < cases.size(); ++row) {
        if (cases.have_truth[row] && cases.statuses[row] == Status::ok && errors->has(row))
          sample.push_back(errors->numbers[row]);
      }
    }
  }
  std::erase_if(samples, [](const auto& of) { return of.second.empty(); });
  for (const auto& [key, values] : samples) point[key] = mean(values);
}

void add_times(const Side& side, const std::vector<SubjectCases>& reference, Point& point) {
  if (!side.runs.empty()) {
    for (const auto& [name, time] : run_times(side.runs.front().subjects, reference))
      point[{name, "time"}] = time.reference_ms * time.ratio;
  }
  std::map<Key, std::vector<double>> samples;
  for (const BenchmarkFile& file : side.benchmarks) {
    for (const auto& [name, times] : file.cpu_ns) {
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

/// Fewer times do not show their own noise.
constexpr size_t enough_times = 6;

void find_changes(Series& series, const Policy& policy) {
  std::vector<double> values;
  std::vector<size_t> points;
  for (size_t i = 0; i < series.values.size(); ++i) {
    if (!series.values[i]) continue;
    values.push_back(*series.values[i]);
    points.push_back(i);
  }
  if (values.size() < (is_time(series.metric) ? enough_times : 2)) return;
  const double effect = !is_time(series.metric)        ? policy.accuracy.of(series.metric).minimum_effect
                        : series.metric == "benchmark" ? policy.speed.minimum_effect
                                                       : policy.speed.unrepeated_effect;
  for (const size_t i : change_points(values, std::max(1e-9, effect * std::abs(median(values)))))
    series.changes.push_back(points[i]);
}

}  // namespace

History read_history(const std::vector<fs::path>& paths, const Policy& policy) {
  History history;
  std::map<Key, std::vector<std::optional<double>>> all;
  const std::vector<fs::path> points = points_of(paths);
  std::vector<SubjectCases> reference;  // first point with times of runs; its times are the reference
  for (size_t i = 0; i < points.size(); ++i) {
    Side side = read_side(points[i]);
    history.labels.push_back(label_of(points[i], side));
    Point point;
    if (!side.runs.empty()) add_errors(side.runs.front(), point);
    const bool is_first = reference.empty() && !side.runs.empty();
    add_times(side, is_first ? side.runs.front().subjects : reference, point);
    if (is_first) reference = std::move(side.runs.front().subjects);
    for (const auto& [key, value] : point) {
      auto& values = all[key];
      values.resize(points.size());
      values[i] = value;
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

}  // namespace sextant
