#include "sextant/eval/reproduce/figures.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figures/panels.h"

namespace sextant {
namespace {

constexpr const char* code_procedure = ", release";
constexpr size_t most_lines = 26;
constexpr double lowest = 0.02, highest = 50;  // of the axis: what is beyond is drawn at its end

using Row = std::vector<Cell>;

/// A row of the table by its keys.
class Reader {
 public:
  explicit Reader(const Table& table) : table_(table) {}

  bool has(const std::string& key) const { return table_.find_column(key).has_value(); }
  std::string text(const Row& row, const std::string& key) const {
    const auto* text = said<std::string>(row, key);
    return text == nullptr ? "" : *text;
  }
  std::optional<double> number(const Row& row, const std::string& key) const {
    const auto* number = said<double>(row, key);
    return number == nullptr ? std::nullopt : std::optional(*number);
  }
  /// Who estimated: the column is called so, or "system".
  std::string estimator(const Row& row) const { return text(row, has("estimator") ? "estimator" : "system"); }

 private:
  template <typename T>
  const T* said(const Row& row, const std::string& key) const {
    const auto place = table_.find_column(key);
    return place ? std::get_if<T>(&row[*place]) : nullptr;
  }

  const Table& table_;
};

struct Mark {
  const Row* row = nullptr;
  std::string noise;
};
struct Line {
  std::string label;
  Mark ours, code;
};

/// "S18-F124-134 Obj1 joint E_t [m]".
std::string label_of(const Reader& reader, const Table& table, const Row& row) {
  std::string label;
  const auto quantity = table.find_column("quantity");
  const size_t n = quantity ? *quantity + 1 : table.columns.size();
  for (size_t j = 0; j < n; ++j) {
    const std::string& key = table.columns[j].key;
    if (key == "noise") continue;
    std::string word = reader.text(row, key);
    if (key == "estimator" || key == "system") word = estimator_title(word.substr(0, word.find(',')));
    if (!word.empty()) label += (label.empty() ? "" : " ") + word;
  }
  return label;
}

std::vector<Line> lines_of(const Table& table) {
  const Reader reader(table);
  std::vector<Line> lines;
  for (const Row& row : table.rows) {
    const auto published = reader.number(row, "published"), reproduced = reader.number(row, "reproduced");
    if (!published || !reproduced || *published <= 0 || *reproduced <= 0) continue;
    const std::string estimator = reader.estimator(row), noise = reader.text(row, "noise");
    const bool is_code = estimator.ends_with(code_procedure);
    if (!is_code && estimator.find(',') != std::string::npos) continue;  // another procedure
    const std::string label = label_of(reader, table, row);
    auto line = std::ranges::find(lines, label, &Line::label);
    if (line == lines.end()) line = lines.insert(lines.end(), {label, {}, {}});
    Mark& mark = is_code ? line->code : line->ours;
    if (mark.row == nullptr || mark.noise == noise) mark = {&row, noise};
  }
  return lines;
}

}  // namespace

std::optional<Figure> answer_figure(const std::string& name, const Table& table) {
  const Reader reader(table);
  if (!reader.has("published") || !reader.has("reproduced") || !reader.has("quantity")) return std::nullopt;
  std::vector<Line> lines = lines_of(table);
  if (lines.empty()) return std::nullopt;
  const size_t n_all = lines.size();
  lines.resize(std::min(n_all, most_lines));

  Figure figure;
  figure.name = "answer_" + name;
  figure.data.columns = {Column::text("line"),
                         Column::text("series"),
                         Column::text("tone"),
                         {"y", ""},
                         {"x", ""},
                         {"low", ""},
                         {"high", ""},
                         {"run_low", ""},
                         {"run_high", ""},
                         Column::text("verdict")};
  std::string tics, words;
  size_t longest = 0;
  double from = 0.5, to = 2;
  std::set<std::pair<std::string, std::string>> drawn;  // series and colour
  const bool has_code = std::ranges::any_of(lines, [](const Line& line) { return line.code.row != nullptr; });
  for (size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    tics += fmt::format("{}{} {}", i > 0 ? ", " : "", gp_tic(line.label), i);
    longest = std::max(longest, line.label.size());
    for (const auto& [series, mark, offset] : {std::tuple("ours", line.ours, has_code ? -0.2 : 0.0),
                                               std::tuple("published code", line.code, 0.2)}) {
      if (mark.row == nullptr) continue;
      const double published = *reader.number(*mark.row, "published");
      const auto ratio = [&](const char* key) -> Cell {
        const auto value = reader.number(*mark.row, key);
        if (!value) return {};
        const double r = std::clamp(*value / published, lowest, highest);
        from = std::min(from, r), to = std::max(to, r);
        return r;
      };
      const double y = static_cast<double>(i) + offset;
      const std::string verdict = reader.text(*mark.row, "verdict");
      const Tone tone = tone_of(verdict);
      const std::string colour = tone == Tone::agrees    ? "#009E73"
                                 : tone == Tone::differs ? "#D55E00"
                                                         : "#7F7F7F";
      figure.data.add_row({line.label, series, colour, y, ratio("reproduced"), ratio("low"), ratio("high"),
                           ratio("run_low"), ratio("run_high"), verdict});
      words += fmt::format("{}{} {}", words.empty() ? "" : ", ", gp_tic(verdict), gp_number(y));
      drawn.insert({series, colour});
    }
  }
  Panel panel;
  panel.settings = fmt::format(
      "set logscale x\nset xrange [{}:{}]\nset yrange [{}:-0.7]\nset ytics ({}) noenhanced\nset y2range [{}:-0.7]\n"
      "set y2tics ({}) noenhanced scale 0\nset xtics (0.02,0.05,0.1,0.2,0.5,1,2,5,10,20,50)\nset xlabel \"measured / published\" "
      "offset 0,0.4\nset arrow 1 from 1, graph 0 to 1, graph 1 nohead lc rgb \"#000000\" lw 1\n",
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
      "{}: published value (1), our mean with its 95 % interval (thin) and where 95 % of single runs lie (broad).{}",
      table.title,
      n_all > lines.size() ? fmt::format(" {} of {} values; the table has all.", lines.size(), n_all) : "");
  return figure;
}

std::string answer_text(const Table& table) {
  const Reader reader(table);
  size_t n_judged = 0, n_within = 0, n_missing = 0;
  for (const Row& row : table.rows) {
    const std::string verdict = reader.text(row, "verdict");
    n_judged += verdict == "within" || verdict == "outside";
    n_within += verdict == "within";
    n_missing += verdict == "not measured here" && reader.number(row, "published").has_value();
  }
  std::string text =
      n_judged == 0 ? "no published value measured"
                    : fmt::format("{} of {} comparisons: the published value lies where our single runs do",
                                  n_within, n_judged);
  if (n_missing > 0) text += fmt::format("; {} not measured here", n_missing);
  return text;
}

}  // namespace sextant
