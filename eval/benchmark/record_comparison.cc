#include "sextant/eval/benchmark/record_comparison.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "sextant/base/text.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

/// Relative difference of numbers that were stored with six digits.
constexpr double six_digits = 1e-5;

/// Differences that are no differences of the estimator: `digits` is relative; errors of exact data may also
/// differ by their rounding, of 1 um at 10 m.
struct Tolerance {
  double digits = 1e-8;
  bool is_exact = false;
};

/// Compares the numbers of one map. Every stored number must agree with that of the rerun, and every number
/// in `read` that the rerun has must be stored. Returns the first difference, or an empty text.
std::string difference(const std::string& map, const Record::Numbers& stored, const Record::Numbers& again,
                       const std::vector<Interned>& read, const Tolerance& tolerance) {
  const auto text = [](const std::optional<double>& number) {
    return number ? fmt::format("{}", *number) : std::string("nothing");
  };
  std::set<Interned> names(read.begin(), read.end());
  for (const auto& [name, number] : stored) names.insert(name);
  for (const Interned& name : names) {
    const double rounding = name.str().ends_with("_m") ? 1e-6 : name.str().ends_with("_deg") ? 1e-5 : 1e-4;
    const auto a = find_number(stored, name), b = find_number(again, name);
    if (!a && !b) continue;
    if (!a || !b ||
        std::abs(*a - *b) > std::max(tolerance.digits * std::abs(*a), tolerance.is_exact ? rounding : 0))
      return fmt::format("{}.{}: stored is {}, the rerun gives {}", map, name.str(), text(a), text(b));
  }
  return "";
}

std::string where(const Record& record) {
  return fmt::format("frame {}, body {}, estimator '{}': ", record.frame, record.body.str(),
                     record.estimator.str());
}

/// Compares a stored record with that of the rerun. Errors of exact data are rounding, and so is all that is
/// normalised by them.
std::string difference(const Record& stored, const Record& again, const std::string& metric) {
  if (stored.status != again.status)
    return fmt::format("status: stored is {}, the rerun gives {}", to_string(stored.status),
                       to_string(again.status));
  if (stored.n_points != again.n_points)
    return fmt::format("n_points: stored is {}, the rerun gives {}", stored.n_points, again.n_points);
  const Tolerance tolerance{.is_exact = stored.noise == "none"};
  std::string text =
      difference("errors", stored.errors, again.errors, {"Et_m", "ER_deg", "Ev_kmh", metric}, tolerance);
  if (text.empty())
    text = difference("bound", stored.bound, again.bound, {"Et_m", "ER_deg", metric}, tolerance);
  if (!text.empty() || tolerance.is_exact) return text;
  if (stored.n_inliers != again.n_inliers)
    return fmt::format("n_inliers: stored is {}, the rerun gives {}", stored.n_inliers, again.n_inliers);
  return difference("values", stored.values, again.values, {"nees"}, tolerance);
}

}  // namespace

std::string difference(const std::vector<Record>& stored, const std::vector<Record>& again,
                       const SuiteTrack& track, const std::string& metric) {
  using Key = std::tuple<int, Interned, Interned>;  // frame, body, estimator
  std::map<Key, const Record*> records;
  for (const Record& record : stored) records[{record.frame, record.body, record.estimator}] = &record;
  for (const Record& record : again) {
    const auto same = records.find({record.frame, record.body, record.estimator});
    if (same == records.end()) {
      if (track.counts(record)) return where(record) + "there is no stored record";
      continue;
    }
    const std::string text = difference(*same->second, record, metric);
    if (!text.empty()) return where(record) + text;
    records.erase(same);
  }
  return records.empty() ? "" : where(*records.begin()->second) + "the rerun gives no record";
}

std::string difference_of_bounds(const std::vector<Record>& stored, const std::vector<Record>& again,
                                 const SuiteTrack& track, const std::string& metric) {
  std::map<std::pair<int, Interned>, const Record*> records;  // by frame and body
  for (const Record& record : again) records[{record.frame, record.body}] = &record;
  for (const Record& record : stored) {
    const auto ours = records.find({record.frame, record.body});
    const Record::Numbers expected = ours == records.end() ? Record::Numbers() : ours->second->bound;
    std::vector<Interned> read;
    if (track.counts(record) && record.status == Status::ok) read = {"Et_m", "ER_deg", metric};
    const std::string text = difference("bound", record.bound, expected, read, {.digits = six_digits});
    if (!text.empty()) return where(record) + text;
  }
  return "";
}

std::string difference_of_truth(const Record& stored, const Record::Numbers& truth) {
  for (const MetricDefinition* definition : metrics_for(truth_only)) {
    const auto a = find_number(stored.values, definition->name), b = find_number(truth, definition->name);
    if (a && (!b || std::abs(*a - *b) > six_digits * std::abs(*b)))
      return fmt::format("values.{} is {}, but the data have {}", definition->name, *a,
                         b ? fmt::format("{}", *b) : "no such value");
  }
  return "";
}

}  // namespace sextant
