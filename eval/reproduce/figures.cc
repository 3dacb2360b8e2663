#include "sextant/eval/reproduce/reproduce.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/noise_tables.h"
#include "sextant/eval/report/paper/paper_layout.h"
#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {

namespace {

constexpr size_t most_lines = 26;
constexpr double lowest = 0.02, highest = 50;  // range of the axis; values beyond are drawn at its ends

struct Line {
  std::string label;
  const PaperRow* ours = nullptr;
  const PaperRow* code = nullptr;  ///< measured with the published code's procedure
};

/// Splits an estimator's label into its name and its procedure.
std::pair<std::string, std::string> split_name(const std::string& estimator) {
  const size_t comma = estimator.find(", ");
  if (comma == std::string::npos) return {estimator, ""};
  return {estimator.substr(0, comma), estimator.substr(comma + 2)};
}

/// Formats "S18-F124-134 Obj1 joint E_t [m]".
std::string label_of(const PaperRow& row) {
  std::string label;
  for (const std::string& word :
       {row.group, row.body, estimator_title(split_name(row.estimator).first), row.quantity})
    if (!word.empty()) label += (label.empty() ? "" : " ") + word;
  return label;
}

std::vector<Line> lines_of(const std::vector<PaperRow>& rows) {
  std::vector<Line> lines;
  for (const PaperRow& row : rows) {
    if (!row.published || !row.measured || *row.published <= 0 || row.measured->value <= 0) continue;
    const std::string procedure = split_name(row.estimator).second;
    const bool is_code = procedure == paper().code_procedure;
    if (!is_code && !procedure.empty()) continue;
    const std::string label = label_of(row);
    auto line = std::ranges::find(lines, label, &Line::label);
    if (line == lines.end()) line = lines.insert(lines.end(), Line{label});
    const PaperRow*& drawn = is_code ? line->code : line->ours;
    if (drawn == nullptr || drawn->noise == row.noise) drawn = &row;
  }
  return lines;
}

/// Returns an interval relative to the published value.
std::optional<Interval> ratio_of(const std::optional<Interval>& range, const PaperRow& row) {
  return range ? std::optional(Interval{range->low / *row.published, range->high / *row.published})
               : std::nullopt;
}

std::string colour_of(const PaperRow& row) {
  const Tone tone = tone_of(row.verdict());
  return tone == Tone::agrees ? "#009E73" : tone == Tone::differs ? "#D55E00" : "#7F7F7F";
}

}  // namespace

std::optional<Figure> answer_figure(const std::string& name, const PublishedTable& table) {
  std::vector<Line> lines = lines_of(table.rows);
  if (lines.empty()) return std::nullopt;
  const size_t n_all = lines.size();
  lines.resize(std::min(n_all, most_lines));

  Figure figure;
  figure.name = "answer_" + name;
  figure.data =
      figure_data({"line", "series", "tone", "y", "x", "low", "high", "run_low", "run_high", "verdict"});
  std::string words;
  std::vector<std::string> labels;
  size_t longest = 0;
  double from = 0.5, to = 2;
  std::set<std::pair<std::string, std::string>> drawn;  // pairs of series and colour
  const auto add = [&](const char* series, const PaperRow& row, double y) {
    const double x = row.measured->value / *row.published;
    const auto interval = ratio_of(row.measured->interval, row), runs = ratio_of(row.measured->one_run, row);
    figure.data.add_row({label_of(row), series, colour_of(row), y, x, low_of(interval), high_of(interval),
                         low_of(runs), high_of(runs), row.verdict()});
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", gp_tic(row.verdict()), gp_number(y));
    drawn.insert({series, colour_of(row)});
    for (const auto& [low, high] :
         {Interval{x, x}, interval.value_or(Interval{x, x}), runs.value_or(Interval{x, x})}) {
      from = std::clamp(low, lowest, from);
      to = std::clamp(high, to, highest);
    }
  };
  const bool has_code = std::ranges::any_of(lines, [](const Line& line) { return line.code != nullptr; });
  for (size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    labels.push_back(line.label);
    longest = std::max(longest, line.label.size());
    const auto y = static_cast<double>(i);
    if (line.ours != nullptr) add("ours", *line.ours, y + (has_code ? -0.2 : 0.0));
    if (line.code != nullptr) add("published code", *line.code, y + 0.2);
  }
  from /= 1.15;
  to *= 1.15;
  Panel panel;
  panel.settings = fmt::format(
      "set logscale x\nset xrange [{}:{}]\nset yrange [{}:-0.7]\nset ytics ({}) noenhanced\n"
      "set y2range [{}:-0.7]\n"
      "set y2tics ({}) noenhanced scale 0\nset xtics (0.02,0.05,0.1,0.2,0.5,1,2,5,10,20,50)\n"
      "set xlabel \"measured / published\" offset 0,0.4\nset arrow 1 from 1, graph 0 to 1, graph 1 nohead lc "
      "rgb \"#000000\" lw 1\n",
      gp_number(from), gp_number(to), gp_number(static_cast<double>(lines.size()) - 0.3), gp_tics(labels),
      gp_number(static_cast<double>(lines.size()) - 0.3), words);
  for (const auto& [series, tone] : drawn) {
    const std::string& colour = tone;  // clang 14 captures no structured binding
    const std::string y = only_where({{"series", series}, {"tone", colour}}, "column(\"y\")");
    const auto bar = [&](const char* low, const char* high, double width, const char* shade) {
      const auto within = [&](const char* column) {
        return fmt::format("(column(\"{0}\") < {1} ? {1} : column(\"{0}\") > {2} ? {2} : column(\"{0}\"))",
                           column, gp_number(from), gp_number(to));
      };
      panel.plots.push_back(
          fmt::format("data using {0}:{2}:({1}-{0}):(0) with vectors nohead lc rgb \"{3}{4}\" lw {5}",
                      within(low), within(high), y, shade, colour.substr(1), gp_number(width)));
    };
    const auto arrow = [&](const std::string& is_beyond, double end, double length) {
      panel.plots.push_back(
          fmt::format("data using ({} ? {} : NaN):{}:({}):(0) with vectors head filled lc rgb \"{}\" lw 2",
                      is_beyond, gp_number(end - length), y, gp_number(length), colour));
    };
    bar("run_low", "run_high", 6, "#A0");
    bar("low", "high", 2, "#00");
    const auto points = [&](int shape, const std::string& of_colour) {
      panel.plots.push_back(fmt::format(
          "data using (column(\"x\")):{} with points pt {} ps 0.55 lc rgb \"{}\"", y, shape, of_colour));
    };
    constexpr int disc = 7, circle = 6;
    points(disc, series == "ours" ? colour : "#FFFFFF");
    if (series != "ours") points(circle, colour);
    arrow(fmt::format("column(\"x\") < {}", gp_number(from)), from, -0.25 * from);
    arrow(fmt::format("column(\"x\") > {}", gp_number(to)), to, 0.2 * to);
  }
  std::vector<LegendEntry> legend;
  if (has_code)
    legend = {{"our procedure", "with points pt 7 ps 0.6 lc rgb \"#404040\""},
              {"published code's", "with points pt 6 ps 0.6 lc rgb \"#404040\""}};
  const double per_line_cm = has_code ? 0.8 : 0.4;
  const PanelLayout layout{.width_cm = 13.0,
                           .panel_height_cm = 1.5 + per_line_cm * static_cast<double>(lines.size() + 1),
                           .left_cm = std::min(8.0, 0.5 + 0.135 * static_cast<double>(longest)),
                           .right_cm = 2.5,
                           .bottom_cm = 1.0,
                           .top_cm = 0.2};
  set_panels(layout, legend, {panel}, figure);
  figure.script += "unset y2tics\nset y2range [*:*]\n";
  figure.caption = fmt::format(
      "{}: published value (1), our mean with its 95 % interval (thin) and where 95 % of single runs lie "
      "(broad); an arrow stands for a value beyond the axis.{}",
      paper().table(table.number).title,
      n_all > lines.size() ? fmt::format(" {} of {} values; the table has all.", lines.size(), n_all) : "");
  return figure;
}

namespace {

using Sections = std::vector<PlacedSection>;

constexpr int page_quality = 85;  // of JPEG pictures on the page; the lossless PNG is a file of the report

void add_section(PaperPlace place, const std::string& name, const std::string& heading,
                 std::vector<Figure> figures, Sections& sections, bool is_detail = true) {
  if (figures.empty()) return;
  ReportSection section{name, heading, {}, {}, std::move(figures), {}};
  section.is_detail = is_detail;
  sections.push_back({place, std::move(section)});
}

/// Fig. 1: the picture of one frame pair, and the tracks from above.
void add_showcases(const fs::path& parts, const Evidence& evidence, Sections& sections) {
  for (const EvidencePart* part : evidence.with(PartRole::showcase)) {
    const std::vector<Record>& records = part->records;
    const std::string title = data_title(records.front().dataset, records.front().sequence);
    const std::string tracks = (parts / part->name / "tracks.csv").string();
    ReportSection section{part->name + "-section", "Fig. 1: " + title};
    const std::string png = read_file(parts / part->name / "overlay.png");
    section.pictures = {
        {.name = part->name + "-picture",
         .caption = "Static features with a quarter of their flow; moving objects with their points, "
                    "outline, estimated and true speed.",
         .alt = "Camera image with static features on the background and the outlines of moving objects",
         .png = png,
         .link = "pictures/" + part->name + "-picture.png",
         .jpeg = encode_jpeg(decode_png_rgb(png, "overlay.png"), page_quality)}};
    section.figures =
        showcase_figures(title, parse_tracks(read_file(tracks), tracks),
                         records_of_tracks(records, records.front().dataset, records.front().sequence));
    for (Figure& figure : section.figures) figure.name = part->name + "_" + figure.name;
    sections.push_back({PaperPlace::fig_1, std::move(section)});
  }
}

/// An experiment with noise levels, and the names of the experiments that its levels come from.
struct NoisePart {
  EvidencePart part;
  std::vector<std::string> names;
};

/// Fig. 4: error against noise, depth on the left, flow on the right; one section per experiment.
void add_noise_levels(const fs::path& parts, const std::vector<NoiseLevelRow>& levels, const NoisePart& noise,
                      Sections& sections) {
  const EvidencePart& part = noise.part;
  const bool is_depth = part.sweep.parameter.starts_with("depth.");
  const Record& first = part.records.front();
  ReportSection section{part.name + "-section",
                        fmt::format("Fig. 4 {}: error against {} noise, {}", is_depth ? "left" : "right",
                                    is_depth ? "depth" : "flow", data_title(first.dataset, first.sequence))};
  Table table = noise_level_table(levels);
  std::vector<fs::path> folders;
  for (const std::string& name : noise.names) folders.push_back(parts / name);
  add_record_links(levels, record_places(folders, {part.sweep}), parts.parent_path() / "report", table);
  section.tables.push_back({"fig_4_" + part.name, std::move(table), {"dataset", "sequence"}});
  section.figures = noise_level_figures(levels);
  section.is_detail = true;
  sections.push_back({PaperPlace::fig_4, std::move(section)});
}

/// Adds to an experiment the levels of the published systems that were measured under the same noise on the
/// same data.
NoisePart with_systems(const EvidencePart& part, const Evidence& evidence) {
  NoisePart joined{part, {part.name}};
  const Record& ours = part.records.front();
  for (const EvidencePart* systems : evidence.with(PartRole::systems_noise)) {
    const std::vector<Record>& records = systems->records;
    if (systems->sweep.parameter != part.sweep.parameter || records.empty() ||
        records.front().dataset != ours.dataset || records.front().sequence != ours.sequence)
      continue;
    add_levels(systems->sweep, joined.part.sweep);
    joined.names.push_back(systems->name);
  }
  return joined;
}

/// Returns a record set for each of the paper's sets that the records of one experiment cover. Bodies have
/// the paper's names; bodies that were never estimated are left out.
std::vector<RecordSet> paper_record_sets(const EvidencePart& part) {
  std::vector<RecordSet> sets;
  for (const SetData& data : paper().sets) {
    RecordSet set{part.name + "_" + data.set, data.set + ", " + data.filter.dataset, {}};
    for (const auto& [body, records] : paper_bodies(matching(part.records, data.filter)))
      if (std::ranges::count(records, Status::ok, &Record::status) > 0) set.bodies.push_back({body, records});
    if (!set.bodies.empty()) sets.push_back(std::move(set));
  }
  return sets;
}

/// Returns the record sets of the experiment that has records of the paper's method on the data nearest to
/// the paper's; none if no experiment has such records.
std::vector<RecordSet> nearest_sets(const Evidence& evidence) {
  const EvidencePart* nearest = nullptr;
  for (const EvidencePart* part : evidence.with(PartRole::sets)) {
    const auto has_method = [](const Record& record) { return record.estimator == paper().method; };
    if (!std::ranges::any_of(part->records, has_method)) continue;
    const auto rank = [](const EvidencePart& p) { return data_nearness(p.records.front().dataset); };
    if (nearest == nullptr || rank(*part) < rank(*nearest)) nearest = part;
  }
  return nearest == nullptr ? std::vector<RecordSet>() : paper_record_sets(*nearest);
}

std::vector<CameraPath> recorded_paths(const fs::path& folder, const std::string& sequence) {
  const auto positions = [](const std::string& path) {
    return read_trajectory(path, "tum").poses.positions_m;
  };
  std::vector<CameraPath> paths;
  for (const RecordedSystem& system : recorded_systems()) {
    const std::string stem = (folder / fmt::format("{}_{}", system.folder, sequence)).string();
    if (!fs::exists(stem + "_estimate.tum")) continue;
    if (paths.empty()) paths.push_back({truth_path, positions(stem + "_reference.tum")});
    paths.push_back({system.name, positions(stem + "_estimate.tum")});
  }
  return paths;
}

std::vector<TopView> recorded_views(const fs::path& folder) {
  std::vector<TopView> views;
  for (const std::string& sequence : recorded_sequences()) {
    std::vector<CameraPath> paths = recorded_paths(folder, sequence);
    if (!paths.empty()) views.push_back({sequence, std::move(paths)});
  }
  return views;
}

/// Speed floors by sequence, and by the names that experiments give to ranges of recorded sequences.
std::map<std::string, double> speed_floors_kmh(const Evidence& evidence) {
  std::map<std::string, double> floors;
  for (const EvidencePart* part : evidence.with(PartRole::recorded))
    floors.merge(recorded_speed_floor_kmh(part->records));
  for (const auto& [own, recorded] : paper().parts_of_recorded) {
    if (floors.contains(recorded)) floors[own] = floors.at(recorded);
  }
  return floors;
}

/// Adds a section about the tests that classify the objects of one experiment as dynamic or static: a table,
/// and the receiver operating characteristics.
void add_classification(const EvidencePart& part, Sections& sections) {
  std::vector<Figure> figures = classification_figures(part.records);
  if (figures.empty()) return;
  for (Figure& figure : figures) figure.name = part.name + "_" + figure.name;
  ReportSection section{part.name + "-section", "Dynamic or static: threshold and likelihood, " +
                                                    part.records.front().dataset.str() + " (ours)"};
  Table table = classification_test_table(part.records);
  add_addresses("estimator", std::vector(table.rows.size(), records_of_part(part.name)), table);
  section.tables.push_back({"tests_" + part.name, std::move(table), {"dataset"}});
  section.figures = std::move(figures);
  section.is_detail = true;
  sections.push_back({PaperPlace::ours, std::move(section)});
}

// Attribution: E_t after each decision on the way from the published code to ours. One panel per set and
// body, one line per path; dashed lines show the values that the paper prints.

using Paths = std::vector<const AttributionPath*>;

/// Returns the decisions of all paths, each once, in order of first appearance.
std::vector<std::string> decisions_of(const Paths& paths) {
  std::vector<std::string> decisions;
  for (const AttributionPath* path : paths) {
    for (const AttributionStep& step : path->steps) add_distinct(step.decision, decisions);
  }
  return decisions;
}

std::string panel_name(const AttributionPath& path) { return path.set + " " + path.body; }

Table data_of(const Paths& paths, const std::vector<std::string>& decisions) {
  Table data = figure_data({"panel", "path", "decision", "x", "Et", "low", "high"});
  for (const AttributionPath* path : paths) {
    for (const AttributionStep& step : path->steps) {
      const auto x = std::ranges::find(decisions, step.decision) - decisions.begin();
      const double Et_m = step.Et_m.value;
      const auto [low, high] = step.Et_m.interval.value_or(Interval{Et_m, Et_m});
      data.add_row({panel_name(*path), path->path, step.decision, x, Et_m, low, high});
    }
  }
  return data;
}

Panel panel_of(const Paths& paths, const std::vector<std::string>& decisions) {
  const std::string name = panel_name(*paths.front());
  Panel panel{name, "set logscale y\nset format y \"%g\"\nset ylabel \"mean E_t [m]\" noenhanced\n", {}};
  double low = INFINITY, high = 0;
  panel.settings += fmt::format("set xtics ({}) rotate by 60 right noenhanced\nset xrange [-0.5:{}]\n",
                                gp_tics(decisions), gp_number(static_cast<double>(decisions.size()) - 0.5));
  for (size_t i = 0; i < paths.size(); ++i) {
    const AttributionPath& path = *paths[i];
    const std::string colour = estimator_colour(path.path);
    const std::string x =
        only_where({{"panel", name}, {"path", path.path}},
                   fmt::format("column(\"x\")+{}", gp_number(0.12 * (static_cast<double>(i) - 0.5))));
    panel.plots.push_back(interval_plot(x, "low", "high", colour, 1));
    panel.plots.push_back(fmt::format("data using {}:(column(\"Et\")) {}", x, estimator_style(path.path)));
    for (const AttributionStep& step : path.steps) {
      low = std::min(low, step.Et_m.value);
      high = std::max(high, step.Et_m.value);
    }
    if (!path.published_m) continue;
    panel.plots.push_back(
        fmt::format("{} with lines lc rgb \"{}\" dt 2 lw 1", gp_number(*path.published_m), colour));
    low = std::min(low, *path.published_m);
    high = std::max(high, *path.published_m);
  }
  panel.settings += fmt::format("set yrange [{}:{}]\n", gp_number(low / 1.5), gp_number(high * 1.5));
  return panel;
}

Figure figure_of(const std::string& kind, const Paths& paths) {
  Figure figure;
  figure.name = "attribution_" + file_stem(kind);
  const std::vector<std::string> decisions = decisions_of(paths);
  figure.data = data_of(paths, decisions);
  std::vector<std::pair<std::string, Paths>> by_panel;
  for (const AttributionPath* path : paths) {
    const std::string name = panel_name(*path);
    if (by_panel.empty() || by_panel.back().first != name) by_panel.push_back({name, {}});
    by_panel.back().second.push_back(path);
  }
  std::vector<Panel> panels;
  for (auto& [name, of_panel] : by_panel) {
    std::ranges::sort(of_panel, std::ranges::greater{}, &AttributionPath::path);
    panels.push_back(panel_of(of_panel, decisions));
  }
  std::vector<LegendEntry> legend;
  for (const std::string& path : {paper().baseline, paper().method}) {
    legend.push_back({"from " + estimator_title(path), estimator_style(path)});
    legend.push_back({"printed for " + estimator_title(path),
                      fmt::format("with lines lc rgb \"{}\" dt 2 lw 1", estimator_colour(path))});
  }
  const PanelLayout layout{.columns = std::min<size_t>(3, panels.size()),
                           .width_cm = 18.0,
                           .panel_height_cm = 7.6,
                           .left_cm = 2.0,
                           .bottom_cm = 3.3};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Mean E_t with 95 % intervals over {} seeds, from the published code (left) to our default (right): "
      "each step makes one decision more as we do. Dashed: the values that the paper prints. Data: {}s.",
      paths.front()->n_seeds, kind);
  return figure;
}

/// Returns one figure for each kind of data, such as scenarios or replays.
std::vector<Figure> attribution_figures(const std::vector<AttributionPath>& paths) {
  std::vector<std::pair<std::string, Paths>>
      kinds;  // "scenario", "replay": the first word of the data's title
  for (const AttributionPath& path : paths) {
    const std::string kind = path.data.substr(0, path.data.find(' '));
    auto of_kind = std::ranges::find(kinds, kind, &std::pair<std::string, Paths>::first);
    if (of_kind == kinds.end()) of_kind = kinds.insert(kinds.end(), {kind, {}});
    of_kind->second.push_back(&path);
  }
  std::vector<Figure> figures;
  for (const auto& [kind, of_kind] : kinds) figures.push_back(figure_of(kind, of_kind));
  return figures;
}

}  // namespace

std::vector<PlacedSection> figure_sections(const fs::path& parts, const Evidence& evidence, int jobs) {
  Sections sections;
  add_showcases(parts, evidence, sections);
  std::vector<NoiseLevelRow> all_levels;
  std::vector<PaperSweep> sweeps;
  for (const EvidencePart* part : evidence.with(PartRole::noise)) {
    const NoisePart shown = with_systems(*part, evidence);
    std::vector<NoiseLevelRow> levels = noise_levels(shown.part.sweep, jobs);
    add_noise_levels(parts, levels, shown, sections);
    all_levels.insert(all_levels.end(), levels.begin(), levels.end());
    PaperSweep& sweep = sweeps.emplace_back(PaperSweep{std::move(levels), {}});
    const RecordRefs records = records_where(part->records, [](const Record&) { return true; });
    for (const auto& [name, of_body] : paper_bodies(records)) {
      if (!of_body.empty()) sweep.paper_names[of_body.front()->body] = name;
    }
  }
  std::ranges::stable_sort(sweeps, {}, [](const PaperSweep& sweep) {
    return sweep.levels.empty() ? SIZE_MAX : data_nearness(sweep.levels.front().dataset);
  });
  add_section(PaperPlace::fig_4, "fig4", "Fig. 4: error against depth and flow noise",
              paper_noise_figures(sweeps), sections, false);
  std::vector<RecordSet> sets;
  for (const EvidencePart* part : evidence.with(PartRole::sets))
    std::ranges::move(paper_record_sets(*part), std::back_inserter(sets));
  add_section(PaperPlace::fig_5, "fig5", "Fig. 5: flow before and after the optimisation",
              paper_epe_figures(nearest_sets(evidence)), sections, false);
  add_section(PaperPlace::fig_5, "fig5_estimators", "Fig. 5, by estimator (ours)", epe_figures(sets),
              sections);
  add_section(PaperPlace::fig_6, "fig6", "Fig. 6: camera paths",
              top_view_figures(recorded_views(parts / "recorded")), sections, false);
  add_section(PaperPlace::ours, "attribution", "From the published code to ours (ours)",
              attribution_figures(attribution_paths(evidence)), sections);
  add_section(PaperPlace::ours, "distributions", "Distribution of the errors (ours)",
              distribution_figures(sets), sections);
  for (const EvidencePart* part : evidence.with(PartRole::classification))
    add_classification(*part, sections);
  add_section(PaperPlace::ours, "efficiency", "Errors against the bound (ours)",
              efficiency_figures(all_levels), sections);
  std::vector<Figure> speeds;
  const std::map<std::string, double> floors = speed_floors_kmh(evidence);
  for (const EvidencePart* part : evidence.with(PartRole::real))
    std::ranges::move(speed_figures(part->records, floors), std::back_inserter(speeds));
  add_section(PaperPlace::ours, "speeds", "Speed of the objects (ours)", std::move(speeds), sections);
  return sections;
}

}  // namespace sextant
