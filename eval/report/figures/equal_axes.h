#pragma once

// Axes of a panel with the same scale in both directions, whatever the shape of the panel, and a margin of 8
// % around the data.

#include <Eigen/Core>
#include <limits>
#include <string>

namespace sextant {

/// Titles of the axes, with units.
struct AxisTitles {
  std::string right = "x, right [m]", ahead = "z, ahead [m]";
};

/// "Ahead" points upwards or, if `lying`, to the right. Then the right-hand side points downwards, because a
/// view from above must not be mirrored.
class EqualAxes {
 public:
  /// `least_m`: the smallest extent that fills a panel, a power of ten; the axes of a point show this much.
  explicit EqualAxes(AxisTitles titles = {}, double least_m = 1)
      : titles_(std::move(titles)), least_m_(least_m) {}

  void include(const Eigen::Vector2d& right_ahead_m);
  bool longer_than_wide() const { return high_.y() - low_.y() > high_.x() - low_.x(); }

  /// Height that a panel of this width needs, at most `most_cm`.
  double height_cm(double width_cm, bool lying, double most_cm = 7) const;

  /// gnuplot commands for ranges, tics and titles.
  std::string settings(double width_cm, double height_cm, bool lying) const;

  /// gnuplot commands for a scale bar of a round length with its number, in the lower right corner; not for
  /// lying axes.
  std::string scale_bar(double width_cm, double height_cm) const;

  /// Metres that a centimetre of a panel of this size shows; not lying.
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
  /// A round number of metres that is at least 1 cm on paper.
  double step_m(double m_per_cm) const;

  AxisTitles titles_;
  double least_m_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high_ = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
};

}  // namespace sextant
