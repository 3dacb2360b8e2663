// Table VII (ours): run time per stage.

#include <algorithm>
#include <map>

#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/eval/report/tables/run_time.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr double ms_per_s = 1000;

/// Of the published systems, measured once and stored: their own time of a frame, the best of its rounds.
void add_systems(const Evidence& evidence, double published_ms, Table& table,
                 std::vector<std::string>& records) {
  for (const EvidencePart* part : evidence.with(PartRole::systems)) {
    std::map<std::pair<std::string, std::string>, RoundTimes> frames;
    for (const Record& record : part->records) {
      const auto ms = find_number(record.time_ms, "program");
      if (!ms) continue;
      frames[{data_title(record.dataset, record.sequence), record.estimator}][{record.seed, record.frame}] =
          *ms;
    }
    for (const auto& [key, rounds] : frames) {
      const std::vector<double> ms = best_rounds_ms(rounds);
      table.add_row(
          {key.first, key.second, "frame, stored", median(ms), quantile(ms, 0.95), published_ms, ms.size()});
      records.push_back(records_of_part(part->name));
    }
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
  Table table;
  table.title = "Table VII (ours): run time";
  const double fps = evidence.published.at("text_claims").at("runtime_fps").get<double>();
  table.caption = fmt::format(
      "Milliseconds per frame pair on one thread, median and 95 % quantile over pairs. The frame is "
      "extraction, camera and objects: what the paper's {:.0f} fps ({:.0f} ms) are compared with; reading or "
      "rendering the images (decode) and the networks are not in it. The machine stands in the provenance. Stored: "
      "the published systems' own times, measured once on another occasion; beside ours of the same run in table IX.",
      fps, ms_per_s / fps);
  table.columns = {Column::text("data"),
                   Column::text("estimator"),
                   Column::text("stage"),
                   Column::number("median_ms", "median [ms]", 2),
                   Column::number("q95_ms", "q95 [ms]", 2),
                   Column::count("published_ms", "published [ms]"),
                   Column::count("pairs")};
  std::vector<std::string> records;
  for (const RunTimes& times : run_times(evidence)) {
    for (const auto& [stage, ms] : times.by_stage) {
      table.add_row({times.data, times.estimator, stage, median(ms), quantile(ms, 0.95),
                     stage == frame_stage ? Cell(ms_per_s / fps) : Cell(), ms.size()});
      records.push_back(records_of_part(times.part));
    }
  }
  add_systems(evidence, ms_per_s / fps, table, records);
  add_addresses("median_ms", records, table);
  if (table.rows.empty()) table.notes.push_back("Not measured here: no part was timed.");
  return table;
}

}  // namespace sextant
