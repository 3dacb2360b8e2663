
#include <algorithm>
#include <map>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {
namespace {

constexpr const char* separator = " > ";

struct Step {
  std::string decision, part;
  RecordRefs records;
};

/// Steps by path, in the order of experiments and plans.
std::map<std::string, std::vector<Step>> steps_by_path(const Evidence& evidence, const RecordFilter& filter) {
  std::map<std::string, std::vector<Step>> paths;
  for (const EvidencePart* part : evidence.with(PartRole::attribution)) {
    for (const Record& record : part->records) {
      const size_t at = record.estimator.str().find(separator);
      if (at == std::string::npos || !filter.matches(record)) continue;
      std::vector<Step>& steps = paths[record.estimator.str().substr(0, at)];
      const std::string decision = record.estimator.str().substr(at + std::string(separator).size());
      auto step = std::ranges::find(steps, decision, &Step::decision);
      if (step == steps.end()) step = steps.insert(steps.end(), {decision, part->name, {}});
      step->records.push_back(&record);
    }
  }
  return paths;
}

using ErrorOfCase = std::map<SeedFrame, double>;

/// Number of pairs, and sum of errors at each step, for one seed.
struct SeedSums {
  double n = 0;
  std::vector<double> Et_m;
};

std::vector<SeedSums> sums_by_seed(const std::vector<ErrorOfCase>& steps,
                                   const std::vector<SeedFrame>& cases) {
  std::map<uint64_t, SeedSums> by_seed;
  for (const SeedFrame& at : cases) {
    SeedSums& sums = by_seed[at.first];
    sums.Et_m.resize(steps.size());
    for (size_t k = 0; k < steps.size(); ++k) sums.Et_m[k] += steps[k].at(at);
    ++sums.n;
  }
  std::vector<SeedSums> out;
  for (const auto& [seed, sums] : by_seed) out.push_back(sums);
  return out;
}

/// Mean over all pairs at step `to`, minus that at step `from` if it is given.
IntervalEstimate mean_change(const std::vector<SeedSums>& seeds, size_t to, std::optional<size_t> from = {}) {
  return cluster_estimate(seeds.size(), [&](std::span<const size_t> chosen) {
    double sum = 0, n = 0;
    for (const size_t s : chosen) {
      sum += seeds[s].Et_m[to] - (from ? seeds[s].Et_m[*from] : 0);
      n += seeds[s].n;
    }
    return sum / n;
  });
}

std::optional<AttributionPath> path_of(const std::vector<Step>& steps, const SetData& data,
                                       const std::string& body) {
  AttributionPath path{data.set, data_title(data.filter), body};
  std::vector<ErrorOfCase> errors;
  for (const Step& step : steps) {
    const auto bodies = paper_bodies(step.records);
    if (const RecordRefs* records = find_in(bodies, body)) errors.push_back(errors_by_case(*records, "Et_m"));
  }
  if (errors.size() != steps.size() || steps.size() < 2) return std::nullopt;
  std::vector<const ErrorOfCase*> maps;
  for (const ErrorOfCase& of_step : errors) maps.push_back(&of_step);
  const std::vector<SeedFrame> cases = common_keys(maps);
  const std::vector<SeedSums> seeds = sums_by_seed(errors, cases);
  if (seeds.empty()) return std::nullopt;
  path.n_pairs = cases.size();
  path.n_seeds = seeds.size();
  for (size_t k = 0; k < steps.size(); ++k) {
    AttributionStep step{steps[k].decision, steps[k].part, mean_change(seeds, k), {}};
    if (k > 0) step.change_m = mean_change(seeds, k, k - 1);
    path.steps.push_back(std::move(step));
  }
  path.whole_m = mean_change(seeds, steps.size() - 1, 0);
  return path;
}

}  // namespace

std::vector<AttributionPath> attribution_paths(const Evidence& evidence) {
  std::vector<AttributionPath> out;
  if (evidence.with(PartRole::attribution).empty()) return out;
  const Json& rows = evidence.published.at("tab:mot_all").at("rows");
  for (const SetData& data : paper().sets) {
    const auto paths = steps_by_path(evidence, data.filter);
    for (const Json& row : rows) {
      if (row.at("set") != data.set) continue;
      for (const auto& [name, steps] : paths) {
        std::optional<AttributionPath> path = path_of(steps, data, paper_body(row.at("body")));
        if (!path) continue;
        path->path = name;
        if (const auto column = paper().column_of(name))
          path->published_m = published_number(row.at(*column), "Et_m");
        out.push_back(std::move(*path));
      }
    }
  }
  return out;
}

Table attribution_table(const Evidence& evidence) {
  struct Row {
    const AttributionPath* path;
    const AttributionStep* step;    ///< null: the total change
    const AttributionStep* before;  ///< reference of the factor; null for the first step
  };
  const std::vector<AttributionPath> paths = attribution_paths(evidence);
  std::vector<Row> rows;
  for (const AttributionPath& path : paths) {
    for (size_t k = 0; k < path.steps.size(); ++k)
      rows.push_back({&path, &path.steps[k], k == 0 ? nullptr : &path.steps[k - 1]});
    rows.push_back({&path, nullptr, &path.steps.front()});
  }
  const auto last = [](const Row& row) { return row.step ? row.step : &row.path->steps.back(); };
  Fields<AttributionPath> of_path = {{Column::text("set").folded(), &AttributionPath::set},
                                     {Column::text("data"), &AttributionPath::data},
                                     {Column::text("body"), &AttributionPath::body},
                                     {Column::text("path", "from"), &AttributionPath::path}};
  Fields<Row> fields;
  fields.add(of_path, &Row::path);
  fields.add(Column::text("decision").leading_to("decision_file"),
             [](const Row& row) { return row.step ? row.step->decision : "all of them"; });
  fields.add(estimate_fields(Column::number("Et_m", "E_t [m]", 4), "Et_low", "Et_high"),
             [](const Row& row) { return row.step ? std::optional(row.step->Et_m) : std::nullopt; });
  fields.add(estimate_fields(Column::number("change_m", "change [m]", 4), "change_low", "change_high"),
             [](const Row& row) {
               if (!row.before) return std::optional<IntervalEstimate>();
               return std::optional(row.step ? row.step->change_m : row.path->whole_m);
             });
  fields.add(Column::number("factor", 2), [last](const Row& row) {
    return row.before ? Cell(last(row)->Et_m.value / row.before->Et_m.value) : Cell();
  });
  fields.add(Column::text("decision_file").only_in_files(),
             [last](const Row& row) { return records_of_part(last(row)->part); });
  return numbered_table("VIII", "Not measured here: no experiment `attribution`.", fields, rows);
}

}  // namespace sextant
