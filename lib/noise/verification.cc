#include "sextant/noise/verification.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sextant {
namespace {

void put(Json& json, const char* key, const std::optional<double>& value) {
  if (value) json[key] = *value;
}

Json axis_json(const MomentSums& axis, double requested_sigma_px) {
  Json json;
  json["requested_sigma_px"] = requested_sigma_px;
  put(json, "sigma_px", axis.sigma());
  json["requested_mean_abs_px"] = requested_sigma_px * std::sqrt(2 / std::numbers::pi);
  put(json, "mean_abs_px", axis.mean_abs());
  put(json, "mean_px", axis.mean());
  return json;
}

Json flow_json(const FlowVerification& flow) {
  Json json;
  json["n"] = flow.n();
  json["x"] = axis_json(flow.x, flow.requested.x_px);
  json["y"] = axis_json(flow.y, flow.requested.y_px);
  json["requested_epe_px"] = expected_epe_px(flow.requested);
  put(json, "epe_px", flow.epe_px());
  put(json, "outlier_share", flow.outlier_share());
  return json;
}

Json depth_json(const DepthVerification& depth) {
  Json json;
  json["n"] = depth.n_valid;
  put(json, "normalised_mean", depth.normalised.mean());
  put(json, "normalised_sigma", depth.normalised.sigma());
  json["n_invalidated"] = depth.n_invalidated;
  put(json, "share_invalidated", depth.share_invalidated());
  return json;
}

Json neighbours_json(const NeighbourSums& sums) {
  Json json;
  json["n"] = sums.n;
  put(json, "correlation", sums.correlation());
  return json;
}

}  // namespace

void MomentSums::add(double value) {
  ++n;
  sum += value;
  sum_squares += value * value;
  sum_abs += std::abs(value);
}

void MomentSums::merge(const MomentSums& other) {
  n += other.n;
  sum += other.sum;
  sum_squares += other.sum_squares;
  sum_abs += other.sum_abs;
}

std::optional<double> MomentSums::mean() const {
  if (n == 0) return std::nullopt;
  return sum / static_cast<double>(n);
}

std::optional<double> MomentSums::mean_abs() const {
  if (n == 0) return std::nullopt;
  return sum_abs / static_cast<double>(n);
}

std::optional<double> MomentSums::sigma() const {
  if (n < 2) return std::nullopt;
  const auto count = static_cast<double>(n);
  return std::sqrt(std::max(0.0, sum_squares - sum * sum / count) / (count - 1));
}

void NeighbourSums::add(double a, double b) {
  ++n;
  ab += a * b;
  aa += a * a;
  bb += b * b;
}

void NeighbourSums::merge(const NeighbourSums& other) {
  n += other.n;
  ab += other.ab;
  aa += other.aa;
  bb += other.bb;
}

std::optional<double> NeighbourSums::correlation() const {
  if (!(aa > 0) || !(bb > 0)) return std::nullopt;
  return ab / std::sqrt(aa * bb);
}

std::optional<double> DepthVerification::share_invalidated() const {
  if (n_valid == 0) return std::nullopt;
  return static_cast<double>(n_invalidated) / static_cast<double>(n_valid);
}

std::optional<double> FlowVerification::epe_px() const {
  if (x.n == 0) return std::nullopt;
  return sum_epe / static_cast<double>(x.n);
}

std::optional<double> FlowVerification::outlier_share() const {
  if (n() == 0) return std::nullopt;
  return static_cast<double>(n_outliers) / static_cast<double>(n());
}

double expected_epe_px(const FlowSigma& sigma) {
  const double large = std::max(sigma.x_px, sigma.y_px);
  const double small = std::min(sigma.x_px, sigma.y_px);
  if (large == 0) return 0;
  const double modulus = std::sqrt(1 - (small / large) * (small / large));
  return std::sqrt(2 / std::numbers::pi) * large * std::comp_ellint_2(modulus);
}

void NoiseVerification::merge(const NoiseVerification& later) {
  depth.normalised.merge(later.depth.normalised);
  depth.n_valid += later.depth.n_valid;
  depth.n_invalidated += later.depth.n_invalidated;
  for (const auto& [body, other] : later.flow) {
    FlowVerification& mine = flow[body];
    mine.requested = other.requested;
    mine.x.merge(other.x);
    mine.y.merge(other.y);
    mine.sum_epe += other.sum_epe;
    mine.n_outliers += other.n_outliers;
  }
  depth_neighbours.merge(later.depth_neighbours);
  flow_neighbours.merge(later.flow_neighbours);
}

Json NoiseVerification::json(const Json& requested) const {
  Json json;
  json["requested"] = requested;
  if (depth.n_valid > 0) json["depth"] = depth_json(depth);
  for (const auto& [body, verification] : flow) {
    const std::string name = body == 0 ? "background" : fmt::format("object:{}", body);
    json["flow"][name] = flow_json(verification);
  }
  if (depth_neighbours.n > 0) json["neighbours"]["depth"] = neighbours_json(depth_neighbours);
  if (flow_neighbours.n > 0) json["neighbours"]["flow_x"] = neighbours_json(flow_neighbours);
  return json;
}

Json NoiseVerification::sums() const {
  Json json = {{"depth", write_options(depth)}, {"flow", Json::array()}};
  for (const auto& [body, verification] : flow)
    json["flow"].push_back({{"body", body}, {"sums", write_options(verification)}});
  json["depth_neighbours"] = write_options(depth_neighbours);
  json["flow_neighbours"] = write_options(flow_neighbours);
  return json;
}

NoiseVerification NoiseVerification::from_sums(const Json& json, const std::string& where) {
  NoiseVerification noise;
  const auto part = [&](const Json& owner, const char* key, auto& sums) {
    read_options(json_object(owner, key, where), sums, fmt::format("{}: {}", where, key));
  };
  part(json, "depth", noise.depth);
  for (const Json& entry : json_list(json, "flow", where))
    part(entry, "sums", noise.flow[json_member<int>(entry, "body", where)]);
  part(json, "depth_neighbours", noise.depth_neighbours);
  part(json, "flow_neighbours", noise.flow_neighbours);
  return noise;
}

}  // namespace sextant
