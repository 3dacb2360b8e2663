// Table I: dynamic or static, per sequence.

#include <algorithm>
#include <array>
#include <map>

#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {
namespace {

/// One of the counts in the table, over the detections of one run.
struct Count {
  const char* published_key;  ///< null if the paper does not print the count
  const char* title;
  int (*of)(const ClassificationCounts&);
};
constexpr std::array<Count, 6> counted = {{
    {"total_detections", "detections", [](const ClassificationCounts& c) { return c.total(); }},
    {"dynamic", "dynamic by truth",
     [](const ClassificationCounts& c) { return c.true_positive + c.false_negative; }},
    {"static", "static by truth",
     [](const ClassificationCounts& c) { return c.false_positive + c.true_negative; }},
    {nullptr, "true positive", [](const ClassificationCounts& c) { return c.true_positive; }},
    {"false_positive", "false positive", [](const ClassificationCounts& c) { return c.false_positive; }},
    {"false_negative", "false negative", [](const ClassificationCounts& c) { return c.false_negative; }},
}};

struct SequenceRuns {
  std::string sequence;  ///< the paper's sequence, or empty
  std::string data, dataset;
  std::string noise;
  std::string estimator;
  std::string part;
  std::map<uint64_t, std::vector<Record>> by_seed;
};

/// Groups by data, noise and estimator, in order of appearance.
std::vector<SequenceRuns> runs_of(const Evidence& evidence) {
  std::vector<SequenceRuns> runs;
  for (const EvidencePart* part : evidence.with(PartRole::classification)) {
    for (const Record& record : part->records) {
      const std::string data = data_title(record.dataset, record.sequence);
      // The levels of these plans are delta_d.
      const std::string noise = record.level > 0 ? fmt::format("flow, delta_d {} px", record.level) : "flow";
      auto it = std::find_if(runs.begin(), runs.end(), [&](const SequenceRuns& r) {
        return r.data == data && r.noise == noise && r.estimator == record.estimator;
      });
      if (it == runs.end()) {
        runs.push_back({paper().sequence_of(record.dataset, record.sequence),
                        data,
                        record.dataset.str(),
                        noise,
                        record.estimator,
                        part->name,
                        {}});
        it = runs.end() - 1;
      }
      it->by_seed[record.seed].push_back(record);
    }
  }
  std::ranges::stable_sort(runs, {}, &SequenceRuns::data);
  return runs;
}

void add_rows(const std::string& sequence, const Json& published, std::optional<size_t> at,
              const SequenceRuns* runs, PublishedTable& table) {
  std::vector<ClassificationCounts> counts;
  PaperRow row{.group = sequence};
  if (runs != nullptr) {
    for (const auto& [seed, records] : runs->by_seed) counts.push_back(count_classification(records));
    row.noise = runs->noise;
    row.estimator = runs->estimator;
    row.data = runs->data;
    row.dataset = runs->dataset;
    row.records = runs->part;
  }
  for (const Count& count : counted) {
    row.quantity = count.title;
    row.published.reset();
    if (at && count.published_key != nullptr)
      row.published = published.at(count.published_key).at(*at).get<double>();
    if (runs != nullptr) {
      std::vector<double> by_seed;
      for (const ClassificationCounts& c : counts) by_seed.push_back(count.of(c));
      const auto pairs = std::ranges::count_if(runs->by_seed.begin()->second, &Record::is_ego);
      row.measured = measure_by_seed(by_seed, static_cast<int>(pairs) * static_cast<int>(by_seed.size()));
    }
    table.rows.push_back(row);
  }
}

}  // namespace

PublishedTable classification_table(const Evidence& evidence) {
  PublishedTable table{.number = "I",
                       .labels = {{Column::text("sequence").folded(), &PaperRow::group},
                                  {Column::text("noise").folded(), &PaperRow::noise},
                                  {Column::text("estimator").folded(), &PaperRow::estimator}},
                       .decimals = 1};
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
