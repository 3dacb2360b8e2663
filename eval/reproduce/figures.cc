#include "sextant/eval/reproduce/figures.h"

#include <algorithm>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/report/errors_by_level.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/paper/paper_layout.h"
#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/tables/paper_sets.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/eval/reproduce/parts.h"

namespace sextant {
namespace {

using Sections = std::vector<PlacedSection>;

constexpr int page_quality = 85;  // of JPEG pictures on the page; the lossless PNG lies beside it

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
                    "outline, "
                    "estimated and true speed.",
         .alt = "Camera image with static features on the background and the outlines of moving objects",
         .png = png,
         .link = "pictures/" + part->name + "-picture.png",
         .jpeg = encode_jpeg(decode_png_rgb(png, "overlay.png"), page_quality)}};
    section.figures = showcase_figures(title, parse_tracks(read_file(tracks), tracks), records);
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

/// Joins the published systems that were measured under the same noise on the same data.
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

/// Record sets of the paper's experiments on the data of one experiment, with the paper's names of bodies;
/// only bodies that were estimated.
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

/// Record sets of the experiment whose data are nearest to the paper's and whose method is the paper's.
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
  for (const auto& [own, recorded] : paper().parts_of_recorded()) {
    if (floors.contains(recorded)) floors[own] = floors.at(recorded);
  }
  return floors;
}

/// Adds the tests of dynamic against static of one experiment, as a table and their curves.
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

}  // namespace

std::vector<PlacedSection> figure_sections(const fs::path& parts, const Evidence& evidence, int jobs) {
  Sections sections;
  add_showcases(parts, evidence, sections);
  std::vector<NoiseLevelRow> all_levels;
  std::vector<std::vector<NoiseLevelRow>> sweeps;
  for (const EvidencePart* part : evidence.with(PartRole::noise)) {
    const NoisePart shown = with_systems(*part, evidence);
    std::vector<NoiseLevelRow> levels = noise_levels(shown.part.sweep, jobs);
    add_noise_levels(parts, levels, shown, sections);
    all_levels.insert(all_levels.end(), levels.begin(), levels.end());
    sweeps.push_back(std::move(levels));
  }
  std::ranges::stable_sort(sweeps, {}, [](const std::vector<NoiseLevelRow>& rows) {
    return rows.empty() ? SIZE_MAX : data_nearness(rows.front().dataset);
  });
  add_section(PaperPlace::fig_4, "fig4",
              "Fig. 4: error against depth and flow "
              "noise",
              paper_noise_figures(sweeps), sections, false);
  std::vector<RecordSet> sets;
  for (const EvidencePart* part : evidence.with(PartRole::sets))
    std::ranges::move(paper_record_sets(*part), std::back_inserter(sets));
  add_section(PaperPlace::fig_5, "fig5", "Fig. 5: flow before and after the optimisation",
              paper_epe_figures(nearest_sets(evidence)), sections, false);
  add_section(PaperPlace::fig_5, "fig5_estimators",
              "Fig. 5, by estimator "
              "(ours)",
              epe_figures(sets), sections);
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
