#include "sextant/noise/draws.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/options.h"
#include "sextant/base/simd.h"

namespace sextant {
namespace {

/// A pixel outside every image, whose draw is used for the whole frame.
constexpr int whole_frame = -1;

PhiloxWords counter(NoiseChannel channel, int frame, int x, int y) {
  return {static_cast<uint32_t>(x), static_cast<uint32_t>(y), static_cast<uint32_t>(frame),
          static_cast<uint32_t>(channel)};
}

SEXTANT_SIMD void fill_uniforms(PhiloxKey key, uint32_t frame, uint32_t channel, const int* x, const int* y,
                                size_t n, double* first, double* second) {
  for (size_t i = 0; i < n; ++i) {
    const PhiloxWords w =
        philox4x32(key, {static_cast<uint32_t>(x[i]), static_cast<uint32_t>(y[i]), frame, channel});
    first[i] = unit_interval(w[0], w[1]);
    second[i] = unit_interval(w[2], w[3]);
  }
}

SEXTANT_SIMD void uniforms_to_normals(size_t n, double* first, double* second) {
  for (size_t i = 0; i < n; ++i) {
    const internal::NormalPair normal = internal::box_muller(first[i], second[i]);
    first[i] = normal.first;
    second[i] = normal.second;
  }
}

PhiloxKey key_of(uint64_t seed, std::string_view dataset, std::string_view sequence) {
  // Lengths precede the names, so that different triples always have different texts.
  const std::string digest = sha256(fmt::format("sextant noise 1\nseed {}\ndataset {} {}\nsequence {} {}\n",
                                                seed, dataset.size(), dataset, sequence.size(), sequence));
  const auto word = [&digest](size_t at) {
    return static_cast<uint32_t>(std::stoul(digest.substr(at, 8), nullptr, 16));
  };
  return {word(0), word(8)};
}

}  // namespace

Draws::Draws(uint64_t seed, std::string_view dataset, std::string_view sequence)
    : key_(key_of(seed, dataset, sequence)) {}

std::array<double, 2> Draws::uniforms(NoiseChannel channel, int frame, int x, int y) const {
  const PhiloxWords w = philox4x32(key_, counter(channel, frame, x, y));
  return {unit_interval(w[0], w[1]), unit_interval(w[2], w[3])};
}

std::array<double, 2> Draws::normals(NoiseChannel channel, int frame, int x, int y,
                                     Correlation correlation) const {
  const bool shared = correlation == Correlation::shared_per_frame;
  const std::array<double, 2> u =
      uniforms(channel, frame, shared ? whole_frame : x, shared ? whole_frame : y);
  const internal::NormalPair normal = internal::box_muller(u[0], u[1]);
  return {normal.first, normal.second};
}

void Draws::uniforms(NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
                     std::span<double> second) const {
  SEXTANT_CHECK(pixels.y.size() == pixels.size() && first.size() == pixels.size() &&
                second.size() == pixels.size());
  fill_uniforms(key_, static_cast<uint32_t>(pixels.frame), static_cast<uint32_t>(channel), pixels.x.data(),
                pixels.y.data(), pixels.size(), first.data(), second.data());
}

void Draws::normals(NoiseChannel channel, const PixelBatch& pixels, Correlation correlation,
                    std::span<double> first, std::span<double> second) const {
  if (correlation == Correlation::shared_per_frame) {
    SEXTANT_CHECK(first.size() == pixels.size() && second.size() == pixels.size());
    const std::array<double, 2> shared =
        normals(channel, pixels.frame, whole_frame, whole_frame, correlation);
    std::fill(first.begin(), first.end(), shared[0]);
    std::fill(second.begin(), second.end(), shared[1]);
    return;
  }
  // In blocks that fit into the first-level cache between the two passes.
  constexpr size_t block = 512;
  for (size_t begin = 0; begin < pixels.size(); begin += block) {
    const size_t n = std::min(block, pixels.size() - begin);
    uniforms(channel, {pixels.frame, pixels.x.subspan(begin, n), pixels.y.subspan(begin, n)},
             first.subspan(begin, n), second.subspan(begin, n));
    uniforms_to_normals(n, first.data() + begin, second.data() + begin);
  }
}

namespace {

constexpr double min_length_px = 1, max_length_px = 1000;
constexpr int most_parts = 100;  // largest number of components

/// Returns exp(-x) for x in [0, 20]. Uses only + - * /, so that the bits are equal on every machine.
double exp_of_minus(double x) {
  const double y = x / 1024;
  double power = 1 - y * (1 - y / 2 * (1 - y / 3 * (1 - y / 4 * (1 - y / 5))));
  for (int k = 0; k < 10; ++k) power *= power;
  return power;
}

int floor_divide(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

/// Returns the channel number of component k of a channel; the numbers of the channels themselves are below
/// 256.
NoiseChannel part_of(NoiseChannel channel, size_t k) {
  return static_cast<NoiseChannel>(static_cast<uint32_t>(channel) + 256 * (static_cast<uint32_t>(k) + 1));
}

struct Range {
  int low, high;
  size_t size() const { return static_cast<size_t>(int64_t{high} - low + 1); }
};

Range nodes_around(std::span<const int> pixels, int spacing, int reach) {
  const auto [low, high] = std::minmax_element(pixels.begin(), pixels.end());
  return {floor_divide(*low, spacing) - reach + 1, floor_divide(*high, spacing) + reach};
}

std::vector<double> read_numbers(const Json& object, const std::string& key, const std::string& where) {
  std::vector<double> numbers;
  const Json list = json_list(object, key, where);
  for (const Json& value : list) {
    if (internal::read_value(value, numbers.emplace_back()) != nullptr)
      fail("option {}.{}: expected finite numbers, got {}", where, key, json_excerpt(value));
  }
  return numbers;
}

}  // namespace

NoiseCorrelation::NoiseCorrelation(const SpatialCorrelation& spatial) : spatial_(spatial) {
  double sum = 0;
  for (const SpatialCorrelation::Part& part : spatial.parts) {
    check_option(part.length_px >= min_length_px && part.length_px <= max_length_px,
                 "noise.correlation.lengths_px", part.length_px, "in [1, 1000]");
    check_option(part.share > 0, "noise.correlation.shares", part.share, "> 0");
    sum += part.share;
    fields_.emplace_back(part);
  }
  check_option(sum <= 1 + 1e-9, "noise.correlation.shares: their sum", sum, "at most 1");
  check_option(!fields_.empty() && fields_.size() <= most_parts, "noise.correlation.lengths_px: their number",
               fields_.size(), "1 to 100");
}

NoiseCorrelation NoiseCorrelation::read(const Json& json, const std::string& where) {
  if (json == "independent" || json == "shared_per_frame")
    return from_name<Correlation>(json.get<std::string>(), "noise correlation");
  if (!json.is_object()) {
    fail("option {}: expected independent, shared_per_frame or an object such as {}, got {}", where,
         R"({"model": "spatial", "lengths_px": [5, 40], "shares": [0.4, 0.5]})", json_excerpt(json));
  }
  const std::vector<std::string> keys = {"model", "lengths_px", "shares"};
  for (const auto& item : json.items()) {
    if (std::find(keys.begin(), keys.end(), item.key()) == keys.end())
      fail("unknown option key '{}.{}': {}", where, item.key(), suggest(item.key(), keys));
  }
  const std::string model = json_member<std::string>(json, "model", "option " + where);
  check_option(model == "spatial", where + ".model", model, "spatial");
  const std::vector<double> lengths = read_numbers(json, "lengths_px", where);
  const std::vector<double> shares = read_numbers(json, "shares", where);
  if (lengths.size() != shares.size())
    fail("option {}: {} lengths_px but {} shares: expected one share for each length", where, lengths.size(),
         shares.size());
  SpatialCorrelation spatial;
  for (size_t k = 0; k < lengths.size(); ++k) spatial.parts.push_back({lengths[k], shares[k]});
  return NoiseCorrelation(spatial);
}

Json NoiseCorrelation::json() const {
  if (fields_.empty()) return to_string(of_pixels_);
  Json lengths = Json::array(), shares = Json::array();
  for (const SpatialCorrelation::Part& part : spatial_.parts) {
    lengths.push_back(part.length_px);
    shares.push_back(part.share);
  }
  return {{"model", "spatial"}, {"lengths_px", lengths}, {"shares", shares}};
}

std::string NoiseCorrelation::name() const {
  if (of_pixels_ == Correlation::shared_per_frame) return " (shared per frame)";
  std::string lengths;
  for (const SpatialCorrelation::Part& part : spatial_.parts)
    lengths += fmt::format("{}{}", lengths.empty() ? "" : ", ", part.length_px);
  return lengths.empty() ? "" : fmt::format(" (spatial {} px)", lengths);
}

NoiseCorrelation::Field::Field(const SpatialCorrelation::Part& part)
    : spacing_px(std::max(1, static_cast<int>(part.length_px / 1.5))),
      reach(static_cast<int>(std::ceil(2.5 * part.length_px / spacing_px))),
      amplitude(std::sqrt(part.share)) {
  for (int phase = 0; phase < spacing_px; ++phase) {
    const size_t first = weights.size();
    double squares = 0;
    for (int node = 1 - reach; node <= reach; ++node) {
      const double r = (phase - node * spacing_px) / part.length_px;
      weights.push_back(exp_of_minus(r * r));
      squares += weights.back() * weights.back();
    }
    const double scale = std::sqrt(squares);
    for (size_t k = first; k < weights.size(); ++k) weights[k] /= scale;
  }
}

void NoiseCorrelation::Field::add(const Draws& draws, NoiseChannel channel, const PixelBatch& pixels,
                                  std::span<double> first, std::span<double> second) const {
  const size_t n = pixels.size();
  if (n == 0) return;
  const Range columns = nodes_around(pixels.x, spacing_px, reach);
  const Range rows = nodes_around(pixels.y, spacing_px, reach);
  const size_t taps = 2 * static_cast<size_t>(reach);
  if (columns.size() * rows.size() > n * taps * taps) {  // few pixels, far apart
    const size_t half = n / 2;
    add(draws, channel, {pixels.frame, pixels.x.first(half), pixels.y.first(half)}, first.first(half),
        second.first(half));
    add(draws, channel, {pixels.frame, pixels.x.subspan(half), pixels.y.subspan(half)}, first.subspan(half),
        second.subspan(half));
    return;
  }
  std::vector<int> node_x, node_y;
  for (int column = columns.low; column <= columns.high; ++column) {
    for (int row = rows.low; row <= rows.high; ++row) {
      node_x.push_back(column);
      node_y.push_back(row);
    }
  }
  std::vector<double> node_first(node_x.size()), node_second(node_x.size());
  draws.normals(channel, {pixels.frame, node_x, node_y}, Correlation::independent, node_first, node_second);
  // Sums along the columns come first, because the pixels of one row share them.
  struct ColumnSum {
    int y;
    bool valid = false;
    double first = 0, second = 0;
  };
  std::vector<ColumnSum> sums(columns.size());
  for (size_t i = 0; i < n; ++i) {
    const int x = pixels.x[i], y = pixels.y[i];
    const int column = floor_divide(x, spacing_px), row = floor_divide(y, spacing_px);
    const double* down = &weights[static_cast<size_t>(y - row * spacing_px) * taps];
    const double* across = &weights[static_cast<size_t>(x - column * spacing_px) * taps];
    const size_t begin_column = static_cast<size_t>(column - reach + 1 - columns.low);
    const size_t begin_row = static_cast<size_t>(row - reach + 1 - rows.low);
    double a = 0, b = 0;
    for (size_t k = 0; k < taps; ++k) {
      ColumnSum& sum = sums[begin_column + k];
      if (!sum.valid || sum.y != y) {
        const size_t at = (begin_column + k) * rows.size() + begin_row;
        sum = {y, true};
        for (size_t j = 0; j < taps; ++j) {
          sum.first += down[j] * node_first[at + j];
          sum.second += down[j] * node_second[at + j];
        }
      }
      a += across[k] * sum.first;
      b += across[k] * sum.second;
    }
    first[i] += amplitude * a;
    second[i] += amplitude * b;
  }
}

void NoiseCorrelation::normals(const Draws& draws, NoiseChannel channel, const PixelBatch& pixels,
                               std::span<double> first, std::span<double> second) const {
  SEXTANT_CHECK(pixels.y.size() == pixels.size() && first.size() == pixels.size() &&
                second.size() == pixels.size());
  const double rest = fields_.empty() ? 1 : spatial_.independent_share();
  if (rest > 0) {
    draws.normals(channel, pixels, of_pixels_, first, second);
  } else {
    std::fill(first.begin(), first.end(), 0);
    std::fill(second.begin(), second.end(), 0);
  }
  if (fields_.empty()) return;
  for (size_t i = 0; i < pixels.size(); ++i) {
    first[i] *= std::sqrt(rest);
    second[i] *= std::sqrt(rest);
  }
  for (size_t k = 0; k < fields_.size(); ++k) {
    fields_[k].add(draws, part_of(channel, k), pixels, first, second);
  }
}

}  // namespace sextant
