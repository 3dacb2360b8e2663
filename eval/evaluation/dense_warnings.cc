#include "sextant/eval/evaluation/dense_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "sextant/base/quantile.h"
#include "sextant/eval/diagnosis/dense_readings.h"
#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/eval/diagnosis/motion_readings.h"

namespace sextant {
namespace {

Eigen::Vector2d vector_of(const Flow& flow) { return {flow.u, flow.v}; }
Eigen::Vector2d vector_of(float z) { return {std::log(double{z}), 0}; }

template <typename T>
void add_some(const Image<T>& estimate, const Image<T>& truth, DensePairs& pairs) {
  constexpr size_t most = 2000;
  size_t n = 0, seen = 0;
  const auto both = [&](size_t i) { return has_value(estimate.data()[i]) && has_value(truth.data()[i]); };
  for (size_t i = 0; i < truth.size(); ++i) n += both(i) ? 1 : 0;
  const size_t stride = n / most + 1;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (!both(i) || seen++ % stride != 0) continue;
    pairs.push_back({vector_of(estimate.data()[i]),
                     vector_of(truth.data()[i]),
                     static_cast<double>(truth.width()),
                     static_cast<double>(truth.height()),
                     {static_cast<double>(i % static_cast<size_t>(truth.width())),
                      static_cast<double>(i / static_cast<size_t>(truth.width()))}});
  }
}

std::optional<double> mean_square(const DensePairs& pairs) {
  double sum = 0;
  for (const DensePair& pair : pairs) sum += (pair.estimate - pair.truth).squaredNorm();
  const double mean = sum / static_cast<double>(pairs.size());
  return std::isfinite(mean) ? std::optional(mean) : std::nullopt;
}

/// Returns the hypothesis that the vectors of one side mean read(vector, width, height).
template <typename Read>
Hypothesis<DensePairs> hypothesis(Eigen::Vector2d DensePair::*side, const std::string& cause,
                                  const std::string& remedy, const Read& read) {
  const char* where = side == &DensePair::estimate ? "in the estimate" : "in the truth";
  return {cause, fmt::format("{}, {}", where, cause), remedy, [side, read](DensePairs& pairs, double&) {
            for (DensePair& pair : pairs) pair.*side = read(pair.*side, pair.width, pair.height);
            return true;
          }};
}

constexpr const char* factor_code = "factor";

/// Returns the hypothesis that the estimate is the truth times one factor, which is a median over the pixels:
/// factor_of(pair), NaN where the pixel does not determine it. divide(pair, factor) corrects a pixel. A
/// factor within 25 % of 1 is an error of the estimate, not of its scale.
template <typename FactorOf, typename Divide>
Hypothesis<DensePairs> one_factor(const FactorOf& factor_of, const Divide& divide,
                                  const std::string& remedy) {
  const auto undo = [factor_of, divide](DensePairs& pairs, double& fitted) {
    std::vector<double> factors;
    for (const DensePair& pair : pairs) {
      if (const double factor = factor_of(pair); std::isfinite(factor)) factors.push_back(factor);
    }
    if (factors.empty()) return false;
    fitted = upper_median(factors);
    if (!(fitted > 0) || std::abs(std::log(fitted)) < std::log(1.25)) return false;
    for (DensePair& pair : pairs) divide(pair, fitted);
    return true;
  };
  return {factor_code, "the estimate is about {:.4g} times the truth: one factor explains the errors",
          remedy,      undo,
          /*price=*/1, /*fits_number=*/true};
}

/// Returns the hypothesis that u and v are the true ones times two different factors, as of flow that was
/// computed on images of another aspect ratio. Ratios within 10 % of 1 are errors of the estimate.
Hypothesis<DensePairs> factor_per_axis() {
  const auto undo = [](DensePairs& pairs, double& fitted) {
    constexpr double shortest_px = 1;
    Eigen::Vector2d factor;
    for (int axis = 0; axis < 2; ++axis) {
      std::vector<double> factors;
      for (const DensePair& pair : pairs) {
        if (std::abs(pair.truth[axis]) >= shortest_px)
          factors.push_back(pair.estimate[axis] / pair.truth[axis]);
      }
      if (factors.empty()) return false;
      factor[axis] = upper_median(factors);
    }
    fitted = factor.y() / factor.x();
    if (!(factor.minCoeff() > 0) || std::abs(std::log(fitted)) < std::log(1.1)) return false;
    for (DensePair& pair : pairs) pair.estimate = pair.estimate.cwiseQuotient(factor);
    return true;
  };
  return {"axis_factors",
          "the estimate has v / u about {:.4g} times that of the truth, as flow that was computed on images "
          "of another aspect ratio",
          "multiply u by the ratio of the widths of the images, v by that of their heights",
          undo,
          /*price=*/2,
          /*fits_number=*/true};
}

/// Returns the hypothesis that the estimate is the distance along the viewing ray, for a camera with square
/// pixels and its centre in the middle of the image.
Hypothesis<DensePairs> distance_along_ray() {
  const auto radius_px = [](const DensePair& pair) {
    return (pair.pixel - Eigen::Vector2d((pair.width - 1) / 2, (pair.height - 1) / 2)).norm();
  };
  const auto undo = [radius_px](DensePairs& pairs, double& focal_px) {
    // The median of r / tan of the angle between ray and optical axis, away from the centre.
    std::vector<double> focal_lengths;
    for (const DensePair& pair : pairs) {
      const double secant_squared = std::exp(2 * (pair.estimate.x() - pair.truth.x()));
      if (radius_px(pair) < pair.width / 4 || !(secant_squared > 1)) continue;
      focal_lengths.push_back(radius_px(pair) / std::sqrt(secant_squared - 1));
    }
    if (2 * focal_lengths.size() < pairs.size() / 4) return false;
    focal_px = upper_median(focal_lengths);
    for (DensePair& pair : pairs)
      pair.estimate.x() -= 0.5 * std::log1p(std::pow(radius_px(pair) / focal_px, 2));
    return true;
  };
  return {"ray_distance",
          "in the estimate, depth looks like the distance along the viewing ray instead of z, for a focal "
          "length of about {:.4g} px",
          "divide by sqrt(1 + ((x - cx) / fx)^2 + ((y - cy) / fy)^2)",
          undo,
          /*price=*/1,
          /*fits_number=*/true};
}

/// A side of the comparison, its format, and the flag that sets the format.
struct Side {
  Eigen::Vector2d DensePair::*vector;
  std::string_view format;
  const char* flag;
};
std::array<Side, 2> sides_of(const DenseFormats& formats) {
  return {{{&DensePair::estimate, formats.estimate, "--est-format"},
           {&DensePair::truth, formats.truth, "--gt-format"}}};
}

/// Mean of the smallest four fifths of the squared errors: a few gross errors are no mistake of the whole
/// image.
double robust_mean_square(const DensePairs& pairs) {
  std::vector<double> squares;
  for (const DensePair& pair : pairs) squares.push_back((pair.estimate - pair.truth).squaredNorm());
  return trimmed_mean(std::move(squares), 1).value_or(0);
}

/// Warns of another reading that explains the errors or, if none does, of an estimate that is hardly better
/// than `null`, which knows nothing of the image.
void explain_errors(const DensePairs& pairs, const std::vector<Hypothesis<DensePairs>>& hypotheses,
                    const DensePairs& null, const char* subject, const char* unit, const char* null_text,
                    std::vector<std::string>& warnings) {
  constexpr double largest_share = 0.5;
  const std::optional<double> declared = mean_square(pairs);
  if (!declared) return;
  auto found =
      explain(*declared, read_as(hypotheses, pairs, mean_square), {.null = mean_square(null).value_or(0)});
  if (found) {
    std::erase_if(found->alike, [](const Reading& other) { return other.code == factor_code; });
    warnings.push_back(message(*found, subject, unit));
    return;
  }
  const double errors = robust_mean_square(pairs), of_null = robust_mean_square(null);
  if (!warnings.empty() || errors <= largest_share * of_null || !(of_null > 0)) return;
  warnings.push_back(fmt::format(
      "{}: the estimate is hardly better than {}: RMS errors of {:.3g} and {:.3g} {} (without the largest "
      "fifth of each): is it of another image, mirrored, or stored in another format or byte order?",
      subject, null_text, std::sqrt(errors), std::sqrt(of_null), unit));
}

/// Warns if much of the estimate is exactly (0, 0) where the truth is not, as pixels without an estimate are
/// that were not marked as invalid.
void find_empty_flow(const DensePairs& pairs, std::vector<std::string>& warnings) {
  constexpr double moving_px = 1, large_share = 0.25;
  const auto is_zero = [](const DensePair& pair) { return pair.estimate.isZero(0); };
  const auto n_zero = std::ranges::count_if(pairs, is_zero);
  const auto n_wrong = std::ranges::count_if(
      pairs, [&](const DensePair& pair) { return is_zero(pair) && pair.truth.norm() > moving_px; });
  const auto n = static_cast<double>(pairs.size());
  if (std::ssize(pairs) == n_zero || static_cast<double>(n_wrong) < large_share * n) return;
  warnings.push_back(fmt::format(
      "flow: the estimate is exactly (0, 0) in {:.0f} % of the pixels, where the true flow is above {} px: "
      "if these have no estimate, mark them as invalid (1e10 in .flo, 0 in the blue channel of PNG)",
      100 * static_cast<double>(n_wrong) / n, moving_px));
}

/// Removes the pixels with the largest estimate if they are 5 to 95 % of all: the format of the files, or
/// their writer, has clipped them.
DensePairs without_clipped(const DensePairs& pairs) {
  constexpr double least_share = 0.05;
  double largest = -INFINITY;
  for (const DensePair& pair : pairs) largest = std::max(largest, pair.estimate.x());
  DensePairs others;
  std::ranges::copy_if(pairs, std::back_inserter(others),
                       [&](const DensePair& pair) { return pair.estimate.x() < largest; });
  const double share = static_cast<double>(others.size()) / static_cast<double>(pairs.size());
  return share < least_share || share > 1 - least_share ? pairs : others;
}

}  // namespace

void add_pairs(const Image<Flow>& estimate, const Image<Flow>& truth, DensePairs& pairs) {
  add_some(estimate, truth, pairs);
}
void add_pairs(const Image<float>& estimate_m, const Image<float>& truth_m, DensePairs& pairs) {
  add_some(estimate_m, truth_m, pairs);
}

void explain_flow(const DensePairs& pairs, const DenseFormats& formats, std::vector<std::string>& warnings) {
  std::vector<Hypothesis<DensePairs>> hypotheses;
  for (const Side& side : sides_of(formats)) {
    for (const FlowReading& reading : flow_readings()) {
      // The values of the truth are right; only its format may be wrong.
      const bool of_format = !reading.read_as.empty();
      if (of_format ? reading.read_as != side.format : side.vector == &DensePair::truth) continue;
      hypotheses.push_back(hypothesis(
          side.vector, reading.cause,
          of_format ? fmt::format("{} {}", side.flag, reading.stored_as) : reading.remedy, reading.read));
    }
  }
  hypotheses.push_back({"target",
                        "in the estimate, flow holds the target (x + u, y + v) of each pixel (x, y)",
                        "subtract the coordinates of the pixel", [](DensePairs& all, double&) {
                          for (DensePair& pair : all) pair.estimate -= pair.pixel;
                          return true;
                        }});
  hypotheses.push_back(one_factor(
      [](const DensePair& pair) {
        constexpr double shortest_px = 1;
        const double length = pair.truth.norm();
        return length < shortest_px ? NAN : pair.estimate.dot(pair.truth) / (length * length);
      },
      [](DensePair& pair, double factor) { pair.estimate /= factor; },
      "check the unit and scale of the flow"));
  hypotheses.push_back(factor_per_axis());
  DensePairs still = pairs;
  for (DensePair& pair : still) pair.estimate.setZero();
  explain_errors(pairs, hypotheses, still, "flow", "px", "no flow at all", warnings);
  find_empty_flow(pairs, warnings);
}

void explain_depth(const DensePairs& all_pairs, const DenseFormats& formats, double bf,
                   std::vector<std::string>& warnings) {
  const DensePairs pairs = without_clipped(all_pairs);
  std::vector<Hypothesis<DensePairs>> hypotheses;
  for (const Side& side : sides_of(formats)) {
    std::vector<DepthReading> readings = depth_readings(side.format);
    if (side.vector == &DensePair::truth) {
      std::erase_if(readings, [](const DepthReading& reading) { return reading.stored_as.empty(); });
    } else {
      readings.push_back(
          {"depth looks like inverse depth (1 / z)", "", [](double z, double) { return 1 / z; }});
    }
    for (const DepthReading& reading : readings) {
      const std::string remedy = reading.stored_as.empty()
                                     ? fmt::format("convert the files to {}", side.format)
                                     : fmt::format("{} {}", side.flag, reading.stored_as);
      hypotheses.push_back(hypothesis(side.vector, reading.cause, remedy,
                                      [read = reading.read, bf](const Eigen::Vector2d& ln_z, double, double) {
                                        return Eigen::Vector2d(std::log(read(std::exp(ln_z.x()), bf)), 0);
                                      }));
    }
  }
  hypotheses.push_back(one_factor(
      [](const DensePair& pair) { return std::exp(pair.estimate.x() - pair.truth.x()); },
      [](DensePair& pair, double factor) { pair.estimate.x() -= std::log(factor); },
      "check the unit and scale of the depth, and that --bf is focal length times baseline in px m"));
  hypotheses.push_back(distance_along_ray());
  DensePairs even = pairs;
  double mean = 0;
  for (const DensePair& pair : pairs) mean += pair.truth.x() / static_cast<double>(pairs.size());
  for (DensePair& pair : even) pair.estimate.x() = mean;
  explain_errors(pairs, hypotheses, even, "depth", "in ln z", "the same depth everywhere", warnings);
}

}  // namespace sextant
