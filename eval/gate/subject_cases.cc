#include "sextant/eval/gate/subject_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

/// Returns the values that depend on the truth only.
const std::vector<Interned>& truth_names() {
  static const std::vector<Interned> names = [] {
    std::vector<Interned> all;
    for (const MetricDefinition* metric : metrics_for(truth_only)) all.emplace_back(metric->name);
    return all;
  }();
  return names;
}

/// Stages whose time belongs to the estimator; the other stages belong to the source.
const std::vector<Interned>& stage_names() {
  static const std::vector<Interned> names = {"refine", "start", "total"};
  return names;
}

/// Values of the estimator that are compared besides its errors.
const std::vector<Interned>& value_names() {
  static const std::vector<Interned> names = {"dynamic", "nees"};
  return names;
}

/// Sets the number of the last row; rows before it that lack the number have NaN.
void put(Interned name, double number, size_t row, NumberColumns& columns) {
  std::vector<double>& column = columns[name];
  column.resize(row, missing);
  column.push_back(internal::summarised(number));
}

void put(const std::vector<Interned>& names, const NamedNumbers& numbers, size_t row,
         NumberColumns& columns) {
  for (const Interned name : names) {
    if (const auto number = find_number(numbers, name)) put(name, *number, row, columns);
  }
}

/// Completes the columns and sorts the rows.
void finish(SubjectCases& cases) {
  const auto columns = {&cases.errors, &cases.truth, &cases.values, &cases.times};
  for (NumberColumns* numbers : columns) {
    for (auto& [name, column] : *numbers) column.resize(cases.size(), missing);
  }
  const auto order = cases.sorting_order();
  if (!order) return;
  reorder(*order, cases.seeds);
  reorder(*order, cases.frames);
  reorder(*order, cases.lines);
  reorder(*order, cases.statuses);
  reorder(*order, cases.gates);
  reorder(*order, cases.have_truth);
  for (NumberColumns* numbers : columns) {
    for (auto& [name, column] : *numbers) reorder(*order, column);
  }
}

std::string name_of(const Subject& s, const std::string& noise) {
  const std::string level = s.noise == "none" ? "" : fmt::format(" level {}", s.level);
  return fmt::format("{} {} {}{}{} {}", s.dataset, s.sequence, s.estimator, level, noise, s.body);
}

}  // namespace

std::string to_string(const Subject& s) { return name_of(s, ""); }

void SubjectNames::add(const Subject& subject) { noises_[to_string(subject)].insert(subject.noise.str()); }

std::string SubjectNames::operator()(const Subject& subject) const {
  const auto noises = noises_.find(to_string(subject));
  const bool is_clear = noises == noises_.end() || noises->second.size() < 2;
  return name_of(subject, is_clear ? "" : fmt::format(" ({})", subject.noise));
}

bool SubjectOrder::operator()(const Subject& a, const Subject& b) const {
  const auto key = [](const Subject& s) {
    return std::tuple(s.dataset, s.sequence, s.estimator, s.level, s.noise, s.body.str().size(), s.body);
  };
  return key(a) < key(b);
}

std::optional<double> number_at(const std::vector<double>* column, size_t row) {
  return column == nullptr || std::isnan((*column)[row]) ? std::nullopt : std::optional((*column)[row]);
}

std::optional<std::pair<double, double>> numbers_at(const OnBothSides<std::vector<double>>& column,
                                                    const RowPair& row) {
  const std::optional<double> before = number_at(column.base, row.base),
                              after = number_at(column.fresh, row.fresh);
  return before && after ? std::optional(std::pair(*before, *after)) : std::nullopt;
}

std::string case_name(const SubjectCases& cases, size_t row) {
  return fmt::format("seed {} frame {}", cases.seeds[row], cases.frames[row]);
}

PairedRows pair_rows(const OnBothSides<SubjectCases>& pair) {
  const CaseColumns none;
  const CaseColumns& base = pair.base == nullptr ? none : *pair.base;
  const CaseColumns& fresh = pair.fresh == nullptr ? none : *pair.fresh;
  PairedRows rows;
  for_each_case(base, fresh, [&](std::optional<size_t> b, std::optional<size_t> f) {
    if (b && f) rows.both.push_back({static_cast<uint32_t>(*b), static_cast<uint32_t>(*f)});
    if (!f) rows.only_base.push_back(*b);
    if (!b) rows.only_fresh.push_back(*f);
  });
  return rows;
}

void SubjectCollector::add(const Record& record, size_t line) {
  SubjectCases& cases = subjects_[Subject::of(record)];
  const size_t row = cases.size();
  cases.CaseColumns::add(record.seed, record.frame);
  cases.lines.push_back(static_cast<uint32_t>(line));
  cases.statuses.push_back(record.status);
  cases.gates.push_back(record.gate);
  cases.have_truth.push_back(has_truth(record));
  if (lacks_errors(record)) ++cases.n_without_errors;
  for (const auto& [name, number] : record.errors) put(name, number, row, cases.errors);
  put(truth_names(), record.values, row, cases.truth);
  put(value_names(), record.values, row, cases.values);
  put(stage_names(), record.time_ms, row, cases.times);
  has_times_ = has_times_ || !record.time_ms.empty();
}

Subjects SubjectCollector::take() {
  Subjects subjects;
  for (auto& [subject, cases] : subjects_) {
    finish(cases);
    subjects.emplace(subject, std::move(cases));
  }
  subjects_.clear();
  return subjects;
}

}  // namespace sextant
