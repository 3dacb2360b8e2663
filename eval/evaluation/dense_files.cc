#include "sextant/eval/evaluation/dense_files.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/eval/evaluation/dense_warnings.h"
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

template <typename Format>
DenseFormats formats_of(const DenseFiles<Format>& files) {
  return {to_string(files.estimate_format), to_string(files.truth_format)};
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
  if (warnings) explain_flow(pairs, formats_of(files), *warnings);
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
  if (warnings) explain_depth(pairs, formats_of(files), bf, *warnings);
  return table;
}

}  // namespace sextant
