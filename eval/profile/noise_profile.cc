#include "sextant/eval/profile/noise_profile.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "sextant/base/files.h"
#include "sextant/base/machine.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/figures/panels.h"

namespace sextant {
namespace {

double rounded(double value) { return std::stod(fmt::format("{:.4g}", value)); }

std::vector<double> rounded(std::vector<double> values) {
  for (double& v : values) v = rounded(v);
  return values;
}

std::vector<int> frames_of(const SequenceInfo& info, int most) {
  const int n = info.last_frame - info.first_frame + 1, taken = std::min(n, most);
  std::vector<int> frames;
  for (int i = 0; i < taken; ++i)
    frames.push_back(info.first_frame + static_cast<int>(static_cast<int64_t>(i) * n / taken));
  return frames;
}

/// Returns the correlation of noise drawn with that mixture, at the pixels of these fields.
std::vector<double> injected_correlation(const std::vector<ChannelField>& frames,
                                         const SpatialCorrelation& spatial,
                                         const std::vector<CorrelationBin>& measured) {
  if (spatial.parts.empty()) return std::vector<double>(measured.size(), 0);
  const NoiseCorrelation correlation(spatial);
  const Draws draws(1, "profile", "injected");
  std::vector<std::vector<Image<float>>> drawn;
  for (size_t f = 0; f < frames.size(); ++f) {
    std::vector<Image<float>> axes = frames[f].error_px;
    axes.resize(1);
    std::vector<int> x, y;
    for (const auto [i, j] : pixels(axes[0])) {
      if (!std::isfinite(axes[0](i, j))) continue;
      x.push_back(i);
      y.push_back(j);
    }
    std::vector<double> first(x.size()), second(x.size());
    correlation.normals(draws, NoiseChannel::flow, {static_cast<int>(f), x, y}, first, second);
    for (size_t i = 0; i < x.size(); ++i) axes[0](x[i], y[i]) = static_cast<float>(first[i]);
    drawn.push_back(std::move(axes));
  }
  const std::vector<CorrelationBin> bins = measure_correlation(drawn);
  std::vector<double> out;
  for (const CorrelationBin& bin : measured) {
    const auto same = std::ranges::find(bins, bin.low_px, &CorrelationBin::low_px);
    out.push_back(same == bins.end() ? 0 : same->value[0]);
  }
  return out;
}

std::optional<ProfileChannel> channel_of(const std::vector<ChannelField>& frames,
                                         const std::string& reference, const std::string& name) {
  if (frames.empty()) return std::nullopt;
  return ProfileChannel{reference, channel_errors(frames, name), {}};
}

Json json_of(const SpatialCorrelation& spatial) {
  if (spatial.parts.empty()) return "independent";
  Json json = {{"model", "spatial"}, {"lengths_px", Json::array()}, {"shares", Json::array()}};
  for (const SpatialCorrelation::Part& part : spatial.parts) {
    json["lengths_px"].push_back(part.length_px);
    json["shares"].push_back(part.share);
  }
  return json;
}

Json json_of(const ProfileChannel& channel) {
  const ChannelErrors& e = channel.errors;
  Json json = {{"reference", channel.reference},
               {"n_frames", e.n_frames},
               {"n", e.n},
               {"offset_px", rounded(e.offset_px)},
               {"sigma_px", rounded(e.sigma_px)},
               {"mean_abs_px", rounded(e.mean_abs_px)},
               {"mean_px", rounded(e.mean_px)},
               {"tail_share", rounded(e.tail_share)},
               {"tail_radius_px", rounded(e.tail_radius_px)},
               {"spatial", json_of(e.spatial)},
               {"correlation", Json::array()},
               {"dependence", Json::array()}};
  for (size_t b = 0; b < e.correlation.size(); ++b) {
    const CorrelationBin& bin = e.correlation[b];
    Json intervals = Json::array();
    for (const auto& interval : bin.interval)
      intervals.push_back(interval ? Json({rounded(interval->low), rounded(interval->high)}) : Json());
    json["correlation"].push_back({{"low_px", bin.low_px},
                                   {"high_px", bin.high_px},
                                   {"distance_px", rounded(bin.distance_px)},
                                   {"n", bin.n},
                                   {"value", rounded(bin.value)},
                                   {"interval", intervals},
                                   {"injected", rounded(channel.injected[b])}});
  }
  for (const Dependence& line : e.dependence) {
    json["dependence"].push_back({{"on", line.on},
                                  {"low", line.low},
                                  {"high", line.high},
                                  {"n", line.n},
                                  {"sigma_px", rounded(line.sigma_px)},
                                  {"tail_share", rounded(line.tail_share)}});
  }
  return json;
}

/// Returns one hash of all inputs, since their paths are specific to a machine.
std::string inputs_sha256(const Sequence& sequence) {
  std::string all;
  for (const auto& [path, entry] : sequence.inputs().entries()) all += entry.sha256 + "\n";
  return sha256(all);
}

/// Returns the lines with paths relative to `root`.
std::vector<std::string> below(const std::string& root, std::vector<std::string> lines) {
  if (root.empty()) return lines;
  const std::string folder = (std::filesystem::path(root) / "").string();
  for (std::string& line : lines) {
    if (const size_t at = line.find(folder); at != std::string::npos) line.erase(at, folder.size());
  }
  return lines;
}

}  // namespace

Json NoiseProfile::noise() const {
  Json json = Json::object();
  if (flow) {
    const ChannelErrors& e = flow->errors;
    json["flow"] = {{"epe_x_px", rounded(e.sigma_px[0])}, {"epe_y_px", rounded(e.sigma_px[1])}};
    if (e.tail_share > 0)
      json["outliers"] = {{"share", rounded(e.tail_share)}, {"radius_px", rounded(e.tail_radius_px)}};
  }
  if (disparity) json["depth"] = {{"delta_d_px", rounded(disparity->errors.sigma_px[0])}, {"baseline_m", 0}};
  json["correlation"] = json_of(injected_correlation());
  return json;
}

const SpatialCorrelation& NoiseProfile::injected_correlation() const {
  return (flow ? *flow : *disparity).errors.spatial;
}

std::vector<std::string> NoiseProfile::warnings() const {
  // The standard deviation of a Laplace distribution is 1.38 times its 1.4826 MAD.
  constexpr double least_ratio = 1.5, most_tails = 0.5;
  constexpr double least_px = 0.01;  // smaller errors are rounding
  std::vector<std::string> warnings;
  const auto add = [&](const char* of_channel, const std::optional<ProfileChannel>& channel) {
    if (!channel) return;
    const ChannelErrors& e = channel->errors;
    for (size_t a = 0; a < e.sigma_px.size(); ++a) {
      if (e.sigma_px[a] <= std::max(least_px, least_ratio * e.robust_sigma_px[a])) continue;
      warnings.push_back(fmt::format(
          "{}: sigma is {:.3g} px, but half of the errors in the core are as small as with {:.3g} px: tails "
          "overlap the core, so that injected noise has too many errors of medium size and too few large "
          "ones",
          of_channel, e.sigma_px[a], e.robust_sigma_px[a]));
      break;
    }
    if (e.tail_share > most_tails)
      warnings.push_back(fmt::format(
          "{}: {:.0f} % of the errors are tails: the core of {:.3g} px describes the fewest of them",
          of_channel, 100 * e.tail_share, e.sigma_px[0]));
  };
  add("flow", flow);
  add("disparity", disparity);
  return warnings;
}

Json NoiseProfile::json() const {
  Json out = {{"schema", 1}, {"name", name}};
  out.update(provenance);
  out["noise"] = noise();
  if (flow) out["flow"] = json_of(*flow);
  if (disparity) out["disparity"] = json_of(*disparity);
  return out;
}

NoiseProfile fit_noise_profile(const Sequence& sequence, const std::string& source,
                               const ProfileOptions& options) {
  const ErrorSource errors(sequence, options.noise, options.seed, options.depth);
  const std::vector<int> frames = frames_of(sequence.info(), options.max_frames);
  std::vector<std::optional<ErrorFields>> fields(frames.size());
  parallel_for(static_cast<int>(frames.size()), options.jobs,
               [&](int i) { fields[static_cast<size_t>(i)] = errors.read(frames[static_cast<size_t>(i)]); });
  std::vector<ChannelField> flow, disparity;
  for (const std::optional<ErrorFields>& field : fields) {
    if (!field) continue;
    if (!field->flow_px.empty()) flow.push_back({field->flow_px, field->properties});
    if (!field->disparity_px.empty()) disparity.push_back({field->disparity_px, field->properties});
  }
  NoiseProfile profile;
  profile.name = options.name;
  profile.flow = channel_of(flow, std::string(to_string(errors.flow_reference())), "flow");
  profile.disparity = channel_of(disparity, std::string(to_string(errors.depth_reference())), "disparity");
  if (!profile.flow && !profile.disparity)
    fail(
        "{}: the errors of flow and depth cannot be measured in any frame: expected flow and depth on a "
        "background of 50 corners or more, or a data set with dense ground truth",
        source);
  const auto draw_injected = [&](const std::vector<ChannelField>& measured, ProfileChannel& channel) {
    channel.injected =
        injected_correlation(measured, profile.injected_correlation(), channel.errors.correlation);
  };
  if (profile.flow) draw_injected(flow, *profile.flow);
  if (profile.disparity) draw_injected(disparity, *profile.disparity);
  profile.provenance = {{"source", source},
                        {"noise_added", options.noise.options()},
                        {"channels", below(options.data_root, sequence.info().provenance)},
                        {"inputs_sha256", inputs_sha256(sequence)},
                        {"program", program_identity()}};
  return profile;
}

Table profile_table(const NoiseProfile& profile) {
  Table table{"Noise profile " + profile.name,
              "Core of the errors, its tails beyond 4 sigma, and the mixture that fits its correlation.",
              {{"channel", "channel", Align::left},
               {"reference", "reference", Align::left},
               {"n", "pixels", Align::right, 0},
               {"offset_px", "offset [px]", Align::left},
               {"sigma_px", "sigma [px]", Align::left},
               {"tail_percent", "tails [%]", Align::right, 2},
               {"tail_radius_px", "radius [px]", Align::right, 1},
               {"spatial", "correlation: share at length [px]", Align::left}}};
  const auto join = [](const std::vector<double>& values) {
    return fmt::format("{:.3f}", fmt::join(values, " / "));
  };
  const auto add = [&](const char* name, const std::optional<ProfileChannel>& channel) {
    if (!channel) return;
    const ChannelErrors& e = channel->errors;
    std::string parts;
    for (const auto& part : e.spatial.parts)
      parts += fmt::format("{}{:.2f} at {:.0f}", parts.empty() ? "" : ", ", part.share, part.length_px);
    table.add_row({name, channel->reference, static_cast<double>(e.n), join(e.offset_px), join(e.sigma_px),
                   100 * e.tail_share, e.tail_radius_px, parts.empty() ? std::string("none") : parts});
  };
  add("flow", profile.flow);
  add("disparity", profile.disparity);
  return table;
}

namespace {

struct Axis {
  const char* title;
  const char* label;  ///< for the legend, which has one line
  const char* colour;
  int point;
};
constexpr Axis flow_axes[] = {{"measured, u", "flow u", "#0072B2", 7},
                              {"measured, v", "flow v", "#D55E00", 5}};
constexpr Axis disparity_axes[] = {{"measured, disparity", "disparity", "#009E73", 9}};

std::string points_of(const Axis& axis) {
  return fmt::format("with points lc rgb \"{}\" pt {} ps 0.5", axis.colour, axis.point);
}
constexpr const char* injected_style = "with linespoints lc rgb \"#000000\" lw 1.2 pt 6 ps 0.35";

Panel panel_of(const std::string& name, const ProfileChannel& channel, std::span<const Axis> axes,
               Table& data) {
  const std::vector<CorrelationBin>& bins = channel.errors.correlation;
  for (size_t b = 0; b < bins.size(); ++b) {
    for (size_t a = 0; a < axes.size(); ++a) {
      const auto& interval = bins[b].interval[a];
      data.add_row({name, axes[a].title, bins[b].distance_px, bins[b].value[a],
                    interval ? Cell(interval->low) : Cell(), interval ? Cell(interval->high) : Cell()});
    }
  }
  for (size_t b = 0; b < bins.size(); ++b)  // consecutively, so that a line joins them
    data.add_row({name, "injected", bins[b].distance_px, channel.injected[b], Cell(), Cell()});
  Panel panel{name + " against " + channel.reference, "", {}};
  panel.settings =
      "set logscale x\nset xrange [0.9:600]\nset yrange [-0.2:1.02]\nset xlabel \"distance [px]\" offset "
      "0,0.4\n"
      "set ylabel \"correlation\"\nset arrow from graph 0,first 0 to graph 1,first 0 nohead lc rgb "
      "\"#888888\" lw 0.5\n";
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
  const auto add = [&](const char* name, const std::optional<ProfileChannel>& channel,
                       std::span<const Axis> axes) {
    if (!channel) return;
    panels.push_back(panel_of(name, *channel, axes, figure.data));
    for (const Axis& axis : axes) legend.push_back({axis.label, points_of(axis)});
  };
  add("flow", profile.flow, flow_axes);
  add("disparity", profile.disparity, disparity_axes);
  legend.push_back({"injected", injected_style});
  const PanelLayout layout{.columns = panels.size(),
                           .width_cm = panels.size() == 1 ? 8.8 : 18.0,
                           .panel_height_cm = 6.0,
                           .left_cm = 1.8};
  set_panels(layout, legend, panels, figure);
  figure.caption = fmt::format(
      "Correlation of errors at two pixels by their distance: as measured, with 95 % intervals over frames, "
      "and of noise "
      "drawn with the profile {}.",
      profile.name);
  return figure;
}

NoiseProfile write_noise_profile(const SourceSpec& source, ProfileOptions options,
                                 const std::filesystem::path& out, const std::string& figure) {
  const auto lock = lock_folder(figure);
  const std::unique_ptr<Sequence> sequence = open_source(source);
  if (options.name.empty()) options.name = out.stem().string();
  NoiseProfile profile = fit_noise_profile(*sequence, source.text, options);
  write_file(out, json_text(profile.json()));
  if (!figure.empty()) write_output_folder(figure, draw(profile_figure(profile)));
  return profile;
}

}  // namespace sextant
