#include "sextant/eval/report/figures/record_figures.h"

#include <algorithm>
#include <map>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

/// One curve with its bars: what changes from level to level.
struct Line {
  std::string name;
  std::string title;
  std::string key;  ///< prefix of its columns in the CSV
  std::map<double, const NoiseLevelRow*> by_level;
};

std::string column_key(const std::string& text) {
  std::string key = file_stem(text);
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

/// The errors of the figures: curves, and bars on the right axis.
const MetricDefinition& curve_error() { return metric(NumberMap::errors, "Et_m"); }
const MetricDefinition& bar_error() { return metric(NumberMap::errors, "ER_deg"); }

void add_error(const NoiseLevelRow* row, const MetricDefinition& error,
               IntervalEstimate SampleSummary::*statistic, std::vector<Cell>& cells) {
  const SampleSummary* summary = row == nullptr ? nullptr : find_in(row->errors, error.name);
  add_estimate(summary ? std::optional(summary->*statistic) : std::nullopt, cells);
}

/// What a figure's curves and bars show: the mean, or the RMSE, which the bound is a bound of.
struct Content {
  const char* prefix;  ///< of its file
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

/// One row a level; per line E_t and E_R with their intervals, and the bound of E_t.
Table level_data(const std::vector<Line>& lines, IntervalEstimate SampleSummary::*statistic) {
  Table table;
  std::set<double> levels;
  table.columns = {{"level", "level"}};
  for (const Line& line : lines) {
    for (const MetricDefinition* error : {&curve_error(), &bar_error()}) {
      for (const std::string& name : {error->name, error->key("low"), error->key("high")})
        table.columns.push_back({line.key + "_" + name, name});
    }
    table.columns.push_back({line.key + "_" + curve_error().key("bound"), "bound"});
    for (const auto& [level, row] : line.by_level) levels.insert(level);
  }
  for (const double level : levels) {
    std::vector<Cell> cells = {level};
    for (const Line& line : lines) {
      const NoiseLevelRow* const* row = find_in(line.by_level, level);
      const NoiseLevelRow* known = row == nullptr ? nullptr : *row;
      add_error(known, curve_error(), statistic, cells);
      add_error(known, bar_error(), statistic, cells);
      const Efficiency* limit =
          known == nullptr ? nullptr : find_in(known->limit.efficiency, curve_error().name);
      cells.push_back(limit ? std::optional(limit->bound) : std::nullopt);
    }
    table.add_row(std::move(cells));
  }
  return table;
}

/// At most six labels, at levels.
std::string level_tics(const Table& data) {
  const size_t n = data.rows.size();
  const size_t step = (n + 5) / 6;
  std::string tics;
  for (size_t i = n - 1; i < n; i -= step) {
    const double level = std::get<double>(data.rows[i][0]);
    tics = fmt::format("\"{0:.2g}\" {0}", level) + (tics.empty() ? "" : ", ") + tics;
  }
  return fmt::format("set xtics ({})\n", tics);
}

/// Half the smallest step between levels.
double half_step(const Table& data) {
  double step = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < data.rows.size(); ++i) {
    step = std::min(step, std::get<double>(data.rows[i][0]) - std::get<double>(data.rows[i - 1][0]));
  }
  return step / 2;
}

double largest(const Table& data, const std::string& ending) {
  double max = 0;
  for (size_t j = 0; j < data.columns.size(); ++j) {
    if (!data.columns[j].key.ends_with(ending)) continue;
    for (const std::vector<Cell>& row : data.rows) {
      if (const auto* value = std::get_if<double>(&row[j])) max = std::max(max, *value);
    }
  }
  return max;
}

std::string axes_script(const Table& data, const std::string& x_title, const Content& content) {
  const double half = half_step(data);
  const double first = std::get<double>(data.rows.front()[0]);
  const double last = std::get<double>(data.rows.back()[0]);
  const double highest_Et =
      std::max({largest(data, "_Et_high_m"), largest(data, "_Et_m"), largest(data, "_Et_bound_m")});
  const double highest_ER = std::max(largest(data, "_ER_high_deg"), largest(data, "_ER_deg"));
  std::string script = fmt::format("set xlabel {} noenhanced\nset xrange [{}:{}]\n{}", gp_text(x_title),
                                   first - half, last + half, level_tics(data));
  script +=
      fmt::format("set ylabel \"{} error {}{}\"\nset yrange [0:{}]\n", content.word, curve_error().heading(),
                  content.bars ? " (curves)" : "", highest_Et > 0 ? 1.45 * highest_Et : 1.0);
  if (!content.bars) return script;
  return script + fmt::format(
                      "set border 11\nset ytics nomirror\nset y2tics\n"
                      "set y2label \"{} error {} (bars)\"\nset y2range [0:{}]\n",
                      content.word, bar_error().heading(), highest_ER > 0 ? 1.9 * highest_ER : 1.0);
}

std::string column(const Line& line, const char* name) {
  return fmt::format("(column(\"{}_{}\"))", line.key, name);
}

/// E_R of one line as bars on the right axis, with their intervals.
void add_bars(const Line& line, size_t i, double shift, double width, std::vector<std::string>& parts) {
  parts.push_back(
      fmt::format("data using (column(\"level\")+{}):{}:({}) axes x1y2 with boxes fc rgb \"{}\" fs "
                  "transparent solid 0.25 noborder notitle",
                  shift, column(line, "ER_deg"), 0.9 * width, line_colour(i)));
  // As vectors: error bars would blank a disc around the top of each bar.
  const std::string low = column(line, "ER_low_deg");
  parts.push_back(
      fmt::format("data using (column(\"level\")+{}):{}:(0):({}-{}) axes x1y2 with vectors nohead lc rgb "
                  "\"{}\" lw 0.75 notitle",
                  shift, low, column(line, "ER_high_deg"), low, line_colour(i)));
}

void add_curve(const Line& line, size_t i, double width, std::vector<std::string>& parts) {
  parts.push_back(fmt::format(
      "data using (column(\"level\")):{}:{} with filledcurves fc rgb \"{}\" fs transparent solid 0.3 notitle",
      column(line, "Et_low_m"), column(line, "Et_high_m"), line_colour(i)));
  parts.push_back(fmt::format(
      "data using (column(\"level\")):{} with linespoints lc rgb \"{}\" lw {} pt {} ps 0.6 title {}",
      column(line, "Et_m"), line_colour(i), width, filled_point(i), gp_text(line.title)));
}

/// Curves of E_t with bands, their bounds dotted; with bars E_R on the right axis.
std::string curves_script(const std::vector<Line>& lines, const Table& data, const std::string& x_title,
                          const Content& content) {
  std::vector<std::string> parts;
  const auto n = static_cast<double>(lines.size());
  const double width = 1.5 * half_step(data) / n;
  for (size_t i = 0; content.bars && i < lines.size(); ++i) {
    add_bars(lines[i], i, (static_cast<double>(i) - (n - 1) / 2) * width, width, parts);
  }
  for (size_t i = 0; i < lines.size(); ++i) {
    // Estimators often agree: the later curves are thinner, so that the earlier ones show.
    add_curve(lines[i], i, content.bars ? 1.5 : std::max(1.0, 4.0 - 1.5 * static_cast<double>(i)), parts);
  }
  const bool has_bound = largest(data, "_Et_bound_m") > 0;
  for (size_t i = 0; has_bound && i < (content.bars ? lines.size() : 1); ++i) {
    const std::string title = i == 0 ? "title \"bound (RMS)\"" : "notitle";
    parts.push_back(fmt::format("data using (column(\"level\")):{} with lines lc rgb \"{}\" lw 1.2 dt 3 {}",
                                column(lines[i], "Et_bound_m"), content.bars ? line_colour(i) : "#606060",
                                title));
  }
  std::string script = axes_script(data, x_title, content) + "plot \\\n";
  for (size_t i = 0; i < parts.size(); ++i)
    script += "  " + parts[i] + (i + 1 < parts.size() ? ", \\\n" : "\n");
  return script;
}

/// Rows that belong into one figure, in order.
using Groups = std::map<std::vector<std::string>, std::vector<const NoiseLevelRow*>>;

std::vector<Line> lines_by(const std::vector<const NoiseLevelRow*>& rows,
                           std::string NoiseLevelRow::*member) {
  std::vector<Line> lines;
  std::map<std::string, size_t> places;  // by name
  std::set<std::string> keys;
  for (const NoiseLevelRow* row : rows) {
    const std::string& name = row->*member;
    const auto [place, is_new] = places.try_emplace(name, lines.size());
    if (is_new) {
      const std::string title = member == &NoiseLevelRow::body ? body_title(name) : name;
      std::string key = column_key(name);
      if (!keys.insert(key).second) key += fmt::format("_{}", lines.size());
      keys.insert(key);
      lines.push_back({name, title, key, {}});
    }
    lines[place->second].by_level[row->level] = row;
  }
  return lines;
}

Figure curves_figure(const std::vector<std::string>& key, const std::vector<Line>& lines,
                     const NoiseLevelRow& first, const Content& content) {
  Figure figure;
  figure.name = content.prefix;
  for (const std::string& part : key) figure.name += "_" + file_stem(part);
  figure.data = level_data(lines, content.statistic);
  const std::string of = content.bars ? first.estimator : body_title(first.body);
  figure.caption =
      fmt::format("{} against noise, {} {}, {}. Curves: {} E_t over {} seeds, bands: its 95 % interval.{}",
                  content.what, first.dataset, first.sequence, of, content.word, first.n_seeds,
                  content.bars ? " Bars: mean E_R with its 95 % interval." : "");
  figure.script = curves_script(lines, figure.data, parameter_title(first.parameter), content);
  return figure;
}

/// More curves than this cannot be told apart: the table has their numbers.
constexpr size_t most_lines = 100;

/// One figure for every group of rows that agree in all but `content.line` and the level, of 2 levels or more and at most
/// most_lines lines.
void add_figures(const std::vector<NoiseLevelRow>& rows, const Content& content,
                 std::vector<Figure>& figures) {
  Groups groups;
  for (const NoiseLevelRow& row : rows) {
    if (!row.errors.contains(curve_error().name) || !row.errors.contains(bar_error().name)) continue;
    const std::string& of = content.bars ? row.estimator : row.body;
    groups[{row.parameter, row.dataset, row.sequence, of}].push_back(&row);
  }
  for (const auto& [key, of_figure] : groups) {
    const std::vector<Line> lines = lines_by(of_figure, content.line);
    if (lines.size() < content.min_lines || lines.size() > most_lines ||
        level_data(lines, content.statistic).rows.size() < 2)
      continue;
    figures.push_back(curves_figure(key, lines, *of_figure.front(), content));
  }
}

}  // namespace

std::vector<Figure> noise_level_figures(const std::vector<NoiseLevelRow>& levels) {
  std::vector<NoiseLevelRow> rows = levels;
  for (NoiseLevelRow& row : rows)  // the same level of another kind of noise is another line
    if (row.noise.find(" (spatial ") != std::string::npos) row.estimator += ", correlated";
  std::vector<Figure> figures;
  add_figures(rows, error_figure, figures);
  add_figures(rows, estimator_figure, figures);
  return figures;
}

std::vector<Figure> achieved_noise_figures(const std::vector<AchievedNoiseRow>& rows) {
  const std::vector<std::string> channels = {"depth", "flow x", "flow y", "flow EPE"};
  std::map<std::string, std::vector<const AchievedNoiseRow*>> by_source;
  for (const AchievedNoiseRow& row : rows) {
    if (row.requested_px > 0) by_source[row.parameter + "_" + row.source].push_back(&row);
  }
  std::vector<Figure> figures;
  for (const auto& [name, of_source] : by_source) {
    Figure figure;
    figure.name = "achieved_" + file_stem(name);
    figure.data.columns = {{"requested_px", ""}};
    for (const std::string& channel : channels) figure.data.columns.push_back({column_key(channel), ""});
    std::set<std::string> present;
    double highest = 0;
    for (const AchievedNoiseRow* row : of_source) {
      std::vector<Cell> cells = {row->requested_px};
      for (const std::string& channel : channels) {
        cells.push_back(channel == row->channel ? std::optional(row->achieved_px) : std::nullopt);
      }
      figure.data.add_row(std::move(cells));
      present.insert(row->channel);
      highest = std::max({highest, row->requested_px, row->achieved_px});
    }
    figure.caption = fmt::format(
        "Achieved against requested noise, {}, all bodies and levels: on the diagonal the noise is what it "
        "says.",
        of_source.front()->source);
    figure.script = fmt::format(
        "set xlabel \"requested [px]\"\nset ylabel \"achieved [px]\"\nset xrange [0:{0}]\nset yrange [0:{0}]\n"
        "plot x with lines lc rgb \"#909090\" dt 2 title \"requested = achieved\"",
        1.1 * highest);
    for (size_t i = 0; i < channels.size(); ++i) {
      if (!present.contains(channels[i])) continue;
      const std::string title = channels[i] == "depth" ? "depth: \u0394d" : channels[i];
      figure.script += fmt::format(
          ", \\\n  data using (column(\"requested_px\")):(column(\"{}\")) with points lc rgb \"{}\" pt {} ps 0.7 "
          "title {}",
          column_key(channels[i]), line_colour(i + 1), open_point(i), gp_text(title));
    }
    figure.script += "\n";
    figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace sextant
