#include "sextant/eval/view/run_report.h"

#include <algorithm>
#include <memory>
#include <tuple>

#include "sextant/base/files.h"
#include "sextant/base/new_file.h"
#include "sextant/eval/pictures/pictures.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/run_summary.h"

namespace sextant {
namespace {

constexpr int picture_px = 560;
constexpr const char* records_beside = "records.jsonl";  // in the folder of the page

/// Estimates the first seed of sources again that were not estimated in this run.
void catch_up(const RunReportRequest& request, WorstFrames& worst) {
  for (size_t i = 0; i < request.result.sources.size(); ++i) {
    if (worst.has_seen(request.result.sources[i].info)) continue;
    RunConfig again = request.config;
    again.sources = {request.config.sources[i]};
    again.n_seeds = 1;
    again.journal = nullptr;
    again.rescore = true;  // external programs are not started
    again.on_pair = [&](const FrameResult& pair, std::span<const Record> of_pair) {
      worst.add(pair, of_pair);
    };
    run(again);
  }
}

/// Formats "0.0123" or "0.0123 to 0.2".
std::string range_text(std::vector<double> values, int digits) {
  std::ranges::sort(values);
  if (values.size() == 1) return fmt::format("{:.{}f}", values.front(), digits);
  return fmt::format("{:.{}f} to {:.{}f}", values.front(), digits, values.back(), digits);
}

/// Summarises the result in one sentence each for camera and objects.
std::string answer(const RunReportRequest& request) {
  const std::vector<BodySummary> rows = summarize(request.result.records, request.preset);
  const std::string how(to_string(request.preset.aggregate));
  const auto sentence = [&](bool ego) {
    std::vector<double> Et, ER;
    int n = 0, n_truth = 0, n_estimated = 0;
    for (const BodySummary& row : rows) {
      if ((row.body == "ego") != ego) continue;
      ++n;
      n_truth += row.n_truth;
      n_estimated += row.n_estimated;
      if (const auto e = find_number(row.metrics, "Et_m")) Et.push_back(*e);
      if (const auto e = find_number(row.metrics, "ER_deg")) ER.push_back(*e);
    }
    if (n == 0) return std::string(ego ? "" : " No objects.");
    std::string text = ego ? " Camera: " : fmt::format(" {} object{}: ", n, n == 1 ? "" : "s");
    text += fmt::format("{} of {} pairs with truth estimated", n_estimated, n_truth);
    if (!Et.empty()) text += fmt::format(", {} E_t {} m", how, range_text(Et, 4));
    if (!ER.empty()) text += fmt::format(", E_R {} deg", range_text(ER, 4));
    return text + ".";
  };
  return fmt::format("{} on {} source{}, preset {}.", request.config.estimator, request.result.sources.size(),
                     request.result.sources.size() == 1 ? "" : "s", request.preset.name) +
         sentence(true) + sentence(false);
}

std::string source_title(const SequenceInfo& info) { return info.dataset + " " + info.sequence; }

/// Names of the sources for use in file names.
std::vector<std::string> stems_of(const RunReportRequest& request) {
  std::vector<std::string> stems;
  for (const SourceRun& source : request.result.sources) stems.push_back(file_stem(folder_name(source.info)));
  return distinct_names(std::move(stems));
}

/// Folder of a source's page, below the folder of the results, as given in the command.
std::string view_folder(const RunReportRequest& request, size_t source) {
  return request.result.sources.size() == 1 ? "view" : "view_" + stems_of(request)[source];
}

/// Folder in which sources are found from anywhere; empty if the program finds them by itself.
std::string data_root(const RunReportRequest& request) {
  std::error_code ignored;
  if (!request.data_root.empty()) return fs::absolute(request.data_root).lexically_normal().string();
  const bool any = std::ranges::any_of(request.config.sources, [&](const SourceSpec& spec) {
    return fs::path(spec.path).is_relative() && fs::is_directory(spec.path, ignored);
  });
  return any ? fs::current_path().string() : "";
}

ReportSection view_section(const RunReportRequest& request) {
  ReportSection section{"view-section", "Interactive page"};
  section.paragraphs = {
      "Run in this folder, the command below makes a page of every frame with points, flow, masks and errors "
      "over time; the "
      "pictures of the worst frames link to it."};
  const std::string root = data_root(request);
  for (size_t i = 0; i < request.result.sources.size(); ++i) {
    std::string line = "sextant view .";
    if (request.result.sources.size() > 1)
      line += " --source " + shell_word(request.result.sources[i].source);
    if (!root.empty()) line += " --data " + shell_word(root);
    section.commands.push_back(line + " --out " + shell_word(view_folder(request, i)));
  }
  return section;
}

std::string worst_caption(const std::string& title, const WorstFrame& worst) {
  const Record& r = worst.record;
  std::string text = fmt::format("{}, frame {}: E_t {:.4f} m", title, r.frame, worst.Et_m);
  if (const auto e = find_number(r.errors, "ER_deg")) text += fmt::format(", E_R {:.4f} deg", *e);
  if (const auto e = find_number(r.errors, "Ev_kmh")) text += fmt::format(", E_v {:.2f} km/h", *e);
  return text + fmt::format("; {} points, {} inliers.", r.n_points, r.n_inliers);
}

/// Line of a record in records.jsonl, from 1.
size_t line_of(const Record& wanted, const std::vector<Record>& records) {
  const auto key = [](const Record& r) {
    return std::tie(r.dataset, r.sequence, r.estimator, r.body, r.frame, r.seed);
  };
  const auto at = std::ranges::find_if(records, [&](const Record& r) { return key(r) == key(wanted); });
  SEXTANT_CHECK(at != records.end());
  return static_cast<size_t>(at - records.begin()) + 1;
}

/// Section with one row of pictures per body; a table repeats the numbers.
ReportSection worst_section(const RunReportRequest& request, size_t index, const WorstFrames& worst) {
  const SourceRun& source = request.result.sources[index];
  SourceSpec spec = request.config.sources[index];
  spec.add_options(resolve_options(request.config.options).source);
  const std::unique_ptr<Sequence> sequence = open_source(spec);
  const std::string stem = stems_of(request)[index];
  ReportSection section{"worst_" + stem, "Worst frames: " + source_title(source.info)};
  Table table{"",
              "",
              {Column::text("body"), Column::count("frame"), Column::number("Et_m", "E_t [m]", 4),
               Column::count("points"), Column::count("inliers", "inliers"),
               Column::count("line", "line of records")}};
  Channels channels;
  channels.rgb = source.info.channels.rgb;
  channels.mask = source.info.channels.mask;
  for (const auto& [order, frames] : worst.of(source.info)) {
    for (const WorstFrame& frame : frames) {
      const Record& r = frame.record;
      if (r.frame <= source.info.first_frame || r.frame > source.info.last_frame) continue;
      table.add_row(
          {r.body.str(), r.frame, frame.Et_m, r.n_points, r.n_inliers, line_of(r, request.result.records)});
      if (!channels.rgb) continue;
      const std::string title = body_title(r.body);
      section.pictures.push_back(
          {fmt::format("{}_{}_{}", section.name, file_stem(r.body), r.frame), worst_caption(title, frame),
           fmt::format("Points of {} in frame {}", title, r.frame),
           draw_body(sequence->read(frame.prev, channels), frame.result, picture_px),
           fmt::format("{}/index.html#frame={}&body={}", view_folder(request, index), r.frame, r.body.str()),
           true});
    }
  }
  add_addresses("line", std::vector<std::string>(table.rows.size(), records_beside), table);
  section.paragraphs = {
      channels.rgb
          ? "The three frames of each body with the largest E_t, of the first seed. Discs are inliers of the "
            "estimate, crosses are outliers; lines are a quarter of the flow."
          : "The three frames of each body with the largest E_t, of the first seed. The source has no "
            "images."};
  section.tables = {{"table_" + section.name, std::move(table)}};
  return section;
}

/// Error of the true speed by sequence.
std::map<std::string, double> speed_floors(const RunResult& result) {
  std::map<std::string, double> floors;
  for (const Record& record : result.records) {
    const auto floor_m = find_number(record.values, "step_floor_m");
    if (!floor_m) continue;
    for (const SourceRun& source : result.sources) {
      if (source.info.sequence == record.sequence)
        floors[record.sequence] = 3.6 * source.info.rate_hz * *floor_m;
    }
  }
  return floors;
}

/// Makes the figure from above of a source. If a program has several results, tracks and speeds are those of
/// the first one.
std::vector<Figure> top_view(const RunReportRequest& request, const SourceRun& source) {
  const std::vector<Record>& records = request.result.records;
  const RecordRefs drawn = records_of_tracks(records, source.info.dataset, source.info.sequence);
  const std::string title = source_title(source.info);
  std::vector<Figure> figures = showcase_figures(title, source.tracks, drawn);
  for (Figure& figure : figures) {
    figure.name = "tracks_" + file_stem(folder_name(source.info));
    std::string system;
    if (!drawn.empty() && std::ranges::any_of(records, [&](const Record& r) {
          return r.estimator != drawn.front()->estimator;
        }))
      system = drawn.front()->estimator;
    figure.caption = fmt::format(
        "Camera and objects from above, {}{}{}. Estimates begin at the truth; objects: the origin of the "
        "true box, moved by the estimated motions. Numbers: mean estimated speed.{}",
        title, system.empty() ? "" : ", " + system,
        seed_text(drawn.empty() ? 0 : drawn.front()->seed, static_cast<size_t>(request.config.n_seeds)),
        system.empty() ? ""
                       : fmt::format(" Of the results of the program, only {}, the first by name, is drawn "
                                     "here and written to tracks.csv, est_camera_*.txt and "
                                     "obj_*_motion.txt.",
                                     system));
  }
  return figures;
}

std::string machine() {
  const Json json = build_provenance();
  const Json machine = json.value("machine", Json::object());
  return fmt::format("{}; {}", machine.value("cpu", std::string("unknown")),
                     json.value("compiler", std::string("unknown compiler")));
}

std::vector<std::pair<std::string, std::string>> provenance(const RunReportRequest& request) {
  std::vector<std::pair<std::string, std::string>> lines = {
      {"program", fmt::format("sextant {}, commit {}", version(), git_commit())},
      {"machine", machine()},
      {"estimator", fmt::format("{} {}", request.config.estimator,
                                json_line(request.result.configuration["options"]["estimator"]))}};
  if (!request.config.noise.none())
    lines.emplace_back("noise",
                       fmt::format("{}, level {}, {} seeds", json_line(request.config.noise.options()),
                                   request.config.level, request.config.n_seeds));
  for (const SourceRun& source : request.result.sources) {
    const SequenceInfo& info = source.info;
    lines.emplace_back("source",
                       fmt::format("{}: frames {} to {}, {} x {} px, {}", source.source, info.first_frame,
                                   info.last_frame, info.width, info.height,
                                   source.inputs.empty() ? "no files: comes with the program"
                                                         : fmt::format("{} files", source.inputs.size())));
    for (const std::string& line : info.provenance) lines.emplace_back("", line);
    for (const std::string& warning : info.all_warnings()) lines.emplace_back("warning", warning);
  }
  lines.emplace_back("everything",
                     "run.json: all options, packages, SHA-256 of every input; records.jsonl: every number");
  return lines;
}

void add(ReportSection section, ReportDocument& document) {
  if (!section.figures.empty() || !section.tables.empty()) document.sections.push_back(std::move(section));
}

}  // namespace

ReportDocument run_document(const RunReportRequest& request, WorstFrames& worst) {
  catch_up(request, worst);
  const RunResult& result = request.result;
  ReportDocument document;
  document.title = fmt::format("{} on {}", request.config.estimator,
                               result.sources.size() == 1 ? result.sources.front().source
                                                          : fmt::format("{} sources", result.sources.size()));
  document.abstract = answer(request);
  ReportSection summary{"summary-section", "Summary"};
  Table table = summary_table(result.records, request.preset);
  add_record_links(summarize(result.records, request.preset), record_places(result.records, records_beside),
                   ".", table);
  summary.tables = {{"summary_table", std::move(table), {"dataset", "sequence", "estimator"}}};
  document.sections.push_back(std::move(summary));
  document.sections.push_back(view_section(request));
  ReportSection over_time{"timeline-section", "Errors over time"};
  over_time.figures = timeline_figures(result.records, request.preset);
  std::ranges::move(speed_figures(result.records, speed_floors(result)),
                    std::back_inserter(over_time.figures));
  add(std::move(over_time), document);
  ReportSection above{"top-view-section", "From above"};
  for (const SourceRun& source : result.sources) {
    for (Figure& figure : top_view(request, source)) above.figures.push_back(std::move(figure));
  }
  add(std::move(above), document);
  ReportSection distribution{"distribution-section", "Distribution of the errors"};
  distribution.figures = distribution_figures(record_sets(result.records));
  add(std::move(distribution), document);
  for (size_t i = 0; i < result.sources.size(); ++i)
    document.sections.push_back(worst_section(request, i, worst));
  document.provenance = provenance(request);
  return document;
}

namespace {

const BodyResult* result_of(const FrameResult& frame, const Record& record) {
  if (record.is_ego()) return &frame.ego;
  const auto it = std::ranges::find(frame.objects, body_order(record.body), &BodyResult::instance);
  return it == frame.objects.end() ? nullptr : &*it;
}

bool is_worse(const WorstFrame& a, const WorstFrame& b) {
  return a.Et_m > b.Et_m || (a.Et_m == b.Et_m && a.record.frame < b.record.frame);
}

}  // namespace

void WorstFrames::add(const FrameResult& result, std::span<const Record> of_pair) {
  if (of_pair.empty()) return;
  const Record& first = of_pair.front();
  OfSequence& sequence = sequences_[{first.dataset, first.sequence}];
  sequence.frames.insert(first.frame);
  for (const Record& record : of_pair) {
    if (record.estimator != first.estimator || record.status != Status::ok || !has_truth(record)) continue;
    const std::string key = record.is_ego() ? "Et_m" : preset_.object_key("Et_m");
    const BodyResult* body = result_of(result, record);
    if (body == nullptr || !record.errors.contains(key)) continue;
    std::vector<WorstFrame>& worst = sequence.bodies[body_order(record.body)];
    WorstFrame frame{record, {}, result.prev, record.errors.at(key)};
    const auto place = std::ranges::upper_bound(worst, frame, is_worse);
    if (place - worst.begin() >= static_cast<std::ptrdiff_t>(n_frames)) continue;
    frame.result = *body;
    worst.insert(place, std::move(frame));
    if (worst.size() > n_frames) worst.pop_back();
  }
}

bool WorstFrames::has_seen(const SequenceInfo& info) const {
  const auto sequence = sequences_.find({info.dataset, info.sequence});
  if (sequence == sequences_.end()) return false;
  const auto next = sequence->second.frames.upper_bound(info.first_frame);
  return next != sequence->second.frames.end() && *next <= info.last_frame;
}

const std::map<int, std::vector<WorstFrame>>& WorstFrames::of(const SequenceInfo& info) const {
  static const std::map<int, std::vector<WorstFrame>> none;
  const auto sequence = sequences_.find({info.dataset, info.sequence});
  return sequence == sequences_.end() ? none : sequence->second.bodies;
}

}  // namespace sextant
