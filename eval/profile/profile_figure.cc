#include "sextant/eval/profile/noise_profile.h"
#include "sextant/eval/report/figures/panels.h"

namespace sextant {
namespace {

struct Axis {
  const char* title;
  const char* label;  ///< in the legend, which has one line
  const char* colour;
  int point;
};
constexpr Axis flow_axes[] = {{"measured, u", "flow u", "#0072B2", 7}, {"measured, v", "flow v", "#D55E00", 5}};
constexpr Axis disparity_axes[] = {{"measured, disparity", "disparity", "#009E73", 9}};

std::string points_of(const Axis& axis) {
  return fmt::format("with points lc rgb \"{}\" pt {} ps 0.5", axis.colour, axis.point);
}
constexpr const char* injected_style = "with linespoints lc rgb \"#000000\" lw 1.2 pt 6 ps 0.35";

Panel panel_of(const std::string& name, const ProfileChannel& channel, std::span<const Axis> axes, Table& data) {
  const std::vector<CorrelationBin>& bins = channel.errors.correlation;
  for (size_t b = 0; b < bins.size(); ++b) {
    for (size_t a = 0; a < axes.size(); ++a) {
      const auto& interval = bins[b].interval[a];
      data.add_row({name, axes[a].title, bins[b].distance_px, bins[b].value[a],
                    interval ? Cell(interval->low) : Cell(), interval ? Cell(interval->high) : Cell()});
    }
  }
  for (size_t b = 0; b < bins.size(); ++b)  // together, so that a line joins them
    data.add_row({name, "injected", bins[b].distance_px, channel.injected[b], Cell(), Cell()});
  Panel panel{name + " against " + channel.reference, "", {}};
  panel.settings =
      "set logscale x\nset xrange [0.9:600]\nset yrange [-0.2:1.02]\nset xlabel \"distance [px]\" offset 0,0.4\n"
      "set ylabel \"correlation\"\nset arrow from graph 0,first 0 to graph 1,first 0 nohead lc rgb \"#888888\" lw 0.5\n";
  for (const Axis& axis : axes) {
    const std::string x = only_where({{"channel", name}, {"series", axis.title}}, "column(\"distance_px\")");
    panel.plots.push_back(interval_plot(x, "low", "high", axis.colour, 1));
    panel.plots.push_back(fmt::format("data using {}:(column(\"correlation\")) {}", x, points_of(axis)));
  }
  panel.plots.push_back(fmt::format(
      "data using {}:(column(\"correlation\")) {}",
      only_where({{"channel", name}, {"series", "injected"}}, "column(\"distance_px\")"), injected_style));
  return panel;
}

}  // namespace

Figure profile_figure(const NoiseProfile& profile) {
  Figure figure;
  figure.name = "profile_" + file_stem(profile.name);
  figure.data.columns = {{"channel", ""},     {"series", ""}, {"distance_px", ""},
                         {"correlation", ""}, {"low", ""},    {"high", ""}};
  std::vector<Panel> panels;
  std::vector<LegendEntry> legend;
  const auto add = [&](const char* name, const std::optional<ProfileChannel>& channel, std::span<const Axis> axes) {
    if (!channel) return;
    panels.push_back(panel_of(name, *channel, axes, figure.data));
    for (const Axis& axis : axes) legend.push_back({axis.label, points_of(axis)});
  };
  add("flow", profile.flow, flow_axes);
  add("disparity", profile.disparity, disparity_axes);
  legend.push_back({"injected", injected_style});
  const PanelLayout layout{.columns = panels.size(), .width_cm = panels.size() == 1 ? 8.8 : 18.0, .panel_height_cm = 6.0};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Correlation of errors at two pixels by their distance: as measured, with 95 % intervals over frames, and of noise "
      "drawn with the profile {}.",
      profile.name);
  return figure;
}

}  // namespace sextant
