#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/report/figures/panels.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {

namespace {

/// One curve with its bars: the item that differs between the lines of a figure.
struct Line {
  std::string name;
  std::string title;
  std::string key;  ///< prefix of its columns in the CSV
  std::string colour;
  int point = 0;
  std::map<double, const NoiseLevelRow*> by_level;

  std::string style(double width) const {
    return fmt::format("with linespoints lc rgb \"{}\" lw {} pt {} ps 0.6", colour, width, point);
  }
  std::string bound_style() const { return fmt::format("with lines lc rgb \"{}\" lw 1.2 dt 3", colour); }
};

std::string column_key(const std::string& text) {
  std::string key = file_stem(text);
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

/// Metrics of the figures: curves on the left axis, bars on the right axis.
const MetricDefinition& curve_error() { return metric(NumberMap::errors, "Et_m"); }
const MetricDefinition& bar_error() { return metric(NumberMap::errors, "ER_deg"); }

/// Content of a kind of figure: what its lines are, and which statistic they show, the mean, or the RMSE, to
/// which the Cramer-Rao bound refers.
struct Content {
  const char* prefix;  ///< prefix of the file name
  const char* what;    ///< caption
  const char* word;    ///< axis
  IntervalEstimate SampleSummary::*statistic;
  std::string NoiseLevelRow::*line;
  size_t min_lines;
  bool bars;
};
constexpr Content error_figure = {
    "error", "Error of all bodies", "mean", &SampleSummary::mean, &NoiseLevelRow::body, 1, true};
constexpr Content estimator_figure = {
    "estimators", "Error of the estimators", "RMS", &SampleSummary::rmse, &NoiseLevelRow::estimator, 2,
    false};

/// Rows of every line at one level.
struct Level {
  double level = 0;
  std::vector<const NoiseLevelRow*> of_line;  ///< null if the line does not have the level
};

std::vector<Level> levels_of(const std::vector<Line>& lines) {
  std::set<double> all;
  for (const Line& line : lines) {
    for (const auto& [level, row] : line.by_level) all.insert(level);
  }
  std::vector<Level> levels;
  for (const double level : all) {
    levels.push_back({level, {}});
    for (const Line& line : lines) {
      const NoiseLevelRow* const* row = find_in(line.by_level, level);
      levels.back().of_line.push_back(row == nullptr ? nullptr : *row);
    }
  }
  return levels;
}

/// Returns the statistic of one error; nullopt if the row does not have it.
std::optional<IntervalEstimate> estimate_of(const NoiseLevelRow& row, const MetricDefinition& error,
                                            IntervalEstimate SampleSummary::*statistic) {
  const SampleSummary* summary = find_in(row.errors, error.name);
  return summary ? std::optional(summary->*statistic) : std::nullopt;
}

std::optional<double> bound_of(const NoiseLevelRow& row) {
  const Efficiency* limit = find_in(row.limit.efficiency, curve_error().name);
  return limit ? std::optional(limit->bound) : std::nullopt;
}

/// One row per level; for each line E_t and E_R with their intervals, and the bound of E_t.
Table level_data(const std::vector<Line>& lines, const std::vector<Level>& levels,
                 IntervalEstimate SampleSummary::*statistic) {
  Fields<Level> fields = {{Column::text("level"), &Level::level}};
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string prefix = lines[i].key + "_";
    Fields<NoiseLevelRow> of_line;
    for (const MetricDefinition* error : {&curve_error(), &bar_error()}) {
      of_line.add(
          estimate_fields(Column::text(prefix + error->name), prefix + error->key("low"),
                          prefix + error->key("high")),
          [error, statistic](const NoiseLevelRow& row) { return estimate_of(row, *error, statistic); });
    }
    of_line.add(Column::text(prefix + curve_error().key("bound")), bound_of);
    fields.add(of_line, [i](const Level& level) { return level.of_line[i]; });
  }
  return table_of("", "", fields, levels);
}

/// Returns half of the space for the bars of each level, which is also the margin of the axis. If the
/// smallest step is at least a twelfth of the range, this is half of that step for all levels. Otherwise it
/// is half of the distance to the nearest level, but at most half of the mean step, and at least 0.4 % of the
/// range, so that bars remain visible.
std::vector<double> half_steps(const std::vector<Level>& levels) {
  const double range = levels.back().level - levels.front().level;
  std::vector<double> half;  // of the distance to the nearest neighbour
  for (size_t i = 0; i < levels.size(); ++i) {
    double step = std::numeric_limits<double>::infinity();
    if (i > 0) step = std::min(step, levels[i].level - levels[i - 1].level);
    if (i + 1 < levels.size()) step = std::min(step, levels[i + 1].level - levels[i].level);
    half.push_back(step / 2);
  }
  const double smallest = *std::ranges::min_element(half);
  const double mean_step = range / static_cast<double>(levels.size() - 1);
  const double widest = 2 * smallest >= range / 12 ? smallest : mean_step / 2;
  for (double& h : half) h = std::clamp(h, std::min(0.004 * range, widest), widest);
  return half;
}

/// Returns the labels of the levels, with four significant digits, or with as many as distinguish them.
std::vector<std::string> level_labels(const std::vector<Level>& levels) {
  std::vector<std::string> labels;
  for (int digits = 4; digits <= std::numeric_limits<double>::max_digits10; ++digits) {
    labels.clear();
    for (const Level& level : levels) labels.push_back(fmt::format("{:.{}g}", level.level, digits));
    if (std::set<std::string>(labels.begin(), labels.end()).size() == labels.size()) break;
  }
  return labels;
}

/// Returns the gnuplot command for the tics: at most six labels, placed at levels. A label that would overlap
/// the one to its right is left out.
std::string level_tics(const std::vector<Level>& levels, const std::vector<double>& half, double axis_cm) {
  constexpr double character_cm = 0.17, point_cm = 0.09, gap_cm = 0.25;
  const size_t n = levels.size();
  const size_t step = (n + 5) / 6;
  const std::vector<std::string> labels = level_labels(levels);
  const double range = levels.back().level + half.back() - levels.front().level + half.front();
  std::string tics;
  double end = std::numeric_limits<double>::infinity();  // of the space to the left of the last label
  for (size_t i = n - 1; i < n; i -= step) {
    const std::string& label = labels[i];
    const auto n_points = static_cast<double>(std::ranges::count(label, '.'));
    const double width_cm =
        character_cm * (static_cast<double>(label.size()) - n_points) + point_cm * n_points + gap_cm;
    const double half_width = width_cm / axis_cm * range / 2;
    if (levels[i].level + half_width > end) continue;
    end = levels[i].level - half_width;
    tics = fmt::format("\"{}\" {}", label, levels[i].level) + (tics.empty() ? "" : ", ") + tics;
  }
  return fmt::format("set xtics ({})\n", tics);
}

/// Largest drawn values: errors with their intervals, and bounds.
struct Largest {
  double Et = 0, ER = 0, bound = 0;

  Largest(const std::vector<Level>& levels, IntervalEstimate SampleSummary::*statistic, bool with_bound) {
    for (const Level& level : levels) {
      for (const NoiseLevelRow* row : level.of_line) {
        if (row == nullptr) continue;
        include(estimate_of(*row, curve_error(), statistic), Et);
        include(estimate_of(*row, bar_error(), statistic), ER);
        if (with_bound) bound = std::max(bound, bound_of(*row).value_or(0));
      }
    }
    Et = std::max(Et, bound);
  }

 private:
  static void include(const std::optional<IntervalEstimate>& estimate, double& largest) {
    if (!estimate) return;
    largest = std::max(largest, estimate->value);
    if (estimate->interval) largest = std::max(largest, estimate->interval->high);
  }
};

std::string axes_script(const std::vector<Level>& levels, const std::vector<double>& half,
                        const Largest& largest, const std::string& x_title, const Content& content,
                        double axis_cm) {
  std::string script = fmt::format("set xlabel {} noenhanced offset 0,0.4\nset xrange [{}:{}]\n{}",
                                   gp_text(x_title), levels.front().level - half.front(),
                                   levels.back().level + half.back(), level_tics(levels, half, axis_cm));
  script += fmt::format("set ylabel \"{} error {}{}\"\nset yrange [0:{}]\n", content.word,
                        curve_error().heading(), content.bars ? " (curves)" : "",
                        largest.Et > 0 ? (content.bars ? 1.45 : 1.1) * largest.Et : 1.0);
  if (!content.bars) return script;
  return script + fmt::format(
                      "set border 11\nset ytics nomirror\nset y2tics\n"
                      "set y2label \"{} error {} (bars)\"\nset y2range [0:{}]\n",
                      content.word, bar_error().heading(), largest.ER > 0 ? 1.9 * largest.ER : 1.0);
}

std::string column(const Line& line, const char* name) {
  return fmt::format("(column(\"{}_{}\"))", line.key, name);
}

/// Width of the bars of one line at each level.
struct BarWidths {
  std::vector<double> at_level;
  std::string function;  ///< gnuplot's definition of width(level); "" if all widths are equal

  BarWidths(const std::vector<Level>& levels, const std::vector<double>& half, double n_lines) {
    for (const double h : half) at_level.push_back(1.5 * h / n_lines);
    if (std::ranges::count(half, half.front()) == std::ssize(half)) return;
    function = "width(level) = ";
    for (size_t i = 0; i + 1 < levels.size(); ++i) {
      function += fmt::format("level < {} ? {} : ", (levels[i].level + levels[i + 1].level) / 2, at_level[i]);
    }
    function += fmt::format("{}\n", at_level.back());
  }

  /// Returns the gnuplot expression of `factor` times the width.
  std::string times(double factor) const {
    if (function.empty()) return fmt::format("{}", factor * at_level.front());
    return fmt::format("{}*width(column(\"level\"))", factor);
  }
};

/// Draws E_R of one line as bars on the right axis, with their intervals; `place` is the place of the bars
/// beside their level, in widths.
void add_bars(const Line& line, double place, const BarWidths& widths, std::vector<std::string>& parts) {
  const std::string shift = widths.times(place);
  parts.push_back(
      fmt::format("data using (column(\"level\")+{}):{}:({}) axes x1y2 with boxes fc rgb \"{}\" fs "
                  "transparent solid 0.25 noborder",
                  shift, column(line, "ER_deg"), widths.times(0.9), line.colour));
  // Intervals are vectors, because error bars would blank a disc around the top of each bar.
  const std::string low = column(line, "ER_low_deg");
  parts.push_back(
      fmt::format("data using (column(\"level\")+{}):{}:(0):({}-{}) axes x1y2 with vectors nohead lc rgb "
                  "\"{}\" lw 0.75",
                  shift, low, column(line, "ER_high_deg"), low, line.colour));
}

constexpr const char* common_bound_style = "with lines lc rgb \"#606060\" lw 1.2 dt 3";

/// Returns the width of a figure, in cm, whose legend fits several columns if it has many entries.
double width_for(const std::vector<Line>& lines) { return lines.size() <= 5 ? 8.8 : 18.0; }

void add_curve(const Line& line, double width, std::vector<std::string>& plots) {
  plots.push_back(fmt::format(
      "data using (column(\"level\")):{}:{} with filledcurves fc rgb \"{}\" fs transparent solid 0.3",
      column(line, "Et_low_m"), column(line, "Et_high_m"), line.colour));
  plots.push_back(
      fmt::format("data using (column(\"level\")):{} {}", column(line, "Et_m"), line.style(width)));
}

/// Returns the lines whose bounds are drawn: those with a bound, or only one of them if all have the same. A
/// bound belongs to the points of its estimator, so it differs between estimators that use other points.
std::vector<const Line*> bounds_to_draw(const std::vector<Line>& lines, const std::vector<Level>& levels) {
  constexpr double same = 1e-6;  // relative difference
  std::vector<const Line*> with_bound;
  for (const Line& line : lines) {
    if (std::ranges::any_of(line.by_level, [](const auto& at) { return bound_of(*at.second).has_value(); }))
      with_bound.push_back(&line);
  }
  const auto has_own_bound = [](const Level& level) {
    std::optional<double> low, high;
    for (const NoiseLevelRow* row : level.of_line) {
      const auto bound = row != nullptr ? bound_of(*row) : std::nullopt;
      if (!bound) continue;
      low = std::min(low.value_or(*bound), *bound);
      high = std::max(high.value_or(*bound), *bound);
    }
    return low && *high - *low > same * *high;
  };
  if (with_bound.empty() || std::ranges::any_of(levels, has_own_bound)) return with_bound;
  return {*std::ranges::max_element(with_bound, {}, [](const Line* line) { return line->by_level.size(); })};
}

/// Draws curves of E_t with bands, and optionally E_R as bars on the right axis. Curves of RMS errors have
/// their bounds, dotted; those of mean errors have none, because it is a bound of RMS errors.
void set_curves(const std::vector<Line>& lines, const std::vector<Level>& levels, const std::string& x_title,
                const Content& content, Figure& figure) {
  PanelLayout layout{.width_cm = width_for(lines), .panel_height_cm = 6.0, .left_cm = 1.7, .top_cm = 0.2};
  if (content.bars) layout.right_cm = 1.6;
  Panel panel;
  std::vector<LegendEntry> legend;
  const auto n = static_cast<double>(lines.size());
  const std::vector<double> half = half_steps(levels);
  const BarWidths widths(levels, half, n);
  const Largest largest(levels, content.statistic, !content.bars);
  for (size_t i = 0; content.bars && i < lines.size(); ++i)
    add_bars(lines[i], static_cast<double>(i) - (n - 1) / 2, widths, panel.plots);
  for (size_t i = 0; i < lines.size(); ++i) {
    // Estimators often agree, so later curves are thinner to keep the earlier ones visible.
    const double width = content.bars ? 1.5 : std::max(1.0, 4.0 - 1.5 * static_cast<double>(i));
    add_curve(lines[i], width, panel.plots);
    legend.push_back({lines[i].title, lines[i].style(width)});
  }
  const std::vector<const Line*> bounds =
      content.bars ? std::vector<const Line*>() : bounds_to_draw(lines, levels);
  for (const Line* line : bounds) {
    const std::string style = bounds.size() > 1 ? line->bound_style() : common_bound_style;
    panel.plots.push_back(
        fmt::format("data using (column(\"level\")):{} {}", column(*line, "Et_bound_m"), style));
    legend.push_back({bounds.size() > 1 ? "bound of " + line->title : "bound (RMS)", style});
  }
  panel.settings = axes_script(levels, half, largest, x_title, content, layout.plot_width_cm());
  if (content.bars) panel.settings += widths.function;
  set_panels(layout, legend, {panel}, figure);
  figure.script += "unset y2tics\nunset y2label\n";  // another terminal draws the legend next
}

/// Rows of the same figure, in order.
using Groups = std::map<std::vector<std::string>, std::vector<const NoiseLevelRow*>>;

/// `systems` holds the styles of all estimators of the report.
std::vector<Line> lines_by(const std::vector<const NoiseLevelRow*>& rows, std::string NoiseLevelRow::*member,
                           const SystemStyles& systems) {
  std::vector<Line> lines;
  std::map<std::string, size_t> places;  // by name
  std::set<std::string> keys;
  for (const NoiseLevelRow* row : rows) {
    const std::string& name = row->*member;
    const auto [place, is_new] = places.try_emplace(name, lines.size());
    if (is_new) {
      const bool is_body = member == &NoiseLevelRow::body;
      const std::string title = is_body ? body_title(name) : name;
      std::string key = column_key(name);
      if (!keys.insert(key).second) key += fmt::format("_{}", lines.size());
      keys.insert(key);
      const size_t i = lines.size();
      lines.push_back({name,
                       title,
                       key,
                       is_body ? line_colour(i) : systems.colour(name),
                       is_body ? filled_point(i) : systems.point(name),
                       {}});
    }
    lines[place->second].by_level[row->level] = row;
  }
  return lines;
}

/// Formats the number of seeds of all points of the lines: "20", or "3 to 20".
std::string seeds_text(const std::vector<Line>& lines) {
  int fewest = INT_MAX, most = 0;
  for (const Line& line : lines) {
    for (const auto& [level, row] : line.by_level) {
      fewest = std::min(fewest, static_cast<int>(row->n_seeds));
      most = std::max(most, static_cast<int>(row->n_seeds));
    }
  }
  return fewest == most ? fmt::format("{}", most) : fmt::format("{} to {}", fewest, most);
}

Figure curves_figure(const std::vector<std::string>& key, const std::vector<Line>& lines,
                     const std::vector<Level>& levels, const NoiseLevelRow& first, const Content& content) {
  Figure figure;
  figure.name = content.prefix;
  for (const std::string& part : key) figure.name += "_" + file_stem(part);
  figure.data = level_data(lines, levels, content.statistic);
  const std::string of = content.bars ? first.estimator : body_title(first.body);
  const size_t others = first.parameter.find(" with ");
  figure.caption =
      fmt::format("{} against noise{}, {} {}, {}. Curves: {} E_t over {} seeds, bands: its 95 % interval.{}",
                  content.what, others == std::string::npos ? "" : first.parameter.substr(others),
                  first.dataset, first.sequence, of, content.word, seeds_text(lines),
                  content.bars ? " Bars: mean E_R with its 95 % interval." : "");
  std::string noise;  // at the highest level, because level 0 has none
  for (const NoiseLevelRow* row : levels.back().of_line) {
    if (row != nullptr) noise = row->noise;
  }
  set_curves(lines, levels, parameter_title(first.parameter, noise), content, figure);
  return figure;
}

/// With more curves the figure would be unreadable; the table has the numbers.
constexpr size_t most_lines = 100;

/// Makes one figure for each group of rows that differ only in `content.line` and the level, with at least 2
/// levels and at most most_lines lines.
void add_figures(const std::vector<NoiseLevelRow>& rows, const Content& content, const SystemStyles& systems,
                 std::vector<Figure>& figures) {
  Groups groups;
  for (const NoiseLevelRow& row : rows) {
    if (!row.errors.contains(curve_error().name) || !row.errors.contains(bar_error().name)) continue;
    const std::string& of = content.bars ? row.estimator : row.body;
    groups[{row.parameter, row.dataset, row.sequence, of}].push_back(&row);
  }
  for (const auto& [key, of_figure] : groups) {
    const std::vector<Line> lines = lines_by(of_figure, content.line, systems);
    if (lines.size() < content.min_lines || lines.size() > most_lines) continue;
    const std::vector<Level> levels = levels_of(lines);
    if (levels.size() < 2) continue;
    figures.push_back(curves_figure(key, lines, levels, *of_figure.front(), content));
  }
}

}  // namespace

std::vector<Figure> noise_level_figures(const std::vector<NoiseLevelRow>& levels) {
  std::vector<NoiseLevelRow> rows = levels;
  for (NoiseLevelRow& row : rows)  // another kind of noise with the same level is a separate line
    if (row.noise.find(" (spatial ") != std::string::npos) row.estimator += ", correlated";
  std::vector<Figure> figures;
  const SystemStyles systems = styles_of(rows);
  add_figures(rows, error_figure, systems, figures);
  add_figures(rows, estimator_figure, systems, figures);
  return figures;
}

std::vector<Figure> achieved_noise_figures(const std::vector<AchievedNoiseRow>& rows) {
  const std::vector<std::string> channels = {"depth", "flow x", "flow y", "flow EPE"};
  std::map<std::string, std::vector<AchievedNoiseRow>> by_source;
  for (const AchievedNoiseRow& row : rows) {
    if (row.requested_px.value_or(0) > 0 && row.achieved_px)
      by_source[row.parameter + "_" + row.source].push_back(row);
  }
  std::vector<Figure> figures;
  for (const auto& [name, of_source] : by_source) {
    Figure figure;
    figure.name = "achieved_" + file_stem(name);
    Fields<AchievedNoiseRow> fields = {{Column::text("requested_px"), &AchievedNoiseRow::requested_px}};
    for (const std::string& channel : channels) {
      fields.add(Column::text(column_key(channel)), [channel](const AchievedNoiseRow& row) {
        return channel == row.channel ? Cell(row.achieved_px) : Cell();
      });
    }
    std::set<std::string> present;
    double highest = 0;
    for (const AchievedNoiseRow& row : of_source) {
      present.insert(row.channel);
      highest = std::max({highest, *row.requested_px, *row.achieved_px});
    }
    figure.data = table_of("", "", fields, of_source);
    figure.caption = fmt::format(
        "Achieved against requested noise, {}, all bodies and levels: on the diagonal the noise is what it "
        "says.",
        of_source.front().source);
    figure.script = fmt::format(
        "set xlabel \"requested [px]\"\nset ylabel \"achieved [px]\"\nset xrange [0:{0}]\n"
        "set yrange [0:{0}]\n"
        "plot x with lines lc rgb \"#909090\" dt 2 title \"requested = achieved\"",
        1.1 * highest);
    for (size_t i = 0; i < channels.size(); ++i) {
      if (!present.contains(channels[i])) continue;
      const std::string title = channels[i] == "depth" ? "depth: \u0394d" : channels[i];
      figure.script += fmt::format(
          ", \\\n  data using (column(\"requested_px\")):(column(\"{}\")) with points lc rgb \"{}\" pt {} ps "
          "0.7 title {}",
          column_key(channels[i]), line_colour(i + 1), open_point(i), gp_text(title));
    }
    figure.script += "\n";
    figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
