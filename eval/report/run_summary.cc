#include "sextant/eval/report/run_summary.h"

#include <fmt/format.h>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/summary.h"

namespace sextant {

namespace {

BodySummary summarize_body(const RecordRefs& records, const MetricPreset& preset) {
  BodySummary row{CurveKey::of("", NoiseLevelKey::of(*records.front())), static_cast<int>(records.size())};
  const RecordRefs estimated = records_where(records, is_evaluated);
  row.n_truth = static_cast<int>(records_where(records, has_truth).size());
  row.n_estimated = static_cast<int>(estimated.size());
  if (row.n_truth > 0) row.coverage = static_cast<double>(row.n_estimated) / row.n_truth;
  row.other = other_statuses(records);
  for (const MetricDefinition* metric : metrics_for(in_summary)) {
    if (const auto number = summary_number(estimated, *metric, preset)) row.metrics[metric->name] = *number;
  }
  return row;
}

/// Groups records in the order of the rows of a summary.
auto by_body(const std::vector<Record>& records) {
  return group_by(
      records, [](const Record& r) { return std::tuple(r.dataset, r.sequence, r.estimator, order_of(r)); });
}

/// Describes the error of the camera's steps that is the same in every pair, which measurement noise cannot
/// cause. Returns nullopt unless the mean along an axis exceeds three standard errors and 0.1 mm. Errors are
/// averaged over the seeds of a frame first, because seeds share the errors of the truth.
std::optional<std::string> systematic_note(const RecordRefs& ego) {
  std::map<int, std::pair<Eigen::Vector3d, int>> sums;
  for (const Record* record : ego) {
    const auto x = find_number(record->values, "step_error_x_m");
    const auto y = find_number(record->values, "step_error_y_m");
    const auto z = find_number(record->values, "step_error_z_m");
    if (!x || !y || !z) continue;
    auto& [sum, n] = sums.try_emplace(record->frame, Eigen::Vector3d::Zero(), 0).first->second;
    sum += Eigen::Vector3d(*x, *y, *z);
    ++n;
  }
  std::vector<int> frames;
  std::vector<Eigen::Vector3d> errors_m;
  for (const auto& [frame, sum] : sums) {
    frames.push_back(frame);
    errors_m.emplace_back(sum.first / sum.second);
  }
  const std::optional<StepErrors> errors = step_errors(frames, errors_m);
  if (!errors) return std::nullopt;
  const Eigen::Array3d least = (3 * errors->scatter_m / std::sqrt(errors->n)).cwiseMax(1e-4);
  if ((errors->mean_m.array().abs() <= least).all()) return std::nullopt;
  return fmt::format("Estimated minus true step of ego, {} {} {}: {}.", ego.front()->dataset,
                     ego.front()->sequence, ego.front()->estimator, errors->text());
}

/// Notes the accuracy of the truth for each sequence whose records state it.
std::vector<std::string> floor_notes(const std::vector<Record>& records) {
  std::map<std::string, double> floors;
  for (const Record& record : records) {
    if (const auto floor_m = find_number(record.values, "step_floor_m")) {
      floors[fmt::format("{} {}", record.dataset, record.sequence)] = *floor_m;
    }
  }
  std::vector<std::string> notes;
  for (const auto& [sequence, floor_m] : floors) {
    notes.push_back(
        fmt::format("Ground-truth floor of {}: its true steps are off by {:.4f} m RMS along the way; "
                    "E_t [m] of ego cannot be resolved below this.",
                    sequence, floor_m));
  }
  return notes;
}

}  // namespace

std::vector<BodySummary> summarize(const std::vector<Record>& records, const MetricPreset& preset) {
  std::vector<BodySummary> rows;
  for (const auto& [key, of_body] : by_body(records)) rows.push_back(summarize_body(of_body, preset));
  return rows;
}

std::optional<double> summary_number(const RecordRefs& estimated, const MetricDefinition& metric,
                                     const MetricPreset& preset) {
  if (estimated.empty()) return std::nullopt;
  RecordRefs over = estimated;
  if (metric.is(beside_speed))  // speeds beside an error are averaged over the same pairs
    std::erase_if(over, [&](const Record* r) { return !r->errors.contains(preset.velocity_key); });
  const std::string& key = estimated.front()->is_ego() ? metric.name : preset.object_key(metric.name);
  const std::vector<double> numbers = numbers_of(over, metric.map, key);
  if (numbers.empty()) return std::nullopt;
  return preset.aggregates(metric.name) && preset.aggregate == Aggregate::rmse ? rmse(numbers)
                                                                               : mean(numbers);
}

std::string other_statuses(const RecordRefs& records) {
  std::map<std::string, int> others;
  for (const Record* record : records) {
    if (record->status == Status::ok) continue;
    const std::string gate =
        record->status == Status::gated ? fmt::format("({})", to_string(record->gate)) : "";
    ++others[std::string(to_string(record->status)) + gate];
  }
  std::string text;
  for (const auto& [label, n] : others) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", label, n);
  return text;
}

ClassificationCounts count_classification(const std::vector<Record>& records) {
  ClassificationCounts counts;
  for (const Record& record : records) {
    if (record.status == Status::gated && record.gate != Gate::is_static) continue;
    const auto found = find_number(record.values, "dynamic");
    const auto truth = find_number(record.values, "dynamic_gt");
    if (found && truth) counts.add(*found != 0, *truth != 0);
  }
  return counts;
}

namespace {

Table body_table(const std::vector<BodySummary>& rows, const MetricPreset& preset) {
  using Row = BodySummary;
  Fields<Row> fields = {{Column::text("dataset").folded(), &Row::dataset},
                        {Column::text("sequence").folded(), &Row::sequence},
                        {Column::text("estimator").folded(), &Row::estimator},
                        {Column::text("body"), &Row::body},
                        {Column::count("n_pairs", "pairs"), &Row::n_pairs},
                        {Column::count("n_truth", "truth"), &Row::n_truth},
                        {Column::count("n_estimated", "estimated"), &Row::n_estimated},
                        {Column::number("coverage_percent", "coverage [%]", 1),
                         [](const Row& row) { return row.coverage ? Cell(*row.coverage * 100) : Cell(); }}};
  for (const MetricDefinition* metric : metrics_for(in_summary)) {
    fields.add(metric_column(*metric),
               [name = metric->name](const Row& row) { return find_number(row.metrics, name); });
  }
  fields.add(Column::text("other", "not estimated"),
             [](const Row& row) { return row.other.empty() ? Cell() : Cell(row.other); });
  return table_of(fmt::format("Summary, preset {} ({} over pairs)", preset.name, to_string(preset.aggregate)),
                  fmt::format("{}. Objects: {}, {}, {}; ego: Et_m, ER_deg. v, v_gt ({}) and EPE are means.",
                              preset.description, preset.object_Et_key, preset.object_ER_key,
                              preset.velocity_key, preset.velocity_truth_key),
                  fields, rows);
}

/// Returns the notes below a summary.
std::vector<std::string> summary_notes(const std::vector<Record>& records) {
  const ClassificationCounts c = count_classification(records);
  std::vector<std::string> notes = {
      "truth: pairs with truth in both frames (objects: not static by truth); estimated: those with status "
      "ok; coverage = estimated / truth; errors are over estimated.",
      fmt::format("Dynamic/static of {} detections within the gates: TP {}, FP {}, FN {}, TN {} (positive = "
                  "dynamic).",
                  c.total(), c.true_positive, c.false_positive, c.false_negative, c.true_negative)};
  std::ranges::move(floor_notes(records), std::back_inserter(notes));
  return notes;
}

}  // namespace

Table summary_table(const std::vector<Record>& records, const MetricPreset& preset) {
  Table table = body_table(summarize(records, preset), preset);
  table.notes = summary_notes(records);
  for (const auto& [key, of_body] : by_body(records)) {
    if (auto note = systematic_note(of_body)) table.remarks.push_back(std::move(*note));
  }
  return table;
}

std::string summary_text(const std::vector<Record>& records, const MetricPreset& preset, bool all) {
  constexpr size_t width = 100;
  if (all) return to_text(summary_table(records, preset));
  std::vector<BodySummary> rows = summarize(records, preset);
  std::vector<std::string> notes = summary_notes(records);
  const auto lacks_coverage = [](const BodySummary& row) { return !row.coverage; };
  const auto n_left_out = static_cast<size_t>(std::ranges::count_if(rows, lacks_coverage));
  if (n_left_out > 0 && n_left_out < rows.size()) {
    std::erase_if(rows, lacks_coverage);
    notes.push_back(fmt::format("{} further bodies are static or have no truth.", n_left_out));
  }
  Table shown = body_table(rows, preset);
  shown.notes = std::move(notes);
  shown.caption.clear();
  std::string text;
  std::vector<std::string> keys = {"dataset",          "sequence", "estimator", "body",  "n_estimated",
                                   "coverage_percent", "Et_m",     "ER_deg",    "Ev_kmh"};
  if (std::ranges::any_of(rows, [](const BodySummary& row) { return !row.other.empty(); }))
    keys.emplace_back("other");
  const std::vector<std::string> split_by = {"dataset", "sequence", "estimator"};
  const size_t n = n_parts(shown, split_by);
  auto add = [&, i = size_t{0}](const Table& rows_of_part) mutable {
    Table part = with_columns(rows_of_part, keys);
    if (i > 0) part.title.clear();
    const bool is_last = ++i >= n;
    if (!is_last) part.notes.clear();
    if (is_last)
      part.notes.emplace_back("More: --columns all, summary.md; `sextant explain WORD` explains a term.");
    for (std::string& note : part.notes) note = wrapped(note, width);
    const std::string whole = to_text(part, width);
    const size_t rows_begin = whole.find("\n\n");  // the text above the rows may be wider
    text += wrapped(whole.substr(0, rows_begin), width) + whole.substr(rows_begin) + (is_last ? "" : "\n");
  };
  n == 0 ? add(shown) : for_each_part(shown, split_by, add);
  return text;
}

Json summary_json(const std::vector<Record>& records, const MetricPreset& preset) {
  const ClassificationCounts c = count_classification(records);
  Json json;
  json["schema"] = 1;
  json["preset"] = preset.name;
  json["aggregate"] = std::string(to_string(preset.aggregate));
  json["rows"] = rows_to_json(summary_table(records, preset));
  Json& counts = json["classification"];
  counts = {
      {"tp", c.true_positive}, {"fp", c.false_positive}, {"fn", c.false_negative}, {"tn", c.true_negative}};
  if (c.precision()) counts["precision"] = *c.precision();
  if (c.recall()) counts["recall"] = *c.recall();
  return json;
}

std::string consistency_text(const std::vector<Record>& records) {
  constexpr double far_too_large = 12;      // twice the expected value
  constexpr double large_disagreement = 4;  // two standard deviations
  struct BodyMeans {
    std::string dataset, sequence, body;
    Moments split, sides, cells, truth, expansion;
  };
  struct Mean {
    const char *value, *title;
    Moments BodyMeans::*moments;
  };
  constexpr std::array means = {Mean{"split_nees", "split-half", &BodyMeans::split},
                                Mean{"split_nees_sides", "left, right", &BodyMeans::sides},
                                Mean{"split_nees_cells", "odd, even cells", &BodyMeans::cells},
                                Mean{"nees", "truth", &BodyMeans::truth},
                                Mean{"expansion_chi2", "expansion", &BodyMeans::expansion}};
  std::vector<BodyMeans> bodies;
  for (const auto& [key, of_body] : by_body(records)) {
    const Record& first = *of_body.front();
    BodyMeans body{first.dataset.str(), first.sequence.str(), first.body.str(), {}, {}, {}, {}, {}};
    for (const Mean& mean : means) {
      for (const double value : numbers_of(of_body, NumberMap::values, mean.value))
        (body.*mean.moments).add(value);
    }
    if (body.split.n > 0 || body.truth.n > 0) bodies.push_back(std::move(body));
  }
  if (std::ranges::none_of(bodies, [](const BodyMeans& body) { return body.split.n > 0; })) return "";
  Fields<BodyMeans> fields = {{Column::text("dataset").folded(), &BodyMeans::dataset},
                              {Column::text("sequence").folded(), &BodyMeans::sequence},
                              {Column::text("body"), &BodyMeans::body},
                              {Column::count("pairs"), [](const BodyMeans& body) {
                                 return Cell(std::max(body.split.n, body.truth.n));
                               }}};
  for (const Mean& mean : means) {
    fields.add(Column::number(mean.title, 2), [moments = mean.moments](const BodyMeans& body) {
      return (body.*moments).n == 0 ? Cell() : Cell((body.*moments).mean());
    });
  }
  const char* const caption =
      "Mean NEES, 6 for right covariances: between halves of the points, and against the truth. Mean chi2 of "
      "the flow's expansion against the disparities, 1 if they agree.";
  std::string text = to_text(table_of("Consistency", wrapped(caption, 100), fields, bodies));
  const bool too_sure = std::ranges::any_of(
      bodies, [&](const BodyMeans& body) { return body.split.x > far_too_large * body.split.n; });
  const bool disagree = std::ranges::any_of(bodies, [&](const BodyMeans& body) {
    return body.expansion.x > large_disagreement * body.expansion.n;
  });
  if (too_sure) {
    text +=
        "Far above 6: covariances are too small. For errors that correlate over the image give\n"
        "--set estimator.covariance=correlated, unless the estimator models that itself.\n";
  }
  if (disagree) {
    text +=
        "Far above 1: flow and disparities disagree about the motion of an object along the viewing\n"
        "ray, and residuals do not show it. Compare the estimates of another flow\n"
        "(--set source.flow=dis); values.expansion_gap_m has the sign and size by frame.\n";
  }
  return text;
}

std::string StepErrors::text() const {
  const auto fixed = [](double value, int decimals) { return shown(value, Column::number("", decimals)); };
  return fmt::format(
      "mean {:.4f} m (right {}, down {}, ahead {}), scatter {:.4f}, {:.4f}, {:.4f} m; the error to the "
      "right changes by {} mm from frame to frame",
      mean_m.norm(), fixed(mean_m.x(), 4), fixed(mean_m.y(), 4), fixed(mean_m.z(), 4), scatter_m.x(),
      scatter_m.y(), scatter_m.z(), fixed(1000 * drift_m, 2));
}

std::optional<StepErrors> step_errors(const std::vector<int>& frames,
                                      const std::vector<Eigen::Vector3d>& errors_m) {
  SEXTANT_CHECK(frames.size() == errors_m.size());
  if (errors_m.size() < 2) return std::nullopt;
  StepErrors out;
  out.n = static_cast<int>(errors_m.size());
  double mean_frame = 0;
  for (size_t i = 0; i < errors_m.size(); ++i) {
    out.mean_m += errors_m[i] / out.n;
    mean_frame += static_cast<double>(frames[i]) / out.n;
  }
  double squares = 0, products = 0;
  for (size_t i = 0; i < errors_m.size(); ++i) {
    const Eigen::Vector3d e = errors_m[i] - out.mean_m;
    const double along = frames[i] - mean_frame;
    out.scatter_m += e.cwiseAbs2() / (out.n - 1);
    squares += along * along;
    products += along * e.x();
  }
  out.scatter_m = out.scatter_m.cwiseSqrt();
  if (squares > 0) out.drift_m = products / squares;
  return out;
}

}  // namespace sextant
