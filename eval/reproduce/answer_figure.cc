#include "sextant/eval/reproduce/reproduce.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figures/panels.h"

namespace sextant {
namespace {

constexpr size_t most_lines = 26;
constexpr double lowest = 0.02, highest = 50;  // range of the axis; values beyond are drawn at its ends

struct Line {
  std::string label;
  const PaperRow* ours = nullptr;
  const PaperRow* code = nullptr;  ///< measured with the published code's procedure
};

/// One mark of the figure; values are relative to the published value.
struct Mark {
  std::string line, series, colour;
  double y = 0, x = 0;
  std::optional<Interval> interval{}, one_run{};
  std::string verdict;
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

Mark mark_of(const std::string& series, const PaperRow& row, double y) {
  const auto ratio = [&](double value) { return std::clamp(value / *row.published, lowest, highest); };
  const auto ratios = [&](const std::optional<Interval>& i) {
    return i ? std::optional(Interval{ratio(i->low), ratio(i->high)}) : std::nullopt;
  };
  const Tone tone = tone_of(row.verdict());
  const char* colour = tone == Tone::agrees ? "#009E73" : tone == Tone::differs ? "#D55E00" : "#7F7F7F";
  return {label_of(row),
          series,
          colour,
          y,
          ratio(row.measured->value),
          ratios(row.measured->interval),
          ratios(row.measured->one_run),
          row.verdict()};
}

}  // namespace

std::optional<Figure> answer_figure(const std::string& name, const PublishedTable& table) {
  std::vector<Line> lines = lines_of(table.rows);
  if (lines.empty()) return std::nullopt;
  const size_t n_all = lines.size();
  lines.resize(std::min(n_all, most_lines));

  std::string tics, words;
  size_t longest = 0;
  std::vector<Mark> marks;
  const bool has_code = std::ranges::any_of(lines, [](const Line& line) { return line.code != nullptr; });
  for (size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    tics += fmt::format("{}{} {}", i > 0 ? ", " : "", gp_tic(line.label), i);
    longest = std::max(longest, line.label.size());
    const auto y = static_cast<double>(i);
    if (line.ours != nullptr) marks.push_back(mark_of("ours", *line.ours, y + (has_code ? -0.2 : 0.0)));
    if (line.code != nullptr) marks.push_back(mark_of("published code", *line.code, y + 0.2));
  }
  double from = 0.5, to = 2;
  std::set<std::pair<std::string, std::string>> drawn;  // pairs of series and colour
  for (const Mark& mark : marks) {
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", gp_tic(mark.verdict), gp_number(mark.y));
    drawn.insert({mark.series, mark.colour});
    from = std::min(from, mark.x), to = std::max(to, mark.x);
    for (const std::optional<Interval>& interval : {mark.interval, mark.one_run})
      if (interval) from = std::min(from, interval->low), to = std::max(to, interval->high);
  }
  Figure figure;
  figure.name = "answer_" + name;
  Fields<Mark> fields = {{Column::text("line"), &Mark::line},
                         {Column::text("series"), &Mark::series},
                         {Column::text("tone"), &Mark::colour},
                         {Column::text("y"), &Mark::y},
                         {Column::text("x"), &Mark::x}};
  fields.add_range({Column::text("low"), Column::text("high")}, &Mark::interval);
  fields.add_range({Column::text("run_low"), Column::text("run_high")}, &Mark::one_run);
  fields.add(Column::text("verdict"), &Mark::verdict);
  figure.data = table_of("", "", fields, marks);
  Panel panel;
  panel.settings = fmt::format(
      "set logscale x\nset xrange [{}:{}]\nset yrange [{}:-0.7]\nset ytics ({}) noenhanced\n"
      "set y2range [{}:-0.7]\n"
      "set y2tics ({}) noenhanced scale 0\nset xtics (0.02,0.05,0.1,0.2,0.5,1,2,5,10,20,50)\n"
      "set xlabel \"measured / published\" offset 0,0.4\nset arrow 1 from 1, graph 0 to 1, graph 1 nohead lc "
      "rgb \"#000000\" lw 1\n",
      gp_number(from / 1.15), gp_number(to * 1.15), gp_number(static_cast<double>(lines.size()) - 0.3), tics,
      gp_number(static_cast<double>(lines.size()) - 0.3), words);
  for (const auto& [series, colour] : drawn) {
    const std::string y = only_where({{"series", series}, {"tone", colour}}, "column(\"y\")");
    const auto bar = [&](const char* low, const char* high, double width, const char* shade) {
      panel.plots.push_back(fmt::format(
          "data using (column(\"{0}\")):{2}:(column(\"{1}\")-column(\"{0}\")):(0) with vectors nohead lc rgb "
          "\"{3}{4}\" lw {5}",
          low, high, y, shade, colour.substr(1), gp_number(width)));
    };
    bar("run_low", "run_high", 6, "#A0");
    bar("low", "high", 2, "#00");
    panel.plots.push_back(fmt::format("data using (column(\"x\")):{} with points pt {} ps 0.55 lc rgb \"{}\"",
                                      y, series == "ours" ? 7 : 6, colour));
  }
  std::vector<LegendEntry> legend;
  if (has_code)
    legend = {{"our procedure", "with points pt 7 ps 0.6 lc rgb \"#404040\""},
              {"published code's", "with points pt 6 ps 0.6 lc rgb \"#404040\""}};
  const double per_line_cm = has_code ? 0.52 : 0.4;
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
      "(broad).{}",
      paper().table(table.number).title,
      n_all > lines.size() ? fmt::format(" {} of {} values; the table has all.", lines.size(), n_all) : "");
  return figure;
}

std::string answer_text(const std::vector<PaperRow>& rows) {
  size_t n_judged = 0, n_within = 0, n_not_comparable = 0, n_missing = 0;
  for (const PaperRow& row : rows) {
    const std::string verdict = row.verdict();
    n_judged += verdict == "within" || verdict == "outside";
    n_within += verdict == "within";
    n_not_comparable += verdict == "not comparable";
    n_missing += row.is_missing();
  }
  std::string text =
      n_judged == 0 ? "no published value compared"
                    : fmt::format("{} of {} comparisons: the published value lies where our single runs do",
                                  n_within, n_judged);
  if (n_not_comparable > 0) text += fmt::format("; {} not comparable", n_not_comparable);
  if (n_missing > 0) text += fmt::format("; {} not measured here", n_missing);
  return text;
}

}  // namespace sextant
