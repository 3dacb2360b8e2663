#include "sextant/eval/report/noise_sweep.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

/// Collects the numbers in a tree by dotted key.
void collect_numbers(const Json& tree, const std::string& prefix, std::map<std::string, double>& numbers) {
  for (const auto& [key, value] : tree.items()) {
    const std::string name = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object()) collect_numbers(value, name, numbers);
    if (value.is_number()) numbers[name] = value.get<double>();
  }
}

/// Returns the swept parameter of each level in a run.json's configuration: the dotted key of the noise whose
/// value equals the level at every level of its grid; "" if there is none, or only one level in the grid. A
/// grid ends where no key equals all of its levels and the next one.
std::vector<std::string> swept_parameters(const Json& configuration) {
  const Json levels = configuration.value("noise", Json());
  std::vector<std::string> parameters;
  std::set<std::string> candidates;  // parameters that equal the level in the whole grid so far
  size_t first = 0;                  // of the grid
  const auto end_grid = [&](size_t end) {
    const bool is_grid = end - first > 1 && !candidates.empty();
    parameters.resize(end, is_grid ? *candidates.begin() : "");
    first = end;
  };
  for (size_t i = 0; levels.is_array() && i < levels.size(); ++i) {
    const Json& level = levels[i];
    if (!level.is_object() || !level.contains("noise") || !level["noise"].is_object()) return {};
    std::map<std::string, double> numbers;
    collect_numbers(level["noise"], "", numbers);
    std::set<std::string> equal, common;
    for (const auto& [key, value] : numbers) {
      if (value == json_member<double>(level, "level", "run.json: configuration.noise", 0)) equal.insert(key);
    }
    std::ranges::set_intersection(equal, candidates, std::inserter(common, common.end()));
    if (i > first && common.empty()) end_grid(i);
    candidates = i == first ? std::move(equal) : std::move(common);
  }
  if (levels.is_array()) end_grid(levels.size());
  return parameters;
}

/// A sweep lists its noise by source and level; a run has one entry per source.
std::vector<AchievedNoise> achieved_noise(const Json& run) {
  std::vector<AchievedNoise> achieved;
  const auto add = [&](const Json& entry, const Json& configuration) {
    if (!entry.is_object() || !entry.contains("noise") || !entry["noise"].is_object()) return;
    achieved.push_back(
        {entry.value("source", std::string()),
         entry.value("level", json_member<double>(configuration, "level", "run.json: configuration", 0)),
         entry["noise"]});
  };
  const Json configuration = run.value("configuration", Json::object());
  for (const char* list : {"noise", "sources"}) {
    if (!run.contains(list) || !run[list].is_array()) continue;
    for (const Json& entry : run[list]) add(entry, configuration);
  }
  return achieved;
}

/// Returns the folders that contain this case, in order; a folder that contains it twice is listed twice.
std::vector<std::string> folders_with(const NoiseLevelKey& key, const SeedFrame& at,
                                      const std::vector<std::filesystem::path>& folders) {
  std::vector<std::string> found;
  for (const std::filesystem::path& folder : folders) {
    if (!std::filesystem::exists(folder / "records.jsonl")) {
      for_each_summary(folder / summary_file_name, [&](const CaseSummary& c) {
        const bool has_key = c.dataset == key.dataset.str() && c.sequence == key.sequence.str() &&
                             c.level == key.level && c.noise == key.noise.str();
        const auto is_estimator = [&](const ResultSums& result) {
          return result.estimator == key.estimator.str();
        };
        if (c.seed == at.first && has_key && std::ranges::any_of(c.results, is_estimator))
          found.push_back(folder.string());
      });
      continue;
    }
    for_each_record(folder / "records.jsonl", [&](const Record& r) {
      if (SeedFrame(r.seed, r.frame) == at && NoiseLevelKey::of(r) == key) found.push_back(folder.string());
    });
  }
  return found;
}

/// Throws Error if a case occurs twice, in one folder or in two, whichever parameters these vary.
void check_once(const std::vector<NoiseSweep>& sweeps, const std::vector<std::filesystem::path>& folders) {
  std::map<NoiseLevelKey, std::vector<const NoiseLevel*>> by_key;
  for (const NoiseSweep& sweep : sweeps) {
    for (const NoiseLevelRef& level : sweep.levels) by_key[level->key()].push_back(level.get());
  }
  for (const auto& [key, levels] : by_key) {
    std::vector<SeedFrame> cases;
    for (size_t i = 0; i < levels.size() && cases.empty(); ++i) {
      cases = levels[i]->repeated();
      for (size_t j = 0; j < i && cases.empty(); ++j) cases = levels[j]->shared(*levels[i]);
    }
    if (cases.empty()) continue;
    const std::vector<std::string> found = folders_with(key, cases.front(), folders);
    fail("{}: {} of {} {}, {}, frame {}, is also in {}: give each case once", found.at(1), key.body,
         key.dataset, key.sequence, key.estimator, cases.front().second, found.front());
  }
}

}  // namespace

size_t NoiseSweep::n_levels() const {
  std::set<double> distinct;
  for (const NoiseLevelRef& level : levels) distinct.insert(level->key().level);
  return distinct.size();
}

CurveKey CurveKey::of(const std::string& parameter, const NoiseLevelKey& level) {
  return {parameter, level.dataset, level.sequence, level.body, level.estimator};
}

bool CurveKey::covers(const std::string& swept, const NoiseLevelKey& key) const {
  return swept == parameter && key.dataset == dataset && key.sequence == sequence && key.body == body &&
         key.estimator == estimator;
}

Fields<CurveKey> CurveKey::fields() {
  return {{Column::text("parameter").folded(), &CurveKey::parameter},
          {Column::text("dataset").folded(), &CurveKey::dataset},
          {Column::text("sequence").folded(), &CurveKey::sequence},
          {Column::text("body"), &CurveKey::body},
          {Column::text("estimator").folded(), &CurveKey::estimator}};
}

void add_levels(const NoiseSweep& more, NoiseSweep& sweep) {
  sweep.levels.insert(sweep.levels.end(), more.levels.begin(), more.levels.end());
  for (const Interned name : more.estimators) add_distinct(name, sweep.estimators);
  std::ranges::stable_sort(sweep.levels, [](const auto& a, const auto& b) { return a->key() < b->key(); });
}

std::vector<NoiseSweep> read_noise_sweeps(const std::vector<std::filesystem::path>& folders,
                                          std::vector<std::string>* warnings) {
  struct Content {
    NoiseLevels levels;
    std::vector<AchievedNoise> achieved;
  };
  std::map<std::string, Content> by_parameter;
  SameDefinitions definitions;
  for (const std::filesystem::path& folder : folders) {
    const bool has_records = std::filesystem::exists(folder / "records.jsonl");
    if (!has_results(folder)) {
      fail("{}: has no records.jsonl or {}: expected the folder of a finished run or sweep", folder.string(),
           summary_file_name);
    }
    const Json run = std::filesystem::exists(folder / "run.json") ? read_run_json(folder) : Json::object();
    definitions.check(run, folder);
    const std::vector<std::string> parameters = swept_parameters(run.value("configuration", Json::object()));
    const auto content_of_level = [&](size_t level) {
      return &by_parameter[level < parameters.size() ? parameters[level] : ""];
    };
    // The cases of a plan are in the order of its levels, so the n-th kind of noise to appear is that of the
    // n-th level.
    std::map<Interned, Content*> content_of_noise;
    const auto add = [&](const auto& of) {
      const auto [content, is_new] = content_of_noise.try_emplace(of.noise, nullptr);
      if (is_new) content->second = content_of_level(content_of_noise.size() - 1);
      content->second->levels.add(of);
    };
    if (has_records) {
      uint64_t n_records = 0;
      for_each_record(folder / "records.jsonl", [&](const Record& record) {
        ++n_records;
        add(record);
      });
      const std::string missing = missing_records(run, n_records, folder);
      if (!missing.empty() && warnings != nullptr) warnings->push_back(missing);
    } else {
      for_each_summary(folder / summary_file_name, [&](const CaseSummary& summary) { add(summary); });
    }
    std::map<std::string, size_t> n_of_source;  // a source has one entry for each level, in their order
    for (AchievedNoise& achieved : achieved_noise(run)) {
      achieved.file = folder / "run.json";
      Content* const content = content_of_level(n_of_source[achieved.source]++);
      content->achieved.push_back(std::move(achieved));
    }
  }
  std::vector<NoiseSweep> sweeps;
  for (auto& [parameter, content] : by_parameter)
    sweeps.push_back(
        {parameter, content.levels.take(), content.levels.estimators(), std::move(content.achieved)});
  check_once(sweeps, folders);
  return sweeps;
}

std::string parameter_title(const std::string& parameter) {
  if (parameter == "depth.delta_d_px") return "depth noise: disparity accuracy \u0394d [px]";
  if (parameter == "flow.scale") return "flow noise [\u00d7 each body's EPE level]";
  if (parameter == "flow.epe_px") return "flow noise: end-point error [px]";
  return parameter.empty() ? "noise level" : parameter;
}

namespace {

/// Returns the number at a JSON pointer such as "/depth/n", if there is one.
std::optional<double> number_at(const Json& json, const char* path) {
  const Json::json_pointer pointer(path);
  if (!json.contains(pointer) || !json.at(pointer).is_number()) return std::nullopt;
  return json.at(pointer).get<double>();
}

void add_depth(const AchievedNoise& entry, AchievedNoiseRow row, std::vector<AchievedNoiseRow>& rows) {
  const auto requested = number_at(entry.noise, "/requested/depth/delta_d_px");
  const auto achieved = number_at(entry.noise, "/depth/normalised_sigma");
  if (!requested || !achieved) return;
  row.channel = "depth";
  row.requested_px = *requested;
  row.achieved_px = *achieved * *requested;
  row.n = number_at(entry.noise, "/depth/n").value_or(0);
  row.neighbours = number_at(entry.noise, "/neighbours/depth/correlation");
  row.share_invalidated = number_at(entry.noise, "/depth/share_invalidated");
  rows.push_back(row);
}

void add_flow(const AchievedNoise& entry, const std::string& body, const Json& flow, AchievedNoiseRow row,
              std::vector<AchievedNoiseRow>& rows) {
  row.body = body;
  row.n = number_at(flow, "/n").value_or(0);
  row.outlier_share = number_at(flow, "/outlier_share");
  const auto add = [&](const char* channel, std::optional<double> requested, std::optional<double> achieved) {
    if (!requested || !achieved) return;
    row.channel = channel;
    row.requested_px = *requested;
    row.achieved_px = *achieved;
    rows.push_back(row);
  };
  add("flow EPE", number_at(flow, "/requested_epe_px"), number_at(flow, "/epe_px"));
  add("flow y", number_at(flow, "/y/requested_sigma_px"), number_at(flow, "/y/sigma_px"));
  row.neighbours = number_at(entry.noise, "/neighbours/flow_x/correlation");
  add("flow x", number_at(flow, "/x/requested_sigma_px"), number_at(flow, "/x/sigma_px"));
}

}  // namespace

std::vector<AchievedNoiseRow> achieved_noise_rows(const NoiseSweep& sweep) {
  std::vector<AchievedNoiseRow> rows;
  for (const AchievedNoise& entry : sweep.achieved) {
    AchievedNoiseRow row{.parameter = sweep.parameter,
                         .source = entry.source,
                         .body = "all",
                         .file = entry.file,
                         .level = entry.level};
    add_depth(entry, row, rows);
    if (!entry.noise.contains("flow") || !entry.noise["flow"].is_object()) continue;
    for (const auto& [body, flow] : entry.noise["flow"].items()) add_flow(entry, body, flow, row, rows);
  }
  return rows;
}

Table achieved_noise_table(const std::vector<AchievedNoiseRow>& rows) {
  using Row = AchievedNoiseRow;
  const Fields<Row> fields = {
      {Column::text("parameter").folded(), &Row::parameter},
      {Column::text("source").folded(), &Row::source},
      {Column::number("level", 3), &Row::level},
      {Column::text("body").folded(), &Row::body},
      {Column::text("channel"), &Row::channel},
      {Column::number("requested_px", "requested [px]", 4), &Row::requested_px},
      {Column::number("achieved_px", "achieved [px]", 4), &Row::achieved_px},
      {Column::number("ratio", 4),
       [](const Row& row) {
         return row.requested_px > 0 ? Cell(row.achieved_px / row.requested_px) : Cell();
       }},
      {Column::count("n", "draws"), &Row::n},
      {Column::number("neighbours", 4), &Row::neighbours},
      {Column::number("share_invalidated", "invalidated", 6), &Row::share_invalidated},
      {Column::number("outlier_share", "outliers", 4), &Row::outlier_share}};
  return table_of(
      "Noise: requested and achieved",
      "Depth: disparity accuracy. Flow x, y: standard deviation; EPE: mean length of the error vector. "
      "neighbours: correlation between neighbouring pixels.",
      fields, rows);
}

}  // namespace sextant
