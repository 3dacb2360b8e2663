#include "sextant/eval/profile/channel_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sextant/base/philox.h"
#include "sextant/base/quantile.h"

namespace sextant {
namespace {

constexpr double core_sigmas = 4;
constexpr int stride_px = 3;
constexpr double mad_to_sigma = 1.4826;
constexpr std::array<double, 17> distances_px = {0.9, 1.5, 2.5, 4,   6,   9,   13,  20, 30,
                                                 45,  65,  90,  130, 180, 260, 400, 600};
constexpr int bases_per_frame = 6000;
constexpr std::array<double, 8> lengths_px = {2, 4, 8, 16, 32, 64, 128, 256};
constexpr double least_share = 0.02;

struct Steps {
  const char* property;
  std::vector<double> edges;
};
const std::array<Steps, 3> steps = {{{"flow_px", {0, 2, 5, 10, 20, 40, 80, 160}},
                                     {"depth_m", {0, 5, 10, 20, 30, 40, 60, 100}},
                                     {"border_px", {0, 2, 4, 8, 16, 32, 60}}}};

double robust_sigma(std::vector<double> values) {
  const double middle = upper_median(values);
  for (double& v : values) v = std::abs(v - middle);
  return mad_to_sigma * upper_median(values);
}

/// The shortest interval that contains a quarter of the values, which is where they are densest.
struct Densest {
  double middle = 0, sigma = 0;  ///< mean and sigma of a Gaussian whose central quarter is this interval
};
Densest densest_quarter(std::vector<double> values) {
  constexpr double half_width = 0.3186;  // half width, in sigma, of a Gaussian's central quarter
  std::ranges::sort(values);
  const size_t step = values.size() / 4;
  size_t best = 0;
  for (size_t i = 0; i + step < values.size(); ++i) {
    if (values[i + step] - values[i] < values[best + step] - values[best]) best = i;
  }
  const double low = values[best], high = values[best + step];
  return {0.5 * (low + high), 0.5 * (high - low) / half_width};
}

/// Offset and sigma by axis; membership in the core.
struct Core {
  std::vector<double> offset, sigma;

  bool holds(const std::vector<double>& error) const {
    for (size_t a = 0; a < offset.size(); ++a)
      if (!(std::abs(error[a] - offset[a]) <= core_sigmas * sigma[a])) return false;
    return true;
  }
};

using Samples = std::vector<std::vector<double>>;  // by axis

Core fit_core(const Samples& errors) {
  const size_t n_axes = errors.size(), n = errors[0].size();
  Core core;
  for (const std::vector<double>& axis : errors) {
    const Densest densest = densest_quarter(axis);
    core.offset.push_back(densest.middle);
    core.sigma.push_back(densest.sigma);
  }
  std::vector<double> error(n_axes);
  for (int iteration = 0; iteration < 20; ++iteration) {
    std::vector<double> sum(n_axes, 0), squares(n_axes, 0);
    double count = 0;
    for (size_t i = 0; i < n; ++i) {
      for (size_t a = 0; a < n_axes; ++a) error[a] = errors[a][i];
      if (!core.holds(error)) continue;
      ++count;
      for (size_t a = 0; a < n_axes; ++a) {
        sum[a] += error[a] - core.offset[a];
        squares[a] += (error[a] - core.offset[a]) * (error[a] - core.offset[a]);
      }
    }
    for (size_t a = 0; a < n_axes; ++a) {
      const double mean = sum[a] / count;
      core.offset[a] += mean;
      core.sigma[a] = std::sqrt(squares[a] / count - mean * mean);
    }
  }
  return core;
}

template <typename Visit>
void for_samples(const ChannelField& field, Visit visit) {
  const Image<float>& first = field.error_px.front();
  std::vector<double> error(field.error_px.size());
  for (int y = 1; y < first.height(); y += stride_px) {
    for (int x = 1; x < first.width(); x += stride_px) {
      bool finite = true;
      for (size_t a = 0; a < error.size(); ++a) {
        error[a] = field.error_px[a](x, y);
        finite = finite && std::isfinite(error[a]);
      }
      if (finite) visit(x, y, error);
    }
  }
}

std::vector<Dependence> dependence_of(const std::vector<ChannelField>& frames, const Core& core) {
  std::vector<Dependence> out;
  for (const Steps& step : steps) {
    const size_t n_bins = step.edges.size() - 1, n_axes = core.sigma.size();
    std::vector<Samples> errors(n_bins, Samples(n_axes));
    std::vector<long> tails(n_bins, 0);
    for (const ChannelField& field : frames) {
      const auto property = std::ranges::find(field.properties, step.property, &ChannelField::Property::name);
      if (property == field.properties.end()) continue;
      for_samples(field, [&](int x, int y, const std::vector<double>& error) {
        const double at = property->value(x, y);
        if (!(at >= step.edges.front() && at < step.edges.back())) return;
        const auto bin =
            static_cast<size_t>(std::ranges::upper_bound(step.edges, at) - step.edges.begin() - 1);
        for (size_t a = 0; a < n_axes; ++a) errors[bin][a].push_back(error[a]);
        if (!core.holds(error)) ++tails[bin];
      });
    }
    for (size_t b = 0; b < n_bins; ++b) {
      Dependence line{
          step.property, step.edges[b], step.edges[b + 1], static_cast<long>(errors[b][0].size()), {}, 0};
      if (line.n < 200) continue;
      for (const std::vector<double>& axis : errors[b]) line.sigma_px.push_back(robust_sigma(axis));
      line.tail_share = static_cast<double>(tails[b]) / static_cast<double>(line.n);
      out.push_back(std::move(line));
    }
  }
  return out;
}

/// Sums over the pairs of one frame and bin.
struct PairSums {
  double n = 0, squared_distance = 0;
  std::vector<double> product, first, second;
};

}  // namespace

std::vector<CorrelationBin> measure_correlation(
    const std::vector<std::vector<Image<float>>>& frames_by_axis) {
  const size_t n_axes = frames_by_axis.front().size(), n_bins = distances_px.size() - 1;
  const PairSums none{0, 0, std::vector<double>(n_axes), std::vector<double>(n_axes),
                      std::vector<double>(n_axes)};
  std::vector<std::vector<PairSums>> sums(frames_by_axis.size(), std::vector<PairSums>(n_bins, none));
  for (size_t f = 0; f < frames_by_axis.size(); ++f) {
    const std::vector<Image<float>>& axes = frames_by_axis[f];
    PhiloxStream stream(1, f);
    for (int i = 0; i < bases_per_frame; ++i) {
      const int x = std::min(static_cast<int>(stream.uniform() * axes[0].width()), axes[0].width() - 1);
      const int y = std::min(static_cast<int>(stream.uniform() * axes[0].height()), axes[0].height() - 1);
      for (size_t b = 0; b < n_bins; ++b) {
        const double low = distances_px.at(b), high = distances_px.at(b + 1);
        const double r = std::sqrt(low * low + stream.uniform() * (high * high - low * low));
        const double angle = 2 * std::numbers::pi * stream.uniform();
        const int dx = static_cast<int>(std::lround(r * std::cos(angle)));
        const int dy = static_cast<int>(std::lround(r * std::sin(angle)));
        if (!axes[0].contains(x + dx, y + dy) || (dx == 0 && dy == 0)) continue;
        bool finite = true;
        for (const Image<float>& axis : axes)
          finite = finite && std::isfinite(axis(x, y) + axis(x + dx, y + dy));
        if (!finite) continue;
        PairSums& sum = sums[f][b];
        ++sum.n;
        sum.squared_distance += dx * dx + dy * dy;
        for (size_t a = 0; a < n_axes; ++a) {
          const double e = axes[a](x, y), e2 = axes[a](x + dx, y + dy);
          sum.product[a] += e * e2;
          sum.first[a] += e * e;
          sum.second[a] += e2 * e2;
        }
      }
    }
  }
  std::vector<CorrelationBin> bins;
  for (size_t b = 0; b < n_bins; ++b) {
    CorrelationBin bin{distances_px.at(b), distances_px.at(b + 1), 0, 0, {}, {}};
    double n = 0, squared = 0;
    for (const auto& frame : sums) {
      n += frame[b].n;
      squared += frame[b].squared_distance;
    }
    if (n < 500) continue;
    bin.n = static_cast<long>(n);
    bin.distance_px = std::sqrt(squared / n);
    for (size_t a = 0; a < n_axes; ++a) {
      const auto correlation = [&](std::span<const size_t> frames) {
        double product = 0, first = 0, second = 0;
        for (const size_t f : frames) {
          product += sums[f][b].product[a];
          first += sums[f][b].first[a];
          second += sums[f][b].second[a];
        }
        return first > 0 && second > 0 ? product / std::sqrt(first * second) : 0.0;
      };
      const IntervalEstimate estimate = cluster_estimate(sums.size(), correlation);
      bin.value.push_back(estimate.value);
      bin.interval.push_back(sums.size() < 3 ? std::nullopt : estimate.interval);
    }
    bins.push_back(std::move(bin));
  }
  return bins;
}

SpatialCorrelation fit_correlation(const std::vector<CorrelationBin>& bins) {
  std::vector<double> target;
  for (const CorrelationBin& bin : bins) {
    double mean = 0;
    for (const double value : bin.value) mean += value / static_cast<double>(bin.value.size());
    target.push_back(mean);
  }
  std::vector<std::array<double, lengths_px.size()>> gaussians(bins.size());
  for (size_t b = 0; b < bins.size(); ++b)
    for (size_t k = 0; k < lengths_px.size(); ++k)
      gaussians[b].at(k) = std::exp(-0.5 * std::pow(bins[b].distance_px / lengths_px.at(k), 2));
  std::vector<double> share(lengths_px.size(), 0);
  std::vector<bool> used(lengths_px.size(), true);
  const auto descend = [&] {  // coordinate descent; converges since the problem is convex
    for (int iteration = 0; iteration < 20000; ++iteration) {
      for (size_t k = 0; k < share.size(); ++k) {
        if (!used[k]) continue;
        double along = 0, square = 0;
        for (size_t b = 0; b < bins.size(); ++b) {
          double residual = target[b];
          for (size_t j = 0; j < share.size(); ++j) residual -= share[j] * gaussians[b].at(j);
          along += residual * gaussians[b].at(k);
          square += gaussians[b].at(k) * gaussians[b].at(k);
        }
        share[k] = std::max(0.0, share[k] + along / square);
      }
    }
  };
  descend();
  for (size_t k = 0; k < share.size(); ++k) {
    used[k] = share[k] >= least_share;
    if (!used[k]) share[k] = 0;
  }
  descend();
  double total = 0;
  for (const double s : share) total += s;
  SpatialCorrelation fit;
  for (size_t k = 0; k < share.size(); ++k) {
    const double s = std::floor(1e4 * share[k] / std::max(1.0, total)) / 1e4;
    if (s > 0) fit.parts.push_back({lengths_px.at(k), s});
  }
  return fit;
}

Image<float> border_distance(const Image<uint16_t>& mask) {
  constexpr float beyond = 60;
  Image<float> out(mask.width(), mask.height(), beyond);
  const auto lower = [&](int x, int y, int dx, int dy) {
    if (!mask.contains(x + dx, y + dy)) return;
    const float there = mask(x, y) != mask(x + dx, y + dy) ? 0 : out(x + dx, y + dy);
    out(x, y) = std::min(out(x, y), there + 1);
  };
  for (const auto [x, y] : pixels(mask))
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) lower(x, y, dx, dy);
  for (int y = mask.height() - 1; y >= 0; --y)
    for (int x = mask.width() - 1; x >= 0; --x)
      for (const auto& [dx, dy] : {std::pair{1, 0}, {1, 1}, {0, 1}, {-1, 1}}) lower(x, y, dx, dy);
  for (size_t i = 0; i < out.size(); ++i)
    if (out.data()[i] >= beyond) out.data()[i] = NAN;
  return out;
}

ChannelErrors channel_errors(const std::vector<ChannelField>& frames, const std::string& channel) {
  ChannelErrors out;
  if (frames.empty()) fail("{}: no frame has errors", channel);
  const size_t n_axes = frames.front().error_px.size();
  Samples errors(n_axes);
  for (const ChannelField& field : frames) {
    for_samples(field, [&](int, int, const std::vector<double>& error) {
      for (size_t a = 0; a < n_axes; ++a) errors[a].push_back(error[a]);
    });
  }
  out.n_frames = static_cast<int>(frames.size());
  out.n = static_cast<long>(errors[0].size());
  if (out.n < 1000)
    fail("{}: errors are known at {} pixels of every third row and column: expected at least 1000", channel,
         out.n);
  const Core core = fit_core(errors);
  for (const double sigma : core.sigma)
    if (!(sigma > 0))
      fail("{}: sigma is 0, because a quarter of the errors or more are equal: expected noisy measurements",
           channel);
  out.offset_px = core.offset;
  out.sigma_px = core.sigma;
  out.mean_abs_px.assign(n_axes, 0);
  double tail_length = 0;
  long n_tails = 0;
  std::vector<double> error(n_axes);
  Samples of_core(n_axes);
  for (size_t i = 0; i < errors[0].size(); ++i) {
    double squares = 0;
    for (size_t a = 0; a < n_axes; ++a) {
      error[a] = errors[a][i];
      out.mean_abs_px[a] += std::abs(error[a]) / static_cast<double>(out.n);
      squares += error[a] * error[a];
    }
    out.mean_px += std::sqrt(squares) / static_cast<double>(out.n);
    if (core.holds(error)) {
      for (size_t a = 0; a < n_axes; ++a) of_core[a].push_back(error[a]);
      continue;
    }
    ++n_tails;
    tail_length += std::sqrt(squares);
  }
  for (std::vector<double>& axis : of_core) out.robust_sigma_px.push_back(robust_sigma(std::move(axis)));
  out.tail_share = static_cast<double>(n_tails) / static_cast<double>(out.n);
  if (n_tails > 0) out.tail_radius_px = 1.5 * tail_length / static_cast<double>(n_tails);

  std::vector<std::vector<Image<float>>> standardised;
  for (const ChannelField& field : frames) {
    std::vector<Image<float>> axes = field.error_px;
    for (size_t i = 0; i < axes[0].size(); ++i) {
      for (size_t a = 0; a < n_axes; ++a) error[a] = axes[a].data()[i];
      const bool in_core = core.holds(error);
      for (size_t a = 0; a < n_axes; ++a)
        axes[a].data()[i] = in_core ? static_cast<float>((error[a] - core.offset[a]) / core.sigma[a]) : NAN;
    }
    standardised.push_back(std::move(axes));
  }
  out.correlation = measure_correlation(standardised);
  out.spatial = fit_correlation(out.correlation);
  out.dependence = dependence_of(frames, core);
  return out;
}

}  // namespace sextant
