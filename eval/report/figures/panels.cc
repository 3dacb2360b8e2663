#include "sextant/eval/report/figures/panels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/report/paper.h"

namespace sextant {

namespace {

constexpr double legend_line_cm = 0.42;
constexpr double legend_sample_cm = 1.1;  // line or box of an entry, and the gap to the next one
constexpr double character_cm = 0.155;    // average width of DejaVu Sans at 7 pt
constexpr size_t legend_columns_max = 4;

constexpr std::array<const char*, 7> other_colours = {"#D55E00", "#CC79A7", "#56B4E9", "#595959",
                                                      "#7A3E9D", "#8C564B", "#B8A000"};
constexpr size_t n_colours_of_names = 4;  // the others are for figures with more systems

const PaperEstimator* known(const std::string& estimator) {
  const auto it = std::ranges::find(paper().estimators, estimator, &PaperEstimator::name);
  return it == paper().estimators.end() ? nullptr : &*it;
}

/// Number of entries that fit side by side.
size_t legend_columns(const std::vector<LegendEntry>& legend, double width_cm) {
  size_t longest = 0;
  for (const LegendEntry& entry : legend) longest = std::max(longest, entry.title.size());
  const double entry_cm = legend_sample_cm + character_cm * static_cast<double>(longest);
  return std::clamp<size_t>(static_cast<size_t>(width_cm / entry_cm), 1,
                            std::min(legend_columns_max, legend.size()));
}

/// Edges of a plot as fractions of the figure.
std::string margins(double left, double right, double bottom, double top) {
  return fmt::format(
      "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\nset bmargin at screen {:.5f}\n"
      "set tmargin at screen {:.5f}\n",
      left, right, bottom, top);
}

std::string legend_script(const std::vector<LegendEntry>& legend, size_t columns, double width_cm,
                          double bottom) {
  std::string script =
      "unset logscale\nunset border\nunset tics\nunset xlabel\nunset ylabel\nunset title\nunset label\n"
      "unset arrow\nset label 1 \"\"\n";
  script += "set xrange [0:1]\nset yrange [0:1]\n" + margins(0.02, 0.98, bottom, 1.0);
  script += fmt::format(
      "set key inside center center horizontal Left reverse maxcols {} samplen 1.6 width 0 noenhanced\nplot ",
      columns);
  const auto most = static_cast<size_t>((width_cm - 3 * legend_sample_cm) / character_cm);
  for (size_t i = 0; i < legend.size(); ++i)
    script += fmt::format("{}NaN {} title {}", i > 0 ? ", " : "", legend[i].style,
                          gp_text(shortened(legend[i].title, most)));
  return script + "\n";
}

std::string panel_script(const Panel& panel) {
  std::string script =
      "unset key\nunset label\nunset arrow\nunset logscale\nset autoscale\nset border 3\nset xtics nomirror "
      "autofreq\nset ytics nomirror autofreq\n"
      "set mxtics default\nset mytics default\nset format \"%g\"\nunset xlabel\nunset ylabel\n";
  script += fmt::format("set title {} noenhanced offset 0,-0.7\n", gp_text(panel.title)) + panel.settings +
            "plot \\\n";
  for (size_t i = 0; i < panel.plots.size(); ++i)
    script += fmt::format("  {} notitle{}\n", panel.plots[i], i + 1 < panel.plots.size() ? ", \\" : "");
  return script;
}

}  // namespace

void set_panels(const PanelLayout& layout, const std::vector<LegendEntry>& legend,
                const std::vector<Panel>& panels, Figure& figure) {
  SEXTANT_CHECK(!panels.empty() && layout.columns > 0);
  const size_t n_rows = (panels.size() + layout.columns - 1) / layout.columns;
  const size_t columns = legend.empty() ? 1 : legend_columns(legend, layout.width_cm);
  const size_t legend_rows = (legend.size() + columns - 1) / columns;
  const double legend_cm = legend.empty() ? 0 : 0.15 + legend_line_cm * static_cast<double>(legend_rows);
  figure.width_cm = layout.width_cm;
  figure.height_cm = legend_cm + layout.panel_height_cm * static_cast<double>(n_rows);

  const double panel_width_cm = layout.width_cm / static_cast<double>(layout.columns);
  std::string script = "set multiplot\n";
  if (!legend.empty())
    script += legend_script(legend, columns, layout.width_cm, 1 - legend_cm / figure.height_cm);
  for (size_t i = 0; i < panels.size(); ++i) {
    const double left_cm = panel_width_cm * static_cast<double>(i % layout.columns) + layout.left_cm;
    const double row = static_cast<double>(i / layout.columns);
    const double top_cm = figure.height_cm - legend_cm - row * layout.panel_height_cm - layout.top_cm;
    script += margins(left_cm / figure.width_cm, (left_cm + layout.plot_width_cm()) / figure.width_cm,
                      (top_cm - layout.plot_height_cm()) / figure.height_cm, top_cm / figure.height_cm);
    script += panel_script(panels[i]);
  }
  figure.script = script + "unset multiplot\n";
}

std::string only_where(const std::vector<std::pair<std::string, std::string>>& conditions,
                       const std::string& expression) {
  std::string test;
  for (const auto& [column, value] : conditions) {
    test +=
        fmt::format("{}strcol(\"{}\") eq {}", test.empty() ? "" : " && ", column, gp_text(gp_cell(value)));
  }
  return fmt::format("({} ? {} : NaN)", test, expression);
}

std::string estimator_colour(const std::string& estimator) {
  if (const PaperEstimator* style = known(estimator)) return style->colour;
  size_t sum = 0;
  for (const char c : estimator) sum += static_cast<unsigned char>(c);
  return other_colours[sum % n_colours_of_names];
}

std::string distinct_colour(const std::string& estimator, const std::vector<std::string>& shown) {
  std::set<std::string> taken;
  for (const std::string& name : shown) {
    std::string colour = estimator_colour(name);
    if (known(name) == nullptr && taken.contains(colour)) {
      const auto free =
          std::ranges::find_if(other_colours, [&](const char* c) { return !taken.contains(c); });
      if (free != other_colours.end()) colour = *free;
    }
    if (name == estimator) return colour;
    taken.insert(colour);
  }
  return estimator_colour(estimator);
}

int estimator_point(const std::string& estimator) {
  const PaperEstimator* style = known(estimator);
  return style != nullptr ? style->point : 13;
}

std::string estimator_style(const std::string& estimator) {
  return estimator_style(estimator, estimator_colour(estimator));
}

std::string estimator_style(const std::string& estimator, const std::string& colour) {
  return fmt::format("with linespoints lc rgb \"{}\" lw 1.5 pt {} ps 0.5", colour,
                     estimator_point(estimator));
}

std::string interval_plot(const std::string& x, const std::string& low, const std::string& high,
                          const std::string& colour, double width) {
  return fmt::format(
      "data using {0}:(column(\"{1}\")):(0):(column(\"{2}\")-column(\"{1}\")) with vectors nohead lc rgb "
      "\"{3}\" lw {4}",
      x, low, high, colour, width);
}

std::string estimator_title(const std::string& estimator) {
  const PaperEstimator* style = known(estimator);
  return style != nullptr ? style->title : estimator;
}

std::vector<std::string> in_order(std::vector<std::string> estimators) {
  const auto place = [](const std::string& name) {
    const PaperEstimator* style = known(name);
    const auto& all = paper().estimators;
    return style != nullptr ? static_cast<size_t>(style - all.data()) : all.size();
  };
  std::ranges::stable_sort(estimators, {}, place);
  return estimators;
}

std::string shortened(const std::string& name, size_t most) {
  if (name.size() <= most) return name;
  const auto is_inside = [&](size_t at) { return (static_cast<unsigned char>(name[at]) & 0xC0U) == 0x80U; };
  size_t head = most / 2, tail = name.size() - (most - most / 2 - 1);
  while (head > 0 && is_inside(head)) --head;
  while (tail < name.size() && is_inside(tail)) ++tail;
  return name.substr(0, head) + "…" + name.substr(tail);
}

double tic_step(double range, double n) {
  const double decade = std::pow(10, std::floor(std::log10(range / n)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * decade >= range / n) return digit * decade;
  }
  return 10 * decade;
}

std::string gp_number(double value) { return fmt::format("{:.6g}", value); }

void EqualAxes::include(const Eigen::Vector2d& right_ahead_m) {
  low_ = low_.cwiseMin(right_ahead_m);
  high_ = high_.cwiseMax(right_ahead_m);
}

double EqualAxes::height_cm(double width_cm, bool lying, double most_cm) const {
  const Eigen::Vector2d size = room();
  return std::clamp(width_cm * (lying ? size.x() / size.y() : size.y() / size.x()), 2.4, most_cm);
}

EqualAxes::Ranges EqualAxes::ranges(double width_cm, double height_cm, bool lying) const {
  const Eigen::Vector2d paper =
      lying ? Eigen::Vector2d(height_cm, width_cm) : Eigen::Vector2d(width_cm, height_cm);
  const double m_per_cm = room().cwiseQuotient(paper).maxCoeff();
  return {(low_ + high_ - paper * m_per_cm) / 2, (low_ + high_ + paper * m_per_cm) / 2, m_per_cm};
}

std::string EqualAxes::settings(double width_cm, double height_cm, bool lying) const {
  const auto [low, high, m_per_cm] = ranges(width_cm, height_cm, lying);
  const auto range = [](double from, double to) {
    return fmt::format("[{}:{}]", gp_number(from), gp_number(to));
  };
  const std::string right = range(lying ? high.x() : low.x(), lying ? low.x() : high.x());
  const std::string ahead = range(low.y(), high.y());
  const std::string step = gp_number(step_m(m_per_cm));
  return fmt::format(
      "set xrange {}\nset yrange {}\nset xtics {}\nset ytics {}\nset {} \"{}\"\nset {} \"{}\"\n"
      "set xlabel offset 0,0.4\n",
      lying ? ahead : right, lying ? right : ahead, step, step, lying ? "ylabel" : "xlabel", titles_.right,
      lying ? "xlabel" : "ylabel", titles_.ahead);
}

std::string EqualAxes::scale_bar(double width_cm, double height_cm) const {
  const auto [low, high, m_per_cm] = ranges(width_cm, height_cm, false);
  const double length_m = step_m(m_per_cm);
  const double right = high.x() - 0.3 * m_per_cm, y = low.y() + 0.3 * m_per_cm;
  const std::string text = length_m < 1000 ? gp_number(length_m) + " m" : gp_number(length_m / 1000) + " km";
  return fmt::format(
      "set arrow from {0},{2} to {1},{2} nohead lw 3 lc rgb \"#404040\" front\n"
      "set label \"{3}\" at {1},{2} right offset 0,0.6 textcolor rgb \"#404040\" front\n",
      gp_number(right - length_m), gp_number(right), gp_number(y), text);
}

double EqualAxes::step_m(double m_per_cm) const { return std::max(least_m_, tic_step(m_per_cm, 1)); }

}  // namespace sextant
