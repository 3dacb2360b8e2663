#include "sextant/eval/report/figures/equal_axes.h"

#include <algorithm>

#include "sextant/eval/report/figures/panels.h"

namespace sextant {

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

double EqualAxes::step_m(double m_per_cm) const {
  double decade = least_m_;
  while (10 * decade < m_per_cm) decade *= 10;
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * decade >= m_per_cm) return digit * decade;
  }
  return 10 * decade;
}

}  // namespace sextant
