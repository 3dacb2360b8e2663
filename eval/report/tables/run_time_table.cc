// Table VII (ours): run time per stage.

#include <algorithm>
#include <map>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr double ms_per_s = 1000;

/// Times of one stage, in ms per frame pair.
struct StageTimes {
  std::string data, estimator, stage, part;
  std::vector<double> ms;
  std::optional<double> published_ms;
};

/// Adds the published systems, measured once and stored: the program's own time of a frame, best of its
/// rounds.
void add_systems(const Evidence& evidence, double published_ms, std::vector<StageTimes>& rows) {
  for (const EvidencePart* part : evidence.with(PartRole::systems)) {
    std::map<std::pair<std::string, std::string>, RoundTimes> frames;
    for (const Record& record : part->records) {
      const auto ms = find_number(record.time_ms, "program");
      if (!ms) continue;
      frames[{data_title(record.dataset, record.sequence), record.estimator}][{record.seed, record.frame}] =
          *ms;
    }
    for (const auto& [key, rounds] : frames)
      rows.push_back(
          {key.first, key.second, "frame, stored", part->name, best_rounds_ms(rounds), published_ms});
  }
}

}  // namespace

std::vector<double> best_rounds_ms(const RoundTimes& rounds) {
  std::map<int, double> best;
  for (const auto& [key, ms] : rounds) {
    const auto [at, added] = best.emplace(key.second, ms);
    if (!added) at->second = std::min(at->second, ms);
  }
  std::vector<double> all;
  for (const auto& [frame, ms] : best) all.push_back(ms);
  return all;
}

std::vector<RunTimes> run_times(const Evidence& evidence) {
  std::vector<RunTimes> all;
  for (const EvidencePart* part : evidence.with(PartRole::timing)) {
    std::map<std::pair<std::string, std::string>, std::map<int, std::map<std::string, double>>> frames;
    for (const Record& record : part->records) {
      const std::string data = data_title(record.dataset, record.sequence);
      std::map<std::string, double>& stages = frames[{data, record.estimator}][record.frame];
      for (const auto& [stage, ms] : record.time_ms) {
        if (stage == "decode" || stage == "extraction") {
          stages[stage] += ms;
        } else {
          stages[(record.is_ego() ? "camera, " : "objects, ") + stage.str()] += ms;
        }
      }
    }
    for (const auto& [key, by_frame] : frames) {
      RunTimes times{key.first, key.second, part->name, {}};
      for (const auto& [frame, stages] : by_frame) {
        double total = 0;
        for (const char* stage : {"extraction", "camera, total", "objects, total"}) {
          const auto it = stages.find(stage);
          if (it != stages.end()) total += it->second;
        }
        for (const auto& [stage, ms] : stages) times.by_stage[stage].push_back(ms);
        times.by_stage[frame_stage].push_back(total);
      }
      all.push_back(std::move(times));
    }
  }
  return all;
}

Table run_time_table(const Evidence& evidence) {
  const double fps = evidence.published.at("text_claims").at("runtime_fps").get<double>();
  const double published_ms = ms_per_s / fps;
  std::vector<StageTimes> rows;
  for (const RunTimes& times : run_times(evidence)) {
    for (const auto& [stage, ms] : times.by_stage) {
      const auto published = stage == frame_stage ? std::optional(published_ms) : std::nullopt;
      rows.push_back({times.data, times.estimator, stage, times.part, ms, published});
    }
  }
  add_systems(evidence, published_ms, rows);
  const Fields<StageTimes> fields = {
      {Column::text("data"), &StageTimes::data},
      {Column::text("estimator"), &StageTimes::estimator},
      {Column::text("stage"), &StageTimes::stage},
      {Column::number("median_ms", "median [ms]", 2).leading_to("median_ms_file"),
       [](const StageTimes& row) { return median(row.ms); }},
      {Column::number("q95_ms", "q95 [ms]", 2), [](const StageTimes& row) { return quantile(row.ms, 0.95); }},
      {Column::count("published_ms", "published [ms]"), &StageTimes::published_ms},
      {Column::count("pairs"), [](const StageTimes& row) { return row.ms.size(); }},
      {Column::text("median_ms_file").only_in_files(),
       [](const StageTimes& row) { return records_of_part(row.part); }}};
  Table table = numbered_table("VII", "Not measured here: no experiment was timed.", fields, rows);
  table.caption = fmt::format(fmt::runtime(table.caption), fps, published_ms);
  return table;
}

}  // namespace sextant
