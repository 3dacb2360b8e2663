#include "sextant/eval/evaluation/evo_result.h"

#include <cstring>

#include "sextant/base/options.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/records/zip_file.h"

namespace sextant {
namespace {

std::vector<double> distances_of(const PoseSeries& poses, const std::vector<int>& rows) {
  std::vector<double> path(poses.size(), 0.0), out;
  for (size_t i = 1; i < poses.size(); ++i)
    path[i] = path[i - 1] + (poses.positions_m[i] - poses.positions_m[i - 1]).norm();
  for (const int row : rows) out.push_back(path[static_cast<size_t>(row)]);
  return out;
}

std::string title_of(const EgoResult& result, const EgoOptions& options) {
  std::string title = fmt::format("{} w.r.t. {} ({})", options.rpe ? "RPE" : "APE",
                                  to_string(options.relation), unit_of(options.relation));
  if (options.rpe) {
    title += fmt::format("\nfor delta = {} using {} pairs", options.rpe->text(),
                         options.rpe->all_pairs ? "all" : "consecutive");
  }
  return title +
         fmt::format("\n(alignment: {}, {} poses)", to_string(options.alignment), result.estimate.size());
}

}  // namespace

std::string encode_npy(std::span<const double> values, size_t columns) {
  const std::string shape = columns == 0 ? fmt::format("({},)", values.size())
                                         : fmt::format("({}, {})", values.size() / columns, columns);
  std::string out = npy_header("<f8", shape);
  const size_t at = out.size();
  out.resize(at + values.size_bytes());
  std::memcpy(out.data() + at, values.data(), values.size_bytes());
  return out;
}

void write_evo_result(const std::filesystem::path& path, const EgoResult& result, const EgoOptions& options,
                      const std::string& reference_name) {
  ZipFile zip(path);
  const Json info = {
      {"title", title_of(result, options)},
      {"ref_name", reference_name},
      {"est_name", result.name},
      {"label", fmt::format("{} ({})", options.rpe ? "RPE" : "APE", unit_of(options.relation))}};
  zip.add("info.json", json_line(info));
  zip.add("stats.json", json_line(to_json(result.statistics)));
  zip.add("error_array.npy", encode_npy(result.errors));
  std::vector<int>
      rows;  // matched rows that the errors belong to; a relative error belongs to its second pose
  for (size_t i = 0; i < result.errors.size(); ++i)
    rows.push_back(result.pairs.empty() ? static_cast<int>(i) : result.pairs[i].second);
  if (!result.estimate.stamps_s.empty()) {
    std::vector<double> stamps, seconds;
    for (const int row : rows) {
      stamps.push_back(result.estimate.stamps_s[static_cast<size_t>(row)]);
      seconds.push_back(stamps.back() - result.estimate.stamps_s[0]);
    }
    zip.add("timestamps.npy", encode_npy(stamps));
    zip.add("seconds_from_start.npy", encode_npy(seconds));
    zip.add("distances_from_start.npy", encode_npy(distances_of(result.reference, rows)));
    zip.add("distances.npy", encode_npy(distances_of(result.estimate, rows)));
  }
  if (options.alignment != Alignment::none) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = result.alignment.ref_from_est.matrix();
    zip.add("alignment_transformation_sim3.npy", encode_npy({m.data(), 16}, 4));
  }
  zip.finish();
}

}  // namespace sextant
