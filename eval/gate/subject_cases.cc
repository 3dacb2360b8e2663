#include "sextant/eval/gate/subject_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

template <typename T>
int three_way(const T& a, const T& b) {
  return a < b ? -1 : (b < a ? 1 : 0);
}

/// Merges two sorted sequences: calls visit(b, f) once for each pair of equal items, and once for each item
/// that only one side has, with null for the other side.
template <typename Item, typename Compare, typename Visit>
void merge_sorted(const std::vector<Item>& base, const std::vector<Item>& fresh, const Compare& compare,
                  const Visit& visit) {
  auto b = base.begin(), f = fresh.begin();
  while (b != base.end() || f != fresh.end()) {
    const int order = b == base.end() ? 1 : (f == fresh.end() ? -1 : compare(*b, *f));
    const Item* first = order <= 0 ? &*b++ : nullptr;
    const Item* second = order >= 0 ? &*f++ : nullptr;
    visit(first, second);
  }
}

/// Returns the values that depend on the truth only, in order of name, like the columns.
const std::vector<Interned>& truth_names() {
  static const std::vector<Interned> names = [] {
    std::vector<Interned> all;
    for (const MetricDefinition* metric : metrics_for(truth_only)) all.emplace_back(metric->name);
    std::ranges::sort(all, std::less<>());
    return all;
  }();
  return names;
}

/// Stages whose time belongs to the estimator; the other stages belong to the source.
const std::vector<Interned>& stage_names() {
  static const std::vector<Interned> names = {"refine", "start", "total"};
  return names;
}

const std::vector<Interned>& decision_names() {
  static const std::vector<Interned> names = {"dynamic"};
  return names;
}

/// Appends one row to the columns; numbers must be put in order of name.
class RowWriter {
 public:
  RowWriter(std::vector<NumberColumn>& columns, size_t row) : columns_(columns), row_(row) {}
  ~RowWriter() {
    for (NumberColumn& column : columns_) column.numbers.resize(row_ + 1, missing);
  }
  RowWriter(const RowWriter&) = delete;
  RowWriter& operator=(const RowWriter&) = delete;

  void put(Interned name, double number) {
    while (next_ < columns_.size() && columns_[next_].name < name) ++next_;
    if (next_ == columns_.size() || !(columns_[next_].name == name)) {
      const auto at = columns_.begin() + static_cast<std::ptrdiff_t>(next_);
      columns_.insert(at, {name, std::vector<double>(row_, missing)});
    }
    columns_[next_++].numbers.push_back(number);
  }

  void put(const std::vector<Interned>& names, const NamedNumbers& numbers) {
    for (const Interned name : names) {
      if (const auto number = numbers.find(name); number != numbers.end())
        put(name, internal::summarised(number->second));
    }
  }

 private:
  std::vector<NumberColumn>& columns_;
  size_t row_;
  size_t next_ = 0;
};

void sort_cases(SubjectCases& cases) {
  const auto order = cases.sorting_order();
  if (!order) return;
  reorder(*order, cases.seeds);
  reorder(*order, cases.frames);
  reorder(*order, cases.lines);
  reorder(*order, cases.statuses);
  reorder(*order, cases.gates);
  reorder(*order, cases.have_truth);
  for (auto* columns : {&cases.errors, &cases.truth, &cases.decisions, &cases.times}) {
    for (NumberColumn& column : *columns) reorder(*order, column.numbers);
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

int compare_subjects(const Subject& a, const Subject& b) {
  const auto key = [](const Subject& s) {  // orders object:2 before object:10
    return std::tuple(s.dataset, s.sequence, s.estimator, s.level, s.noise, s.body.str().size(), s.body);
  };
  return three_way(key(a), key(b));
}

bool NumberColumn::has(size_t row) const { return !std::isnan(numbers[row]); }

const NumberColumn* find_column(const std::vector<NumberColumn>& columns, Interned name) {
  const auto at = std::ranges::find(columns, name, &NumberColumn::name);
  return at == columns.end() ? nullptr : &*at;
}

std::vector<ColumnPair> pair_columns(const std::vector<NumberColumn>& base,
                                     const std::vector<NumberColumn>& fresh) {
  std::vector<ColumnPair> pairs;
  merge_sorted(
      base, fresh, [](const NumberColumn& a, const NumberColumn& b) { return three_way(a.name, b.name); },
      [&](const NumberColumn* a, const NumberColumn* b) {
        pairs.push_back({(a != nullptr ? a : b)->name, a, b});
      });
  return pairs;
}

std::vector<SubjectPair> pair_subjects(const std::vector<SubjectCases>& base,
                                       const std::vector<SubjectCases>& fresh) {
  std::vector<SubjectPair> pairs;
  merge_sorted(
      base, fresh,
      [](const SubjectCases& a, const SubjectCases& b) { return compare_subjects(a.subject, b.subject); },
      [&](const SubjectCases* a, const SubjectCases* b) {
        pairs.push_back({a, b});
      });
  return pairs;
}

std::optional<double> number_at(const NumberColumn* column, size_t row) {
  return column == nullptr || !column->has(row) ? std::nullopt : std::optional(column->numbers[row]);
}

std::string case_name(const SubjectCases& cases, size_t row) {
  return fmt::format("seed {} frame {}", cases.seeds[row], cases.frames[row]);
}

PairedRows pair_rows(const SubjectPair& pair) {
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
  const Subject subject = Subject::of(record);
  SubjectCases& cases = subjects_.try_emplace(subject, subject).first->second;
  const size_t row = cases.size();
  cases.CaseColumns::add(record.seed, record.frame);
  cases.lines.push_back(static_cast<uint32_t>(line));
  cases.statuses.push_back(record.status);
  cases.gates.push_back(record.gate);
  cases.have_truth.push_back(has_truth(record));
  RowWriter errors(cases.errors, row);
  for (const auto& [name, number] : record.errors) errors.put(name, internal::summarised(number));
  RowWriter(cases.truth, row).put(truth_names(), record.values);
  RowWriter(cases.decisions, row).put(decision_names(), record.values);
  RowWriter(cases.times, row).put(stage_names(), record.time_ms);
  has_times_ = has_times_ || !record.time_ms.empty();
}

std::vector<SubjectCases> SubjectCollector::take() {
  std::vector<SubjectCases> subjects;
  for (auto& [subject, cases] : subjects_) {
    sort_cases(cases);
    subjects.push_back(std::move(cases));
  }
  subjects_.clear();
  std::ranges::sort(subjects, [](const SubjectCases& a, const SubjectCases& b) {
    return compare_subjects(a.subject, b.subject) < 0;
  });
  return subjects;
}

}  // namespace sextant
