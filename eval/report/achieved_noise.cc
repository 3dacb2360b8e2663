#include "sextant/eval/report/achieved_noise.h"

namespace sextant {
namespace {

/// The number at a path of keys, if there is one.
std::optional<double> number_at(const Json& json, std::initializer_list<const char*> path) {
  const Json* at = &json;
  for (const char* key : path) {
    if (!at->is_object() || !at->contains(key)) return std::nullopt;
    at = &(*at)[key];
  }
  return at->is_number() ? std::optional<double>(at->get<double>()) : std::nullopt;
}

void add_depth(const AchievedNoise& entry, AchievedNoiseRow row, std::vector<AchievedNoiseRow>& rows) {
  const auto requested = number_at(entry.noise, {"requested", "depth", "delta_d_px"});
  const auto achieved = number_at(entry.noise, {"depth", "normalised_sigma"});
  if (!requested || !achieved) return;
  row.channel = "depth";
  row.requested_px = *requested;
  row.achieved_px = *achieved * *requested;
  row.n = number_at(entry.noise, {"depth", "n"}).value_or(0);
  row.neighbours = number_at(entry.noise, {"neighbours", "depth", "correlation"});
  row.share_invalidated = number_at(entry.noise, {"depth", "share_invalidated"});
  rows.push_back(row);
}

void add_flow(const AchievedNoise& entry, const std::string& body, const Json& flow, AchievedNoiseRow row,
              std::vector<AchievedNoiseRow>& rows) {
  row.body = body;
  row.n = number_at(flow, {"n"}).value_or(0);
  row.outlier_share = number_at(flow, {"outlier_share"});
  const auto add = [&](const char* channel, std::optional<double> requested, std::optional<double> achieved) {
    if (!requested || !achieved) return;
    row.channel = channel;
    row.requested_px = *requested;
    row.achieved_px = *achieved;
    rows.push_back(row);
  };
  add("flow EPE", number_at(flow, {"requested_epe_px"}), number_at(flow, {"epe_px"}));
  add("flow y", number_at(flow, {"y", "requested_sigma_px"}), number_at(flow, {"y", "sigma_px"}));
  row.neighbours = number_at(entry.noise, {"neighbours", "flow_x", "correlation"});
  add("flow x", number_at(flow, {"x", "requested_sigma_px"}), number_at(flow, {"x", "sigma_px"}));
}

}  // namespace

std::vector<AchievedNoiseRow> achieved_noise_rows(const NoiseSweep& sweep) {
  std::vector<AchievedNoiseRow> rows;
  for (const AchievedNoise& entry : sweep.achieved) {
    AchievedNoiseRow row{.parameter = sweep.parameter,
                         .source = entry.source,
                         .body = "all",
                         .file = entry.file,
                         .level = entry.level};
    add_depth(entry, row, rows);
    if (!entry.noise.contains("flow") || !entry.noise["flow"].is_object()) continue;
    for (const auto& [body, flow] : entry.noise["flow"].items()) add_flow(entry, body, flow, row, rows);
  }
  return rows;
}

Table achieved_noise_table(const std::vector<AchievedNoiseRow>& rows) {
  Table table{
      "Noise: requested and achieved",
      "Depth: disparity accuracy. Flow x, y: standard deviation; EPE: mean length of the error vector. "
      "neighbours: correlation between neighbouring pixels.",
      folded_columns({"parameter", "source"})};
  table.columns.push_back(Column::number("level", 3));
  table.add_columns(folded_columns({"body"}));
  table.add_columns({Column::text("channel"), Column::number("requested_px", "requested [px]", 4),
                     Column::number("achieved_px", "achieved [px]", 4), Column::number("ratio", 4),
                     Column::count("n", "draws"), Column::number("neighbours", 4),
                     Column::number("share_invalidated", "invalidated", 6),
                     Column::number("outlier_share", "outliers", 4)});
  for (const AchievedNoiseRow& row : rows) {
    std::optional<double> ratio;
    if (row.requested_px > 0) ratio = row.achieved_px / row.requested_px;
    table.add_row({row.parameter, row.source, row.level, row.body, row.channel, row.requested_px,
                   row.achieved_px, ratio, row.n, row.neighbours, row.share_invalidated, row.outlier_share});
  }
  return table;
}

}  // namespace sextant
