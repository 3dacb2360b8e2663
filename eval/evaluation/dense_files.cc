#include "sextant/eval/evaluation/dense_files.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "sextant/base/files.h"
#include "sextant/base/quantile.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/eval/diagnosis/dense_readings.h"
#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/eval/diagnosis/motion_readings.h"
#include "sextant/metrics/dense_errors.h"

namespace sextant {
namespace {

/// Returns true if a PNG with the channels u, v and validity seems to have them in the order B, G, R: red
/// holds only a flag, and blue does not.
bool has_reversed_channels(const Image<Rgb16>& image) {
  const auto is_flag = [&](uint16_t Rgb16::*channel) {
    uint16_t largest = 0;
    for (size_t i = 0; i < image.size(); ++i) largest = std::max(largest, image.data()[i].*channel);
    return std::all_of(image.data(), image.data() + image.size(), [&](const Rgb16& pixel) {
      return (pixel.*channel == 0 || pixel.*channel == largest) && (largest <= 1 || largest == 65535);
    });
  };
  return is_flag(&Rgb16::r) && !is_flag(&Rgb16::b);
}

/// Adds a warning, unless `warnings` is null, if the channels of a PNG seem to be in the wrong order.
Image<Flow> read_flow(const std::string& path, FlowFormat format, std::vector<std::string>* warnings) {
  const std::string bytes = read_file(path);
  if (format == FlowFormat::flo || (format == FlowFormat::by_name && path.ends_with(".flo")))
    return decode_flo(bytes, path);
  if (format == FlowFormat::by_name)
    fail("{}: flow in a PNG may be of kitti or vkitti: give --est-format and --gt-format", path);
  const Image<Rgb16> image = decode_png_rgb16(bytes, path);
  if (warnings != nullptr && warnings->empty() && has_reversed_channels(image)) {
    warnings->push_back(fmt::format(
        "flow: the channels of {} seem to be in the order B, G, R: its red channel holds only a flag, its "
        "blue channel does not: write u to red, v to green, and 1 for valid pixels to blue",
        path));
  }
  return format == FlowFormat::kitti ? flow_from_kitti(image) : flow_from_vkitti(image);
}

Image<float> read_depth(const std::string& path, DepthFormat format, double bf) {
  const Image<uint16_t> image = decode_png16(read_file(path), path);
  if (format == DepthFormat::depth256) return depth_from_depth256(image);
  if (format == DepthFormat::cm) return depth_from_cm(image);
  if (!(bf > 0)) fail("{}: disparities need --bf, focal length times baseline in px m", path);
  return depth_from_disparity256(image, bf);
}

/// Extensions of the files of a format; both if no format is given.
std::vector<std::string> extensions_of(FlowFormat format) {
  if (format == FlowFormat::by_name) return {".png", ".flo"};
  return {format == FlowFormat::flo ? ".flo" : ".png"};
}
std::vector<std::string> extensions_of(DepthFormat) { return {".png"}; }

/// Returns the names of the images in a folder without extensions, sorted. Throws Error if there is no image,
/// or one image in two formats.
std::vector<std::string> names_in(const std::string& folder, const std::vector<std::string>& extensions,
                                  const char* flag) {
  std::set<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (std::ranges::find(extensions, entry.path().extension().string()) == extensions.end()) continue;
    const std::string name = entry.path().stem().string();
    if (!names.insert(name).second)
      fail("{}: holds both {}.png and {}.flo: choose with {} the format to read: flo, kitti or vkitti",
           folder, name, name, flag);
  }
  if (names.empty())
    fail("{}: holds no file {}: expected a folder of images", folder, fmt::join(extensions, " or "));
  return {names.begin(), names.end()};
}

/// Returns the names of the estimate's images; a single empty name if the estimate is a file.
template <typename Format>
std::vector<std::string> names_in(const DenseFiles<Format>& files) {
  std::error_code error;
  if (!fs::is_directory(files.estimate, error)) return {""};
  return names_in(files.estimate, extensions_of(files.estimate_format), "--est-format");
}

/// Returns the path of the image `name` in a folder; the path itself for an empty name. Throws Error if the
/// image does not exist, or exists in two formats.
std::string file_of(const std::string& path, const std::string& name,
                    const std::vector<std::string>& extensions, const char* flag) {
  if (name.empty()) return path;
  std::string found;
  for (const std::string& extension : extensions) {
    const fs::path file = fs::path(path) / (name + extension);
    std::error_code ignored;
    if (!fs::exists(file, ignored)) continue;
    if (!found.empty())
      fail("{}: holds both {}.png and {}.flo: choose with {} the format to read: flo, kitti or vkitti", path,
           name, name, flag);
    found = file.string();
  }
  if (found.empty())
    fail("{}: has no {}{}, which the estimate has", path, name,
         fmt::join(extensions, fmt::format(" or {}", name)));
  return found;
}

/// Notes below the table how many images of the truth have no estimate; these are not evaluated and do not
/// lower the coverage.
template <typename Format>
void note_missing_images(const DenseFiles<Format>& files, Table& table) {
  std::error_code error;
  if (!fs::is_directory(files.estimate, error) || !fs::is_directory(files.truth, error)) return;
  const size_t n_truth = names_in(files.truth, extensions_of(files.truth_format), "--gt-format").size();
  const size_t n = names_in(files).size();
  if (n < n_truth)
    table.notes.push_back(fmt::format(
        "{} of {} images of the truth have an estimate; the others are not evaluated, and do not lower "
        "coverage",
        n, n_truth));
}

template <typename T, typename U>
void check_size(const Image<T>& image, const Image<U>& truth, const std::string& path) {
  if (image.width() != truth.width() || image.height() != truth.height())
    fail("{}: is {}x{} px, the truth {}x{} px: expected equal sizes", path, image.width(), image.height(),
         truth.width(), truth.height());
}

bool has_value(const Flow& flow) { return flow.valid(); }
bool has_value(float z) { return std::isfinite(z) && z > 0; }
Flow no_value(const Flow&) { return {}; }
float no_value(float) { return NAN; }

/// Copies a truth image with only the pixels for which `keep(i)` is true.
template <typename T, typename Keep>
Image<T> reduced(const Image<T>& truth, const Keep& keep) {
  Image<T> out = truth;
  for (size_t i = 0; i < out.size(); ++i) {
    if (!keep(i)) out.data()[i] = no_value(T{});
  }
  return out;
}

/// Calls take(subset, estimate, truth of the subset) for every image and subset.
template <typename T, typename Format, typename Read, typename Take>
void for_subsets(const DenseFiles<Format>& files, const Read& read, const Take& take) {
  for (const std::string& name : names_in(files)) {
    const std::string path =
        file_of(files.estimate, name, extensions_of(files.estimate_format), "--est-format");
    const Image<T> estimate = read(path, files.estimate_format);
    const Image<T> truth = read(file_of(files.truth, name, extensions_of(files.truth_format), "--gt-format"),
                                files.truth_format);
    check_size(estimate, truth, path);
    take("all", estimate, truth);
    if (!files.visible_truth.empty()) {
      const std::string visible_path =
          file_of(files.visible_truth, name, extensions_of(files.truth_format), "--gt-format");
      const Image<T> visible = read(visible_path, files.truth_format);
      check_size(visible, truth, visible_path);
      take("noc", estimate, reduced(truth, [&](size_t i) { return has_value(visible.data()[i]); }));
      take("occ", estimate, reduced(truth, [&](size_t i) { return !has_value(visible.data()[i]); }));
    }
    if (files.mask.empty()) continue;
    const std::string mask_path = file_of(files.mask, name, {".png"}, "");
    const Image<uint16_t> mask = decode_png_ids(read_file(mask_path), mask_path);
    check_size(mask, truth, mask_path);
    const std::set<uint16_t> labels(mask.data(), mask.data() + mask.size());
    for (const uint16_t label : labels)
      take(fmt::format("mask {}", label), estimate,
           reduced(truth, [&](size_t i) { return mask.data()[i] == label; }));
  }
}

template <typename Format>
void check_any(int64_t n, const DenseFiles<Format>& files) {
  if (n == 0) fail("{}: no pixel has both an estimate and truth in {}", files.estimate, files.truth);
}

Cell finite_cell(double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; }
Cell percent(double share) { return finite_cell(100 * share); }

// ---- other readings of the files

/// An estimate and the truth of one pixel: flow (px), or ln z (m) in x.
struct DensePair {
  Eigen::Vector2d estimate, truth;
  double width = 0, height = 0;  ///< of the image, px
  Eigen::Vector2d pixel;         ///< its coordinates x, y
};
using DensePairs = std::vector<DensePair>;

Eigen::Vector2d vector_of(const Flow& flow) { return {flow.u, flow.v}; }
Eigen::Vector2d vector_of(float z) { return {std::log(double{z}), 0}; }

template <typename T>
void add_pairs(const Image<T>& estimate, const Image<T>& truth, DensePairs& pairs) {
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
    fitted = middle_of(factors);
    if (!(fitted > 0) || std::abs(std::log(fitted)) < std::log(1.25)) return false;
    for (DensePair& pair : pairs) divide(pair, fitted);
    return true;
  };
  return {factor_code, "the estimate is about {:.4g} times the truth: one factor explains the errors",
          remedy,      undo,
          /*price=*/1, /*fits_number=*/true};
}

/// A side of the comparison, its format, and the flag that sets the format.
struct Side {
  Eigen::Vector2d DensePair::*vector;
  std::string_view format;
  const char* flag;
};
template <typename Format>
std::array<Side, 2> sides_of(const DenseFiles<Format>& files) {
  return {{{&DensePair::estimate, to_string(files.estimate_format), "--est-format"},
           {&DensePair::truth, to_string(files.truth_format), "--gt-format"}}};
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

void explain_flow(const DensePairs& pairs, const DenseFiles<FlowFormat>& files,
                  std::vector<std::string>& warnings) {
  std::vector<Hypothesis<DensePairs>> hypotheses;
  for (const Side& side : sides_of(files)) {
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
  DensePairs still = pairs;
  for (DensePair& pair : still) pair.estimate.setZero();
  explain_errors(pairs, hypotheses, still, "flow", "px", "no flow at all", warnings);
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

void explain_depth(const DensePairs& all_pairs, const DenseFiles<DepthFormat>& files, double bf,
                   std::vector<std::string>& warnings) {
  const DensePairs pairs = without_clipped(all_pairs);
  std::vector<Hypothesis<DensePairs>> hypotheses;
  for (const Side& side : sides_of(files)) {
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
  DensePairs even = pairs;
  double mean = 0;
  for (const DensePair& pair : pairs) mean += pair.truth.x() / static_cast<double>(pairs.size());
  for (DensePair& pair : even) pair.estimate.x() = mean;
  explain_errors(pairs, hypotheses, even, "depth", "in ln z", "the same depth everywhere", warnings);
}

}  // namespace

Table evaluate_flow(const DenseFiles<FlowFormat>& files, std::vector<std::string>* warnings) {
  std::map<std::string, std::vector<DenseFlowError>> errors;
  DensePairs pairs;
  const auto read = [&](const std::string& path, FlowFormat format) {
    return read_flow(path, format, warnings);
  };
  for_subsets<Flow>(files, read,
                    [&](const std::string& subset, const Image<Flow>& estimate, const Image<Flow>& truth) {
                      errors[subset].push_back(dense_flow_error(estimate, truth));
                      if (warnings && subset == "all") add_pairs(estimate, truth, pairs);
                    });
  Table table{
      "Flow",
      "Fl: share of errors above 3 px and 5 % of the true flow. Errors are those of pixels with an estimate "
      "and truth; coverage is their share of the pixels with truth.",
      {Column::text("subset", "pixels of"), Column::count("n"), Column::count("n_truth", "truth"),
       Column::number("coverage_percent", "coverage [%]", 2), Column::number("epe_px", "EPE [px]", 4),
       Column::number("epe_x_px", "|u| [px]", 4), Column::number("epe_y_px", "|v| [px]", 4),
       Column::number("fl_percent", "Fl [%]", 3)}};
  for (const auto& [subset, images] : errors) {
    const DenseFlowError e = pooled(images);
    if (subset == "all") check_any(e.n, files);
    table.add_row({subset, e.n, e.n_truth, percent(e.coverage), finite_cell(e.epe_px), finite_cell(e.x_px),
                   finite_cell(e.y_px), percent(e.outlier_share)});
  }
  note_missing_images(files, table);
  if (warnings) {
    explain_flow(pairs, files, *warnings);
    find_empty_flow(pairs, *warnings);
  }
  return table;
}

Table evaluate_depth(const DenseFiles<DepthFormat>& files, double bf, std::vector<std::string>* warnings) {
  DensePairs pairs;
  std::map<std::string, std::pair<std::vector<Image<float>>, std::vector<Image<float>>>> images;
  const auto read = [&](const std::string& path, DepthFormat format) { return read_depth(path, format, bf); };
  for_subsets<float>(files, read,
                     [&](const std::string& subset, const Image<float>& estimate, const Image<float>& truth) {
                       images[subset].first.push_back(estimate);
                       images[subset].second.push_back(truth);
                       if (warnings && subset == "all") add_pairs(estimate, truth, pairs);
                     });
  Table table{
      "Depth",
      "Errors are those of pixels with an estimate and truth; coverage is their share of the pixels with "
      "truth. D1 (with --bf): share of disparity errors above 3 px and 5 %.",
      {Column::text("subset", "pixels of"), Column::count("n"), Column::count("n_truth", "truth"),
       Column::number("coverage_percent", "coverage [%]", 2), Column::number("mean_m", "mean [m]", 4),
       Column::number("rmse_m", "RMSE [m]", 4), Column::number("relative_percent", "relative [%]", 3),
       Column::number("bias_percent", "bias [%]", 3), Column::number("within_125_percent", "< 1.25 [%]", 2),
       Column::number("disparity_px", "disparity [px]", 4), Column::number("d1_percent", "D1 [%]", 3)}};
  for (const auto& [subset, pair] : images) {
    const auto& [estimates, truths] = pair;
    const DepthError e = depth_error(estimates, truths);
    if (subset == "all") check_any(e.n, files);
    Cell disparity, d1;
    if (bf > 0) {
      std::vector<DenseDisparityError> each;
      for (size_t i = 0; i < truths.size(); ++i)
        each.push_back(dense_disparity_error(estimates[i], truths[i], bf));
      const DenseDisparityError all = pooled(each);
      disparity = finite_cell(all.mean_px);
      d1 = percent(all.outlier_share);
    }
    table.add_row({subset, e.n, e.n_truth, percent(e.coverage), finite_cell(e.mean_m), finite_cell(e.rmse_m),
                   percent(e.relative), percent(e.bias), percent(e.within_125), disparity, d1});
  }
  note_missing_images(files, table);
  if (warnings) explain_depth(pairs, files, bf, *warnings);
  return table;
}

}  // namespace sextant
