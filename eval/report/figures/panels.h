#pragma once

// Several diagrams side by side in one figure, with one legend above all of them, and the common style of the
// figures of a report: an estimator has the same colour everywhere.

#include <Eigen/Core>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sextant/eval/report/figure.h"

namespace sextant {

struct LegendEntry {
  std::string title;
  std::string style;  ///< gnuplot: "with lines lc rgb ... lw 2"
};

struct Panel {
  std::string title;
  std::string settings;            ///< gnuplot commands: ranges, labels, tics
  std::vector<std::string> plots;  ///< arguments of `plot`, without titles
};

struct PanelLayout {
  size_t columns = 1;
  double width_cm = 8.8;  ///< width of the figure
  double panel_height_cm = 4.2;
  double left_cm = 1.5;  ///< space for the numbers and the label of the y axis
  double right_cm = 0.25;
  double bottom_cm = 1.0;  ///< space for the numbers and the label of the x axis
  double top_cm = 0.5;     ///< space for the title of the panel

  double plot_width_cm() const { return width_cm / static_cast<double>(columns) - left_cm - right_cm; }
  double plot_height_cm() const { return panel_height_cm - bottom_cm - top_cm; }
};

/// Sets script, width and height of the figure. Titles wider than the figure are shortened in the legend, and
/// titles of panels that are wider than the panel.
void set_panels(const PanelLayout& layout, const std::vector<LegendEntry>& legend,
                const std::vector<Panel>& panels, Figure& figure);

/// Returns a gnuplot expression with the value of `expression` in the rows whose columns have the given
/// texts, (column, text), and NaN in all other rows. For data in long format, where columns name the panel
/// and the series.
std::string only_where(const std::vector<std::pair<std::string, std::string>>& conditions,
                       const std::string& expression);

/// Returns the colour of an estimator: fixed for the estimators of this program; for all others one of the
/// remaining colours, which follows from the name. Figures of several systems take SystemStyles.
std::string estimator_colour(const std::string& estimator);
int estimator_point(const std::string& estimator);
/// Returns the gnuplot style of an estimator's lines and points, for plots and legends.
std::string estimator_style(const std::string& estimator);

/// Colours and points of the systems of a page. The estimators of this program have their fixed ones. Of the
/// others, no two have the same colour as long as there are colours, and no two have the same colour and
/// point before 49 of them. All figures of a page that are given the same systems in the same order show a
/// system in the same colour.
class SystemStyles {
 public:
  /// `systems` come first whose usual colour, estimator_colour(), is kept.
  explicit SystemStyles(const std::vector<std::string>& systems);

  std::string colour(const std::string& system) const { return of(system).colour; }
  int point(const std::string& system) const { return of(system).point; }
  /// gnuplot's dash type for lines without points: 1, or another one where a colour is used again.
  int dash(const std::string& system) const { return of(system).dash; }
  /// Style of lines and points, for plots and legends.
  std::string line(const std::string& system) const;

 private:
  struct Style {
    std::string colour;
    int point = 0, dash = 1;
  };
  const Style& of(const std::string& system) const;
  std::map<std::string, Style> styles_;
};

/// Returns the names in alphabetical order, each once: the order in which the figures of a page give its
/// systems to SystemStyles.
std::vector<std::string> sorted_systems(std::vector<std::string> names);

/// Returns the styles of the estimators of records or other rows, in the order of sorted_systems().
template <typename Row>
SystemStyles styles_of(const std::vector<Row>& rows) {
  std::set<std::string> names;
  for (const Row& row : rows) names.insert(row.estimator);
  return SystemStyles({names.begin(), names.end()});
}

/// Returns the argument of `plot` that draws the interval between two columns as a line at x. Error bars of
/// gnuplot would blank a disc around each point.
std::string interval_plot(const std::string& x, const std::string& low, const std::string& high,
                          const std::string& colour, double width);

/// Returns the short title of an estimator of this program for legends; other names are returned unchanged.
std::string estimator_title(const std::string& estimator);

/// Orders estimators as in all legends: those of this program first.
std::vector<std::string> in_order(std::vector<std::string> estimators);

/// Returns the name, with its middle replaced by an ellipsis if it has more than `most` bytes; UTF-8
/// characters are kept whole.
std::string shortened(const std::string& name, size_t most);
/// Shortens names that are shown beside each other, so that different names stay different: if their middles
/// are needed for that, the part that all have in common is left out, and if this is not enough, the names
/// are numbered.
std::vector<std::string> shortened(const std::vector<std::string>& names, size_t most);

/// Returns a distance between tics, 1, 2 or 5 times a power of ten, that divides `range` into at most `n`
/// parts.
double tic_step(double range, double n);

/// Tics of an axis: the distance between them, and the number of characters of the longest number.
struct Tics {
  double step = 0;
  size_t n_characters = 0;

  /// Returns the space that numbers of more than `n_fitting` characters need in addition.
  double more_cm(size_t n_fitting) const {
    constexpr double character_cm = 0.17;
    return n_characters > n_fitting ? character_cm * static_cast<double>(n_characters - n_fitting) : 0;
  }
};
/// Returns the tics of an axis from `low` to `high` > `low`, at most about n.
Tics tics_between(double low, double high, double n);

/// Formats a number for a gnuplot script, with 6 significant digits.
std::string gp_number(double value);

// ---- Axes of a panel with the same scale in both directions, whatever the shape of the panel, and a margin
// of 8 % around the data.

/// Titles of the axes, with units.
struct AxisTitles {
  std::string right = "x, right [m]", ahead = "z, ahead [m]";
};

/// Axes of a view from above. "Ahead" points upwards or, if `lying`, to the right; the right-hand side then
/// points downwards, because a view from above must not be mirrored.
class EqualAxes {
 public:
  /// `least_m`: smallest extent that a panel shows, even if the data are a single point; a power of ten.
  explicit EqualAxes(AxisTitles titles = {}, double least_m = 1)
      : titles_(std::move(titles)), least_m_(least_m) {}

  void include(const Eigen::Vector2d& right_ahead_m);
  bool longer_than_wide() const { return high_.y() - low_.y() > high_.x() - low_.x(); }

  /// Returns the height that a panel of this width needs, at least 2.4 cm and at most `most_cm`.
  double height_cm(double width_cm, bool lying, double most_cm = 7) const;

  /// gnuplot commands for ranges, tics and titles.
  std::string settings(double width_cm, double height_cm, bool lying) const;

  /// gnuplot commands for a scale bar of a round length with its number, in the lower right corner; not for
  /// lying axes.
  std::string scale_bar(double width_cm, double height_cm) const;

  /// Returns the metres per centimetre of a panel of this size; not for lying axes.
  double m_per_cm(double width_cm, double height_cm) const {
    return ranges(width_cm, height_cm, false).m_per_cm;
  }

 private:
  struct Ranges {
    Eigen::Vector2d low, high;
    double m_per_cm = 1;
  };
  Ranges ranges(double width_cm, double height_cm, bool lying) const;
  Eigen::Vector2d room() const { return (high_ - low_).cwiseMax(least_m_) * 1.16; }
  /// Returns a round number of metres that is at least 1 cm on paper.
  double step_m(double m_per_cm) const;

  AxisTitles titles_;
  double least_m_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high_ = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
};

}  // namespace sextant
