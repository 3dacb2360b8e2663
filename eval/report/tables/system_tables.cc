// Our tables of systems: VII, run time per stage; IX, accuracy, coverage and time per frame of published
// systems and our estimators in one run.

#include "sextant/eval/report/tables/paper_table.h"

#include <algorithm>
#include <map>

#include "sextant/eval/report/record_reading.h"
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

namespace {

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

/// Result of one estimator on one kind of data.
struct SystemRow {
  std::string data, estimator, part;
  Errors camera, objects;
  RoundTimes frame_ms;
  std::optional<double> unit_ms;  ///< time of the paper's method for a frame of the same data
  Json description;               ///< description of a published system; empty for our estimators

  void add(const Record& record) {
    if (has_truth(record)) (record.is_ego() ? camera : objects).add(record);
    // An external program reports its own time of a frame ("program"); for our estimators the stages of all
    // bodies are summed.
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

/// Returns the description of the system that records call `estimator`; an empty object for our estimators.
Json description_of(const Json& descriptions, const std::string& estimator) {
  for (const Json& entry : descriptions) {
    if (entry.at("estimator") == estimator) return entry;
  }
  return Json::object();
}

/// The cells of E_t link to the address in the column `address`, unless it is empty.
Fields<Errors> error_fields(const std::string& prefix, const std::string& title, const char* address) {
  return {
      {Column::number(prefix + "Et_m", title + " E_t [m]", 4).leading_to(address),
       [](const Errors& e) { return mean_of(e.Et_m); }},
      {Column::number(prefix + "ER_deg", "E_R [deg]", 4), [](const Errors& e) { return mean_of(e.ER_deg); }}};
}

Column coverage_column(const std::string& prefix) {
  return Column::count(prefix + "coverage_percent", "coverage [%]");
}

}  // namespace

Table systems_table(const Evidence& evidence) {
  const Json descriptions = system_descriptions();
  std::vector<SystemRow> rows;
  for (const EvidencePart* part : evidence.with(PartRole::systems)) {
    std::map<std::string, std::map<std::string, SystemRow>> by_data;
    for (const Record& record : part->records)
      by_data[data_title(record.dataset, record.sequence)][record.estimator].add(record);
    for (auto& [data, by_estimator] : by_data) {
      const SystemRow* ours = find_in(by_estimator, paper().method);
      const std::optional<double> unit_ms = ours ? ours->median_ms() : std::nullopt;
      for (auto& [estimator, row] : by_estimator) {
        row.data = data;
        row.estimator = estimator;
        row.part = part->name;
        row.unit_ms = unit_ms;
        row.description = description_of(descriptions, estimator);
        rows.push_back(row);
      }
    }
  }
  Fields<SystemRow> fields = {{Column::text("data").folded(), &SystemRow::data},
                              {Column::text("estimator"), &SystemRow::estimator}};
  fields.add(error_fields("", "camera", "Et_m_file"), [](const SystemRow& row) { return &row.camera; });
  fields.add(coverage_column(""), [](const SystemRow& row) { return row.camera.coverage_percent(); });
  fields.add(error_fields("objects_", "objects", ""), [](const SystemRow& row) { return &row.objects; });
  fields.add(
      {{Column::number("objects_Ev_kmh", "E_v [km/h]", 2),
        [](const SystemRow& row) { return mean_of(row.objects.Ev_kmh); }},
       {coverage_column("objects_"), [](const SystemRow& row) { return row.objects.coverage_percent(); }},
       {Column::number("frame_ms", "frame [ms]", 1), &SystemRow::median_ms},
       {Column::number("frame_ratio", "in frames of " + paper().method, 1), [](const SystemRow& row) {
          const std::optional<double> ms = row.median_ms();
          return ms && row.unit_ms ? Cell(*ms / *row.unit_ms) : Cell();
        }}});
  const std::pair<const char*, const char*> descriptive[] = {{"repository", "repository"},
                                                             {"commit", "commit"},
                                                             {"sees", "reads of the truth"},
                                                             {"changes", "changed"}};
  for (const auto& [key, title] : descriptive)
    fields.add(Column::text(key, title),
               [key = key](const SystemRow& row) { return row.description.value(key, std::string()); });
  fields.add(Column::text("Et_m_file").only_in_files(),
             [](const SystemRow& row) { return records_of_part(row.part); });
  return numbered_table("IX", "Not stored for this data.", fields, rows);
}

}  // namespace sextant
