// Table I: dynamic or static, per sequence.

#include <algorithm>
#include <array>
#include <map>

#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {
namespace {

/// Counts of one run.
struct Quantity {
  const char* published_key;
  const char* title;
  int (*of)(const ClassificationCounts&);
};
constexpr std::array<Quantity, 6> quantities = {{
    {"total_detections", "detections", [](const ClassificationCounts& c) { return c.total(); }},
    {"dynamic", "dynamic by truth",
     [](const ClassificationCounts& c) { return c.true_positive + c.false_negative; }},
    {"static", "static by truth",
     [](const ClassificationCounts& c) { return c.false_positive + c.true_negative; }},
    {nullptr, "true positive", [](const ClassificationCounts& c) { return c.true_positive; }},
    {"false_positive", "false positive", [](const ClassificationCounts& c) { return c.false_positive; }},
    {"false_negative", "false negative", [](const ClassificationCounts& c) { return c.false_negative; }},
}};

/// The paper's "01" for 0001/clone and Scene01/clone; empty for other sequences.
std::string paper_sequence(const Record& record) {
  if (record.dataset.str().ends_with("vkitti1")) return record.sequence.str().substr(2, 2);
  if (record.dataset == "vkitti2") return record.sequence.str().substr(5, 2);
  return "";
}

struct SequenceRuns {
  std::string sequence;  ///< the paper's, or empty
  std::string data;
  std::string noise;
  std::string estimator;
  std::string part;
  std::map<uint64_t, std::vector<Record>> by_seed;
};

/// By data, noise and estimator, in order of appearance.
std::vector<SequenceRuns> runs_of(const Evidence& evidence) {
  std::vector<SequenceRuns> runs;
  for (const EvidencePart* part : evidence.with(PartRole::classification)) {
    for (const Record& record : part->records) {
      const std::string data = data_title(record.dataset, record.sequence);
      // The plans' levels are delta_d.
      const std::string noise = record.level > 0 ? fmt::format("flow, delta_d {} px", record.level) : "flow";
      auto it = std::find_if(runs.begin(), runs.end(), [&](const SequenceRuns& r) {
        return r.data == data && r.noise == noise && r.estimator == record.estimator;
      });
      if (it == runs.end()) {
        runs.push_back({paper_sequence(record), data, noise, record.estimator, part->name, {}});
        it = runs.end() - 1;
      }
      it->by_seed[record.seed].push_back(record);
    }
  }
  std::ranges::stable_sort(runs, {}, &SequenceRuns::data);
  return runs;
}

/// The paper's number, the true positives from those it prints.
std::optional<double> published_count(const Json& table, size_t at, const Quantity& quantity) {
  const auto number = [&](const char* key) { return table.at(key).at(at).get<double>(); };
  if (quantity.published_key != nullptr) return number(quantity.published_key);
  return number("dynamic") - number("false_negative");
}

void add_rows(const std::string& sequence, const Json& published, std::optional<size_t> at,
              const SequenceRuns* runs, Table& table) {
  std::vector<ClassificationCounts> counts;
  if (runs != nullptr) {
    for (const auto& [seed, records] : runs->by_seed) counts.push_back(count_classification(records));
  }
  for (const Quantity& quantity : quantities) {
    PaperRow row{{sequence, runs != nullptr ? runs->noise : "", runs != nullptr ? runs->estimator : ""},
                 quantity.title};
    if (at) row.published = published_count(published, *at, quantity);
    if (runs != nullptr) {
      std::vector<double> by_seed;
      for (const ClassificationCounts& c : counts) by_seed.push_back(quantity.of(c));
      const auto& first = runs->by_seed.begin()->second;
      const auto pairs =
          std::count_if(first.begin(), first.end(), [](const Record& r) { return r.is_ego(); });
      row.measured = measure_by_seed(by_seed, static_cast<int>(pairs) * static_cast<int>(by_seed.size()));
      row.data = runs->data;
      row.records = runs->part;
    }
    add_published_row(row, table);
  }
}

}  // namespace

Table classification_table(const Evidence& evidence) {
  Table table = published_table(
      "Table I: dynamic or static",
      "Counts per run over detections that pass the gates on distance and area; positive = dynamic. Truth: "
      "the data set's flag of moving objects (a step of 1 cm or more). The paper counts detections of Mask "
      "R-CNN, so its totals differ; its true positives are its dynamic less its false negatives. Noise: flow "
      "of Table II on exact depth, and with depth noise too. Estimators decide by threshold, the paper's test, where "
      "their name does not say likelihood.",
      {{"sequence", "sequence", Align::left, 0, true},
       {"noise", "noise", Align::left, 0, true},
       {"estimator", "estimator", Align::left, 0, true}},
      1);
  const Json& published = evidence.published.at("tab:dyn_obj");
  const auto runs = runs_of(evidence);
  const Json& sequences = published.at("sequences");
  std::vector<size_t> unmeasured;
  for (size_t i = 0; i < sequences.size(); ++i) {
    bool measured = false;
    for (const SequenceRuns& run : runs) {
      if (sequences[i] != run.sequence) continue;
      measured = true;
      add_rows(run.sequence, published, i, &run, table);
    }
    if (!measured) unmeasured.push_back(i);
  }
  for (const SequenceRuns& run : runs) {
    if (run.sequence.empty()) add_rows("", published, std::nullopt, &run, table);
  }
  for (const size_t i : unmeasured) add_rows(sequences[i], published, i, nullptr, table);
  return table;
}

}  // namespace sextant
