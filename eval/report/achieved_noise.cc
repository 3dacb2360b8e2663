#include "sextant/eval/report/achieved_noise.h"

#include <algorithm>

namespace sextant {
namespace {

/// Returns the number at a JSON pointer such as "/depth/n", if there is one.
std::optional<double> number_at(const Json& json, const char* path) {
  const Json::json_pointer pointer(path);
  if (!json.contains(pointer) || !json.at(pointer).is_number()) return std::nullopt;
  return json.at(pointer).get<double>();
}

void add_depth(const AchievedNoise& entry, AchievedNoiseRow row, std::vector<AchievedNoiseRow>& rows) {
  const auto requested = number_at(entry.noise, "/requested/depth/delta_d_px");
  const auto achieved = number_at(entry.noise, "/depth/normalised_sigma");
  row.share_invalidated = number_at(entry.noise, "/depth/share_invalidated");
  if ((!requested || !achieved) && !row.share_invalidated) return;
  row.channel = "depth";
  if (requested && achieved) {
    row.requested_px = *requested;
    row.achieved_px = *achieved * *requested;
  }
  row.n = number_at(entry.noise, "/depth/n").value_or(0);
  row.neighbours = number_at(entry.noise, "/neighbours/depth/correlation");
  rows.push_back(row);
}

void add_flow(const AchievedNoise& entry, const std::string& body, const Json& flow, AchievedNoiseRow row,
              std::vector<AchievedNoiseRow>& rows) {
  row.body = body;
  row.n = number_at(flow, "/n").value_or(0);
  row.outlier_share = number_at(flow, "/outlier_share");
  const size_t n_before = rows.size();
  const auto add = [&](const char* channel, std::optional<double> requested, std::optional<double> achieved) {
    if (!requested || !achieved) return;
    row.channel = channel;
    row.requested_px = *requested;
    row.achieved_px = *achieved;
    rows.push_back(row);
  };
  add("flow EPE", number_at(flow, "/requested_epe_px"), number_at(flow, "/epe_px"));
  add("flow y", number_at(flow, "/y/requested_sigma_px"), number_at(flow, "/y/sigma_px"));
  row.neighbours = number_at(entry.noise, "/neighbours/flow_x/correlation");
  add("flow x", number_at(flow, "/x/requested_sigma_px"), number_at(flow, "/x/sigma_px"));
  if (rows.size() > n_before || row.outlier_share.value_or(0) == 0) return;
  // Every flow is an outlier, so none shows the noise.
  row.channel = "flow";
  row.requested_px.reset();
  row.achieved_px.reset();
  rows.push_back(row);
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
  using Row = AchievedNoiseRow;
  const bool has_folders =
      std::ranges::any_of(rows, [&](const Row& row) { return row.file != rows.front().file; });
  Fields<Row> fields = {{Column::text("parameter").folded(), &Row::parameter},
                        {Column::text("source").folded(), &Row::source},
                        {Column::number("level", 3), &Row::level},
                        {Column::text("body").folded(), &Row::body},
                        {Column::text("channel"), &Row::channel},
                        {Column::number("requested_px", "requested [px]", 4), &Row::requested_px},
                        {Column::number("achieved_px", "achieved [px]", 4), &Row::achieved_px},
                        {Column::number("ratio", 4),
                         [](const Row& row) {
                           const bool has_ratio = row.requested_px.value_or(0) > 0 && row.achieved_px;
                           return has_ratio ? Cell(*row.achieved_px / *row.requested_px) : Cell();
                         }},
                        {Column::count("n", "draws"), &Row::n},
                        {Column::number("neighbours", 4), &Row::neighbours},
                        {Column::number("share_invalidated", "invalidated", 6), &Row::share_invalidated},
                        {Column::number("outlier_share", "outliers", 4), &Row::outlier_share}};
  if (has_folders) {  // such as shards, each of which added noise to other cases of one level
    fields.insert(fields.begin(), {Column::text("folder"),
                                   [](const Row& row) { return Cell(row.file.parent_path().string()); }});
  }
  return with_distinct(
      table_of(
          "Noise: requested and achieved",
          "Depth: disparity accuracy. Flow x, y: standard deviation; EPE: mean length of the error vector. "
          "neighbours: correlation of the random draws of neighbouring pixels. Achieved depths include the "
          "rounding of a quantisation, which is not part of the request.",
          fields, rows),
      {"level"});
}

}  // namespace sextant
