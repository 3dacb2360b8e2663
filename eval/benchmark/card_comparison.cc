// Paired comparison of two cards.

#include <algorithm>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/names.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

namespace {

/// Key of a row of the comparison.
using RowKey = std::tuple<std::string, size_t, BodyKind, double>;  // result, track, kind, level
/// Stratum, with a frame pair and seed in it.
using PairKey = std::tuple<std::string, std::string, uint64_t, int>;  // sequence, body, seed, frame
using Errors = std::map<RowKey, std::map<PairKey, double>>;

/// Reads the errors of all results from the sweeps of a card.
Errors read_errors(const Suite& suite, const Card& card, const fs::path& folder) {
  Errors errors;
  const Interned metric = suite.metric;
  for (size_t track = 0; track < suite.tracks.size(); ++track) {
    for (const SuiteSweep& sweep : suite.tracks[track].sweeps) {
      if (std::ranges::count(card.sweeps, sweep.name, &CardSweep::name) == 0) continue;
      const fs::path of_sweep = folder / sweep.name;
      records_by_case(of_sweep);  // throws Error if records are missing
      for_each_record(of_sweep / "records.jsonl", [&](const Record& record) {
        const auto error = find_number(record.errors, metric);
        if (record.status != Status::ok || !error || !suite.tracks[track].counts(record)) return;
        errors[{record.estimator, track, kind_of(record), record.level}].emplace(
            PairKey{record.sequence, record.body, record.seed, record.frame}, *error);
      });
    }
  }
  if (errors.empty()) fail("{}: holds no records of suite {}", folder.string(), suite.name);
  return errors;
}

/// Frame pairs that both estimated, by stratum.
std::vector<PairedSample> paired(const std::map<PairKey, double>& base,
                                 const std::map<PairKey, double>& fresh) {
  std::map<std::pair<std::string, std::string>, PairedSample> strata;
  for (const auto& [key, error] : fresh) {
    const double* reference = find_in(base, key);
    if (reference == nullptr) continue;
    const auto& [sequence, body, seed, frame] = key;
    const auto [sample, is_new] = strata.try_emplace({sequence, body});
    if (is_new) sample->second.stratum = strata.size() - 1;
    sample->second.cases.push_back({seed, frame, *reference, error});
  }
  std::vector<PairedSample> samples;
  for (auto& [key, sample] : strata) samples.push_back(std::move(sample));
  return samples;
}

}  // namespace

std::vector<CardComparison> compare_benchmarks(const Suite& suite, const fs::path& folder,
                                               const fs::path& reference) {
  const Card card = stored_card(folder), of_reference = stored_card(reference);
  check_suite(card, suite, folder);
  check_suite(of_reference, suite, reference);
  if (card.quick != of_reference.quick)
    fail("{} is of a quick run, {} of a complete one: run the quick one again without --quick",
         (card.quick ? folder : reference).string(), (card.quick ? reference : folder).string());
  if (of_reference.results.size() != 1)
    fail("{}: has the results {}: expected a reference with one result", reference.string(),
         fmt::join(of_reference.results, ", "));
  const Errors fresh = read_errors(suite, card, folder), base = read_errors(suite, of_reference, reference);
  std::vector<CardComparison> rows;
  for (const auto& [key, errors] : fresh) {
    const auto& [estimator, track, kind, level] = key;
    const auto* of_base = find_in(base, RowKey{of_reference.results.front(), track, kind, level});
    if (of_base == nullptr) continue;
    const std::vector<PairedSample> samples = paired(*of_base, errors);
    if (samples.empty()) continue;
    std::vector<const PairedSample*> refs;
    CardComparison row{estimator, suite.tracks[track].name, std::string(to_string(kind)), level};
    for (const PairedSample& sample : samples) {
      refs.push_back(&sample);
      row.n_pairs += static_cast<int>(sample.cases.size());
    }
    const RatioChange change = ratio_of_means(refs);
    row.change_percent = 100 * change.change;
    if (change.interval) row.interval_percent = {100 * change.interval->low, 100 * change.interval->high};
    row.p = change.p;
    rows.push_back(std::move(row));
  }
  if (rows.empty()) fail("{} and {}: have no case in common", folder.string(), reference.string());
  std::vector<CardComparison*> family;
  for (CardComparison& row : rows) family.push_back(&row);
  correct_by_holm(family);
  return rows;
}

Table comparison_table(const std::vector<CardComparison>& rows, const Suite& suite) {
  using Row = CardComparison;
  Fields<Row> fields = {{Column::text("estimator").folded(), &Row::estimator},
                        {Column::text("track"), &Row::track},
                        {Column::text("body"), &Row::body},
                        {Column::number("level", 2), &Row::level},
                        {Column::count("n_pairs", "pairs"), &Row::n_pairs},
                        {Column::number("change_percent", "error, change [%]", 1), &Row::change_percent}};
  fields.add_range(range_columns("change_low_percent", "change_high_percent", 1), &Row::interval_percent);
  fields.add(Column::p_value("p"), &Row::p);
  Column corrected = Column::p_value("p_corrected");
  corrected.title = "p (Holm)";
  fields.add(corrected, &Row::p_corrected);
  return with_distinct(
      table_of(
          "Paired comparison",
          fmt::format(
              "Change of the mean {} against the reference over the frame pairs that both estimated, with "
              "95 % interval; negative is better.",
              suite.symbol()),
          fields, rows),
      {"level"});
}

}  // namespace sextant
