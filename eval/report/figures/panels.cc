#include "sextant/eval/report/figures/panels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/report/paper.h"
#include "sextant/eval/report/table.h"

namespace sextant {

namespace {

constexpr double legend_line_cm = 0.42;
constexpr double legend_sample_cm = 1.1;  // line or box of an entry, and the gap to the next one
constexpr double character_cm = 0.155;    // average width of DejaVu Sans at 7 pt
constexpr size_t legend_columns_max = 4;

constexpr std::array<const char*, 7> other_colours = {"#D55E00", "#CC79A7", "#56B4E9", "#595959",
                                                      "#7A3E9D", "#8C564B", "#B8A000"};
constexpr size_t n_colours_of_names = 4;  // the others are for figures with more systems
constexpr std::array<int, 7> other_points = {13, 11, 5, 9, 7, 15, 3};

const PaperEstimator* known(const std::string& estimator) {
  const auto it = std::ranges::find(paper().estimators, estimator, &PaperEstimator::name);
  return it == paper().estimators.end() ? nullptr : &*it;
}

/// Number of entries that fit side by side.
size_t legend_columns(const std::vector<LegendEntry>& legend, double width_cm) {
  size_t longest = 0;
  for (const LegendEntry& entry : legend) longest = std::max(longest, width_of(entry.title));
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
  std::vector<std::string> titles;
  for (const LegendEntry& entry : legend) titles.push_back(entry.title);
  titles = shortened(titles, most);
  for (size_t i = 0; i < legend.size(); ++i)
    script += fmt::format("{}NaN {} title {}", i > 0 ? ", " : "", legend[i].style, gp_text(titles[i]));
  return script + "\n";
}

std::string panel_script(const Panel& panel, const std::string& title) {
  std::string script =
      "unset key\nunset label\nunset arrow\nunset logscale\nset autoscale\nset border 3\nset xtics nomirror "
      "autofreq\nset ytics nomirror autofreq\n"
      "set mxtics default\nset mytics default\nset format \"%g\"\nunset xlabel\nunset ylabel\n";
  script +=
      fmt::format("set title {} noenhanced offset 0,-0.7\n", gp_text(title)) + panel.settings + "plot \\\n";
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
  std::vector<std::string> titles;
  for (const Panel& panel : panels) titles.push_back(panel.title);
  // A title is centred above its plot and may extend over the margin of the same width on both sides.
  const double title_cm = layout.plot_width_cm() + 2 * std::min(layout.left_cm, layout.right_cm);
  titles = shortened(titles, static_cast<size_t>(std::max(title_cm, 0.6 * panel_width_cm) / character_cm));
  std::string script = "set multiplot\n";
  if (!legend.empty())
    script += legend_script(legend, columns, layout.width_cm, 1 - legend_cm / figure.height_cm);
  for (size_t i = 0; i < panels.size(); ++i) {
    const double left_cm = panel_width_cm * static_cast<double>(i % layout.columns) + layout.left_cm;
    const double row = static_cast<double>(i / layout.columns);
    const double top_cm = figure.height_cm - legend_cm - row * layout.panel_height_cm - layout.top_cm;
    script += margins(left_cm / figure.width_cm, (left_cm + layout.plot_width_cm()) / figure.width_cm,
                      (top_cm - layout.plot_height_cm()) / figure.height_cm, top_cm / figure.height_cm);
    script += panel_script(panels[i], titles[i]);
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

SystemStyles::SystemStyles(const std::vector<std::string>& systems) {
  std::set<std::pair<size_t, size_t>> taken;  // number of a colour, and how often it was used before
  for (const std::string& name : systems) {
    if (styles_.contains(name)) continue;
    if (const PaperEstimator* style = known(name)) {
      styles_[name] = {style->colour, style->point, 1};
      continue;
    }
    const std::string usual = estimator_colour(name);
    size_t colour = 0;
    while (other_colours[colour] != usual) ++colour;
    if (taken.size() == other_colours.size() * other_points.size()) taken.clear();
    const size_t round = taken.size() / other_colours.size();
    while (taken.contains({colour, round})) colour = (colour + 1) % other_colours.size();
    taken.insert({colour, round});
    styles_[name] = {other_colours[colour], other_points[(colour + round) % other_points.size()],
                     static_cast<int>(round % 5) + 1};
  }
}

const SystemStyles::Style& SystemStyles::of(const std::string& system) const {
  const auto style = styles_.find(system);
  SEXTANT_CHECK(style != styles_.end());
  return style->second;
}

std::string SystemStyles::line(const std::string& system) const {
  return fmt::format("with linespoints lc rgb \"{}\" lw 1.5 pt {} ps 0.5", colour(system), point(system));
}

std::vector<std::string> sorted_systems(std::vector<std::string> names) {
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

int estimator_point(const std::string& estimator) {
  const PaperEstimator* style = known(estimator);
  return style != nullptr ? style->point : 13;
}

std::string estimator_style(const std::string& estimator) {
  return fmt::format("with linespoints lc rgb \"{}\" lw 1.5 pt {} ps 0.5", estimator_colour(estimator),
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

namespace {

size_t n_different(const std::vector<std::string>& texts) {
  return std::set<std::string>(texts.begin(), texts.end()).size();
}

/// Replaces what all names have in common at their beginning and at their end by ellipses, except for a few
/// characters beside the part in which they differ.
std::vector<std::string> without_common_parts(const std::vector<std::string>& names) {
  constexpr size_t kept = 6;
  size_t head = names.front().size(), tail = head;
  for (const std::string& name : names) {
    const auto ends = std::ranges::mismatch(name, names.front());
    head = std::min(head, static_cast<size_t>(ends.in1 - name.begin()));
    const auto begins =
        std::mismatch(name.rbegin(), name.rend(), names.front().rbegin(), names.front().rend());
    tail = std::min(tail, static_cast<size_t>(begins.first - name.rbegin()));
  }
  std::vector<std::string> cut;
  for (const std::string& name : names) {
    const auto is_inside = [&](size_t at) {
      return at < name.size() && (static_cast<unsigned char>(name[at]) & 0xC0U) == 0x80U;
    };
    size_t from = head > kept + 1 ? head - kept : 0;
    while (from > 0 && is_inside(from)) --from;
    size_t to = tail > kept + 1 ? name.size() - (tail - kept) : name.size();
    to = std::max(to, std::min(head, name.size()));
    while (is_inside(to)) ++to;
    cut.push_back((from > 0 ? "…" : "") + name.substr(from, to - from) + (to < name.size() ? "…" : ""));
  }
  return cut;
}

}  // namespace

std::vector<std::string> shortened(const std::vector<std::string>& names, size_t most) {
  if (names.empty()) return names;
  const auto each = [&](const std::vector<std::string>& texts, size_t length) {
    std::vector<std::string> out;
    for (const std::string& text : texts) out.push_back(shortened(text, length));
    return out;
  };
  std::vector<std::string> shown = each(names, most);
  if (n_different(shown) == n_different(names)) return shown;
  shown = each(without_common_parts(names), most);
  if (n_different(shown) == n_different(names)) return shown;
  shown = each(names, most > 12 ? most - 6 : most);
  std::vector<std::string> seen;
  for (size_t i = 0; i < names.size(); ++i) {
    auto place = std::ranges::find(seen, names[i]);
    if (place == seen.end()) place = seen.insert(seen.end(), names[i]);
    shown[i] += fmt::format(" ({})", place - seen.begin() + 1);
  }
  return shown;
}

double tic_step(double range, double n) {
  const double decade = std::pow(10, std::floor(std::log10(range / n)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * decade >= range / n) return digit * decade;
  }
  return 10 * decade;
}

Tics tics_between(double low, double high, double n) {
  Tics tics{tic_step(high - low, n), 0};
  for (double k = std::floor(low / tics.step); k <= std::ceil(high / tics.step); ++k)
    tics.n_characters = std::max(tics.n_characters, gp_number(k * tics.step).size());
  return tics;
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
