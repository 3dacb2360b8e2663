// Table IX (ours): the published systems beside ours, accuracy, coverage and time per frame of one run.

#include <map>

#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/eval/report/tables/run_time.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr const char* yardstick = "joint_flow";

struct Errors {
  std::vector<double> Et_m, ER_deg, Ev_kmh;
  int n_truth = 0;

  void add(const Record& record) {
    ++n_truth;
    if (record.status != Status::ok) return;
    const auto put = [&](const char* key, std::vector<double>& values) {
      if (const auto value = find_number(record.errors, key)) values.push_back(*value);
    };
    put("Et_m", Et_m);
    put("ER_deg", ER_deg);
    put("Ev_kmh", Ev_kmh);
  }
  std::optional<double> coverage_percent() const {
    if (n_truth == 0) return std::nullopt;
    return 100.0 * static_cast<double>(Et_m.size()) / n_truth;
  }
};

/// What one estimator did on one kind of data.
struct Row {
  Errors camera, objects;
  RoundTimes frame_ms;

  void add(const Record& record) {
    if (has_truth(record)) (record.is_ego() ? camera : objects).add(record);
    // A program tells its own time of a frame ("program"); of ours the stages of all bodies are summed.
    for (const char* stage : {"program", "extraction", "total"}) {
      const auto ms = find_number(record.time_ms, stage);
      if (ms) frame_ms[{record.seed, record.frame}] += *ms;
      if (ms && stage == std::string_view("program")) break;
    }
  }
  std::optional<double> median_ms() const {
    const std::vector<double> best = best_rounds_ms(frame_ms);
    return best.empty() ? std::nullopt : std::optional(median(best));
  }
};

std::optional<double> mean_of(const std::vector<double>& values) {
  return values.empty() ? std::nullopt : std::optional(mean(values));
}

/// The description of the system that records call `estimator`; none for ours.
Json description_of(const Json& descriptions, const std::string& estimator) {
  for (const Json& entry : descriptions) {
    if (entry.at("estimator") == estimator) return entry;
  }
  return Json::object();
}

}  // namespace

Table systems_table(const Evidence& evidence) {
  Table table{
      "Table IX (ours): the published systems beside ours",
      "Measured once, all in one run on one machine, estimator after estimator and that three times; not "
      "measured again here. Preset paper: means over pairs and seeds of those that were estimated; coverage: "
      "estimated pairs of those with truth, objects that move by truth. Frame: the program's own time "
      "without reading files, the best of the three rounds, median over frames; in ours extraction, camera "
      "and objects on one thread. The programs use threads of their own, and the machine did other work too.",
      {Column::text("data").folded(), Column::text("estimator"), Column::number("Et_m", "camera E_t [m]", 4),
       Column::number("ER_deg", "E_R [deg]", 4), Column::count("coverage_percent", "coverage [%]"),
       Column::number("objects_Et_m", "objects E_t [m]", 4), Column::number("objects_ER_deg", "E_R [deg]", 4),
       Column::number("objects_Ev_kmh", "E_v [km/h]", 2),
       Column::count("objects_coverage_percent", "coverage [%]"), Column::number("frame_ms", "frame [ms]", 1),
       Column::number("frame_ratio", "in frames of joint_flow", 1), Column::text("repository"),
       Column::text("commit"), Column::text("sees", "sees of the truth"),
       Column::text("changes", "changed")}};
  const Json descriptions = system_descriptions();
  std::vector<std::string> records;
  for (const EvidencePart* part : evidence.with(PartRole::systems)) {
    std::map<std::string, std::map<std::string, Row>> by_data;
    for (const Record& record : part->records)
      by_data[data_title(record.dataset, record.sequence)][record.estimator].add(record);
    for (const auto& [data, rows] : by_data) {
      const auto ours = rows.find(yardstick);
      const std::optional<double> unit = ours == rows.end() ? std::nullopt : ours->second.median_ms();
      for (const auto& [estimator, row] : rows) {
        const std::optional<double> ms = row.median_ms();
        const Json about = description_of(descriptions, estimator);
        const auto text = [&](const char* key) { return about.value(key, std::string()); };
        table.add_row({data, estimator, mean_of(row.camera.Et_m), mean_of(row.camera.ER_deg),
                       row.camera.coverage_percent(), mean_of(row.objects.Et_m), mean_of(row.objects.ER_deg),
                       mean_of(row.objects.Ev_kmh), row.objects.coverage_percent(), ms,
                       ms && unit ? Cell(*ms / *unit) : Cell(), text("repository"), text("commit"),
                       text("sees"), text("changes")});
        records.push_back(records_of_part(part->name));
      }
    }
  }
  add_addresses("Et_m", records, table);
  if (table.rows.empty()) table.notes.push_back("Not stored for this data.");
  return table;
}

}  // namespace sextant
