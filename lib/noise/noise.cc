// Noise::apply: applies the models to the arrays of points and to the rows of frames, with verification.

#include "sextant/noise/noise.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "sextant/base/names.h"
#include "sextant/measurement/frame.h"
#include "sextant/noise/stored_profiles.h"

namespace sextant {
namespace {

/// Step between the pixels whose draw is compared with that of the right neighbour: verification should not
/// cost more than the noise itself.
constexpr size_t neighbour_step = 4;

/// Rounds to float, as images do.
double as_float(double value) { return static_cast<double>(static_cast<float>(value)); }

/// Pixels of points, rounded to the nearest pixel.
struct Pixels {
  std::vector<int> x, y;
  PixelBatch batch(int frame) const { return {frame, x, y}; }
};

Pixels pixels_of(const Correspondences& points) {
  Pixels pixels;
  for (size_t i = 0; i < points.size(); ++i) {
    pixels.x.push_back(static_cast<int>(std::lround(points.u[i])));
    pixels.y.push_back(static_cast<int>(std::lround(points.v[i])));
  }
  return pixels;
}

struct FlowArrays {
  std::vector<double> u, v;
};

}  // namespace

/// One application of a Noise: its context and the achieved statistics.
class NoiseApplication {
 public:
  NoiseApplication(const Noise& noise, const StereoCamera& camera, const Draws& draws)
      : models_(noise.models_), noise_(noise), context_{draws, noise.correlation_, camera} {
    for (const auto& named : models_) {
      changes_depth_ = changes_depth_ || named.model->changes_depth();
      changes_flow_ = changes_flow_ || named.model->changes_flow();
      needs_bodies_ = needs_bodies_ || named.model->needs_bodies();
    }
  }

  Correspondences points(const Correspondences& clean, const FramePair& pair, const std::vector<int>& body,
                         std::vector<unsigned char>& keep);
  void frame(Frame& frame);

  NoiseVerification achieved;

 private:
  /// Returns corrupted depths, NaN where the noise invalidates a depth. Depths that were invalid before, or
  /// that no model changes, keep their bits.
  std::vector<double> depth(const PixelBatch& pixels, std::span<const double> clean);
  /// Returns corrupted flows; `is_outlier` has the length of the batch.
  FlowArrays flow(const PixelBatch& pixels, std::span<const int> body, bool backward,
                  std::span<const double> u, std::span<const double> v,
                  std::vector<unsigned char>& is_outlier);
  std::vector<double> depth_curr(const Pixels& pixels, const Correspondences& clean, const FramePair& pair);

  void verify_depth(const PixelBatch& pixels, std::span<const double> clean,
                    const std::vector<double>& noisy);
  void verify_flow(const PixelBatch& pixels, std::span<const int> body, std::span<const double> u,
                   std::span<const double> v, const FlowArrays& noisy,
                   const std::vector<unsigned char>& is_outlier);
  void verify_neighbours(NoiseChannel channel, const PixelBatch& pixels, NeighbourSums& sums) const;
  void frame_depth(Frame& frame, const Pixels& row_pixels, int y);
  void frame_flow(Image<Flow>& image, const Frame& frame, const Pixels& row_pixels, int y, bool backward);

  const std::vector<Noise::NamedModel>& models_;
  const Noise& noise_;
  NoiseContext context_;
  bool changes_depth_ = false;
  bool changes_flow_ = false;
  bool needs_bodies_ = false;
};

std::vector<double> NoiseApplication::depth(const PixelBatch& pixels, std::span<const double> clean) {
  std::vector<double> noisy(clean.begin(), clean.end());
  if (!changes_depth_) return noisy;
  for (const auto& named : models_) named.model->corrupt_depth(context_, pixels, noisy);
  for (size_t i = 0; i < noisy.size(); ++i) {
    if (!valid_depth(clean[i])) {
      noisy[i] = clean[i];
    } else if (noisy[i] != clean[i]) {
      const double rounded = as_float(noisy[i]);
      noisy[i] = valid_depth(rounded) ? rounded : NAN;
    }
  }
  verify_depth(pixels, clean, noisy);
  return noisy;
}

FlowArrays NoiseApplication::flow(const PixelBatch& pixels, std::span<const int> body, bool backward,
                                  std::span<const double> u, std::span<const double> v,
                                  std::vector<unsigned char>& is_outlier) {
  FlowArrays noisy{{u.begin(), u.end()}, {v.begin(), v.end()}};
  if (!changes_flow_) return noisy;
  const FlowBatch batch{backward, body, noisy.u, noisy.v, is_outlier};
  for (const auto& named : models_) named.model->corrupt_flow(context_, pixels, batch);
  for (size_t i = 0; i < pixels.size(); ++i) {
    const bool known = std::isfinite(u[i]) && std::isfinite(v[i]);
    if (!known) is_outlier[i] = 0;
    noisy.u[i] = known && noisy.u[i] != u[i] ? as_float(noisy.u[i]) : u[i];
    noisy.v[i] = known && noisy.v[i] != v[i] ? as_float(noisy.v[i]) : v[i];
  }
  verify_flow(pixels, body, u, v, noisy, is_outlier);
  return noisy;
}

void NoiseApplication::verify_depth(const PixelBatch& pixels, std::span<const double> clean,
                                    const std::vector<double>& noisy) {
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (!valid_depth(clean[i])) continue;
    ++achieved.depth.n_valid;
    if (std::isnan(noisy[i])) {
      ++achieved.depth.n_invalidated;
      continue;
    }
    const double sigma_m = noise_.depth_sigma_m(context_.camera, clean[i]);
    if (sigma_m > 0) achieved.depth.normalised.add((noisy[i] - clean[i]) / sigma_m);
  }
  verify_neighbours(NoiseChannel::depth, pixels, achieved.depth_neighbours);
}

void NoiseApplication::verify_flow(const PixelBatch& pixels, std::span<const int> body,
                                   std::span<const double> u, std::span<const double> v,
                                   const FlowArrays& noisy, const std::vector<unsigned char>& is_outlier) {
  FlowVerification* of_body = nullptr;
  int last_body = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (!std::isfinite(u[i]) || !std::isfinite(v[i])) continue;
    if (of_body == nullptr || body[i] != last_body) {
      last_body = body[i];
      of_body = &achieved.flow[last_body];
      of_body->requested = noise_.flow_sigma(last_body);
    }
    if (is_outlier[i] != 0) {
      ++of_body->n_outliers;
      continue;
    }
    const double dx = noisy.u[i] - u[i];
    const double dy = noisy.v[i] - v[i];
    of_body->x.add(dx);
    of_body->y.add(dy);
    of_body->sum_epe += std::sqrt(dx * dx + dy * dy);
  }
  verify_neighbours(NoiseChannel::flow, pixels, achieved.flow_neighbours);
}

void NoiseApplication::verify_neighbours(NoiseChannel channel, const PixelBatch& pixels,
                                         NeighbourSums& sums) const {
  std::vector<int> x, right_x, y;
  for (size_t i = 0; i < pixels.size(); i += neighbour_step) {
    x.push_back(pixels.x[i]);
    right_x.push_back(pixels.x[i] + 1);
    y.push_back(pixels.y[i]);
  }
  const size_t n = x.size();
  std::vector<double> here(n), right(n), unused(n);
  context_.normals(channel, {pixels.frame, x, y}, here, unused);
  context_.normals(channel, {pixels.frame, right_x, y}, right, unused);
  for (size_t i = 0; i < n; ++i) sums.add(here[i], right[i]);
}

/// Returns the corrupted depths of the current frame at the targets of the clean flow; NaN if there is none.
std::vector<double> NoiseApplication::depth_curr(const Pixels& pixels, const Correspondences& clean,
                                                 const FramePair& pair) {
  std::vector<size_t> of_point;
  Pixels targets;
  std::vector<double> depths;
  for (size_t i = 0; i < clean.size(); ++i) {
    if (!valid_depth(clean.depth_curr[i])) continue;
    const Flow flow{static_cast<float>(clean.flow_u[i]), static_cast<float>(clean.flow_v[i])};
    const TargetPixel target = target_pixel(pixels.x[i], pixels.y[i], flow, pair.width, pair.height);
    if (!target.inside) continue;
    of_point.push_back(i);
    targets.x.push_back(target.x);
    targets.y.push_back(target.y);
    depths.push_back(clean.depth_curr[i]);
  }
  const std::vector<double> noisy = depth(targets.batch(pair.curr), depths);
  std::vector<double> out(clean.size(), NAN);
  for (size_t i = 0; i < of_point.size(); ++i) out[of_point[i]] = noisy[i];
  return out;
}

Correspondences NoiseApplication::points(const Correspondences& clean, const FramePair& pair,
                                         const std::vector<int>& body, std::vector<unsigned char>& keep) {
  const Pixels pixels = pixels_of(clean);
  const PixelBatch batch = pixels.batch(pair.prev);
  Correspondences noisy = clean;
  noisy.depth = depth(batch, clean.depth);
  if (changes_depth_) noisy.depth_curr = depth_curr(pixels, clean, pair);
  std::vector<unsigned char> is_outlier(clean.size(), 0);
  FlowArrays flows = flow(batch, body, false, clean.flow_u, clean.flow_v, is_outlier);
  noisy.flow_u = std::move(flows.u);
  noisy.flow_v = std::move(flows.v);
  noisy.before_noise.resize(clean.size());
  std::iota(noisy.before_noise.begin(), noisy.before_noise.end(), size_t{0});
  keep.assign(clean.size(), 1);
  for (size_t i = 0; i < clean.size(); ++i) {
    if (is_outlier[i] != 0) noisy.depth_curr[i] = NAN;
    if (std::isnan(noisy.depth[i])) keep[i] = 0;
  }
  return noisy.subset(keep);
}

void NoiseApplication::frame_depth(Frame& frame, const Pixels& row_pixels, int y) {
  float* row = frame.depth_m.row(y);
  const std::vector<double> clean(row, row + frame.depth_m.width());
  const std::vector<double> noisy = depth(row_pixels.batch(frame.index), clean);
  for (size_t x = 0; x < noisy.size(); ++x) row[x] = static_cast<float>(noisy[x]);
}

void NoiseApplication::frame_flow(Image<Flow>& image, const Frame& frame, const Pixels& row_pixels, int y,
                                  bool backward) {
  Flow* row = image.row(y);
  const auto width = static_cast<size_t>(image.width());
  std::vector<double> u(width), v(width);
  std::vector<int> body(width, 0);
  for (size_t x = 0; x < width; ++x) {
    u[x] = row[x].u;
    v[x] = row[x].v;
    if (!frame.mask.empty()) body[x] = frame.mask(static_cast<int>(x), y);
  }
  std::vector<unsigned char> is_outlier(width, 0);
  const FlowArrays noisy = flow(row_pixels.batch(frame.index), body, backward, u, v, is_outlier);
  for (size_t x = 0; x < width; ++x) {
    row[x] = {static_cast<float>(noisy.u[x]), static_cast<float>(noisy.v[x])};
  }
}

void NoiseApplication::frame(Frame& frame) {
  const bool has_flow = !frame.flow.empty() || !frame.backward_flow.empty();
  if (needs_bodies_ && has_flow && frame.mask.empty()) {
    fail("noise: frame {} has no mask, which flow.bodies requires: give masks, or leave flow.bodies out",
         frame.index);
  }
  // The mask is corrupted before the flow, because the flow noise of a pixel depends on its id in the
  // corrupted mask, as it does for points.
  noise_.corrupt_mask(frame.mask);
  const auto rows = [&](const auto& image, auto corrupt) {
    Pixels pixels;
    for (int x = 0; x < image.width(); ++x) pixels.x.push_back(x);
    for (int y = 0; y < image.height(); ++y) {
      pixels.y.assign(image.width(), y);
      corrupt(pixels, y);
    }
  };
  if (changes_depth_) rows(frame.depth_m, [&](const Pixels& p, int y) { frame_depth(frame, p, y); });
  if (changes_flow_) {
    rows(frame.flow, [&](const Pixels& p, int y) { frame_flow(frame.flow, frame, p, y, false); });
    rows(frame.backward_flow,
         [&](const Pixels& p, int y) { frame_flow(frame.backward_flow, frame, p, y, true); });
  }
}

NoisyPair Noise::apply(const FramePair& pair, const Draws& draws) const {
  if (changes_masks()) {
    fail(
        "noise: masks determine which points exist: corrupt the masks of the frames before points are "
        "extracted");
  }
  NoiseApplication application(*this, pair.camera, draws);
  NoisyPair noisy{pair, {}};
  std::vector<unsigned char> keep;
  noisy.pair.background =
      application.points(pair.background, pair, std::vector<int>(pair.background.size(), 0), keep);
  for (ObjectObservation& object : noisy.pair.objects) {
    const std::vector<int> body(object.instance_prev.begin(), object.instance_prev.end());
    SEXTANT_CHECK(body.size() == object.points.size());
    object.points = application.points(object.points, pair, body, keep);
    size_t kept = 0;
    for (size_t i = 0; i < keep.size(); ++i) {
      if (keep[i] != 0) object.instance_prev[kept++] = object.instance_prev[i];
    }
    object.instance_prev.resize(kept);
  }
  if (!none()) declare(noisy.pair);
  noisy.achieved = std::move(application.achieved);
  return noisy;
}

void Noise::declare(FramePair& pair) const {
  pair.noise[0] = declared(pair.camera, 0);
  for (const ObjectObservation& object : pair.objects) {
    for (const uint16_t body : object.instance_prev) {
      if (!pair.noise.contains(body)) pair.noise[body] = declared(pair.camera, body);
    }
  }
}

NoisyFrame Noise::apply(const Frame& frame, const StereoCamera& camera, const Draws& draws) const {
  NoiseApplication application(*this, camera, draws);
  NoisyFrame noisy{frame, {}};
  application.frame(noisy.frame);
  noisy.achieved = std::move(application.achieved);
  return noisy;
}

namespace {

constexpr const char* correlation_key = "correlation";

void refuse_unknown_keys(const Json& options) {
  std::vector<std::string> known;
  for (const NoiseModelEntry& entry : noise_models()) known.push_back(entry.name);
  for (const char* key : {correlation_key, "profile", "scale"}) known.emplace_back(key);
  for (const auto& item : options.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      fail("unknown option key 'noise.{}': {}", item.key(), suggest(item.key(), known));
    }
  }
}

}  // namespace

Noise::Noise(const Json& given) {
  if (!given.is_object()) fail("option noise: expected an object, got {}", json_excerpt(given));
  const Json options = without_profile(given);
  refuse_unknown_keys(options);
  if (options.contains(correlation_key))
    correlation_ = NoiseCorrelation::read(options.at(correlation_key), "noise.correlation");
  for (const NoiseModelEntry& entry : noise_models()) {
    if (!options.contains(entry.name)) continue;
    std::shared_ptr<const NoiseModel> model = entry.make(options.at(entry.name));
    if (model->changes_depth() || model->changes_flow() || model->changes_masks())
      models_.push_back({entry.name, std::move(model)});
  }
}

Noise Noise::parse(std::string_view text) {
  if (text.empty() || text == "none") return Noise();
  Json options;
  try {
    options = parse_json(text, "noise");
  } catch (const Error& error) {
    fail("{}: expected none or an object such as {}", error.what(), R"({"depth":{"delta_d_px":0.2}})");
  }
  return Noise(options);
}

Json Noise::options() const {
  Json json = Json::object();
  for (const NamedModel& named : models_) json[named.key] = named.model->options();
  if (!none()) json[correlation_key] = correlation_.json();
  return json;
}

std::string Noise::name() const {
  std::string text;
  for (const NamedModel& named : models_) text += (text.empty() ? "" : " + ") + named.model->name();
  return text.empty() ? "none" : text + correlation_.name();
}

bool Noise::changes_masks() const {
  return std::any_of(models_.begin(), models_.end(), [](const auto& m) { return m.model->changes_masks(); });
}

Noise Noise::without_masks() const {
  Noise rest = *this;
  std::erase_if(rest.models_, [](const auto& m) { return m.model->changes_masks(); });
  return rest;
}

Noise Noise::only_masks() const {
  Noise masks = *this;
  std::erase_if(masks.models_, [](const auto& m) { return !m.model->changes_masks(); });
  return masks;
}

void Noise::corrupt_mask(Image<uint16_t>& mask) const {
  for (const NamedModel& named : models_) named.model->corrupt_mask(mask);
}

double Noise::depth_sigma_m(const StereoCamera& camera, double depth_m) const {
  double variance = 0;
  for (const NamedModel& named : models_) {
    const double sigma = named.model->depth_sigma_m(camera, depth_m);
    variance += sigma * sigma;
  }
  return std::sqrt(variance);
}

FlowSigma Noise::flow_sigma(int body) const {
  FlowSigma variance;
  for (const NamedModel& named : models_) {
    const FlowSigma sigma = named.model->flow_sigma(body);
    variance.x_px += sigma.x_px * sigma.x_px;
    variance.y_px += sigma.y_px * sigma.y_px;
  }
  return {std::sqrt(variance.x_px), std::sqrt(variance.y_px)};
}

std::string Noise::baseline_warning(const StereoCamera& camera) const {
  constexpr double alike = 1.2;  // KITTI's 0.54 m and the paper's 0.5 m are alike
  const Json of_models = options();
  const double assumed_m = of_models.contains("depth") ? of_models["depth"].value("baseline_m", 0.0) : 0;
  const double own_m = camera.bf / camera.left.fx;
  if (!(assumed_m > 0 && own_m > 0) || std::abs(std::log(assumed_m / own_m)) < std::log(alike)) return "";
  return fmt::format(
      "the depth noise is that of a stereo baseline of {:g} m, but the baseline of the camera is {:.3g} m: "
      "set depth.baseline_m of the noise to 0 for the noise of the camera's own disparities",
      assumed_m, own_m);
}

MeasurementNoise Noise::declared(const StereoCamera& camera, int body) const {
  constexpr double unit_m = 1;  // every depth model is proportional to depth squared
  const FlowSigma flow = flow_sigma(body);
  MeasurementNoise noise{flow.x_px, flow.y_px};
  double depth_variance = std::pow(depth_sigma_m(camera, unit_m), 2);
  bool rounded = false;
  for (const NamedModel& named : models_) {
    const double rounding = named.model->depth_rounding_sigma_m(camera, unit_m);
    depth_variance += rounding * rounding;
    rounded = rounded || rounding > 0;
    noise.flow_outlier_share = 1 - (1 - noise.flow_outlier_share) * (1 - named.model->outlier_share());
  }
  noise.inverse_depth_per_m = std::sqrt(depth_variance);
  noise.correlation = correlation_.spatial();
  noise.gaussian = !rounded && noise.flow_outlier_share == 0;
  noise.independent_gaussian = noise.gaussian && correlation_.independent();
  return noise;
}

std::vector<OptionHelp> describe_noise_options() {
  std::vector<OptionHelp> lines;
  for (const NoiseModelEntry& entry : noise_models()) {
    for (OptionHelp& line : entry.options()) lines.push_back(std::move(line));
  }
  lines.push_back(
      {"noise.correlation", "\"independent\"", "",
       "independent, shared_per_frame or spatial: {\"model\": \"spatial\", \"lengths_px\": [...], "
       "\"shares\": [...]}"});
  lines.push_back({"noise.profile", "", "",
                   fmt::format("measured noise, whose models the options above replace: {}; or a file that "
                               "`sextant noise fit` wrote",
                               fmt::join(noise_profile_names(), ", "))});
  lines.push_back({"noise.scale", "1", "1",
                   "factor on the EPE, delta_d, disparity step and outlier radius of the profile"});
  return lines;
}

}  // namespace sextant
