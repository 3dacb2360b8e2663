#include "sextant/eval/report/claims/noise_claims.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

constexpr size_t n_paper_objects = 3;
constexpr double stereo_camera_px = 0.2;  // "normally 0.1 to 0.2 for a standard industrial stereo camera"
constexpr double nearly = 0.25;

struct ErrorKind {
  const char* key;
  const char* title;
  double low_limit;  ///< fig. 4 left
  double highest;    ///< fig. 4 right
};
constexpr std::array<ErrorKind, 2> error_kinds = {
    {{"Et_m", "E_t [m]", 0.02, 0.09}, {"ER_deg", "E_R [deg]", 0.04, 0.2}}};

/// Sum and count of one error at one level of one seed.
struct Cellsum {
  double sum = 0;
  double n = 0;
};

/// One body of the paper's figure under one estimator.
struct Body {
  std::string title;
  std::vector<const Record*> records;  ///< estimated, with truth
};

/// One figure of the paper: a sequence under one estimator.
struct Panel {
  std::string dataset, sequence, estimator;
  std::vector<Body> bodies;  ///< camera, then objects by distance
};

using Records = std::vector<const Record*>;

double mean_distance_m(const Records& records) {
  double sum = 0;
  double n = 0;
  for (const Record* record : records) {
    if (const auto value = find_number(record->values, "distance_gt_m")) {
      sum += *value;
      n += 1;
    }
  }
  return n > 0 ? sum / n : 0;
}

/// The camera and the nearest objects, as the paper counts them.
std::vector<Body> paper_bodies(const std::map<int, Records>& by_body) {
  std::vector<Body> bodies;
  std::vector<std::pair<double, int>> by_distance;
  for (const auto& [id, records] : by_body) {
    if (id == 0) bodies.push_back({"camera", records});
    if (id != 0) by_distance.emplace_back(mean_distance_m(records), id);
  }
  std::sort(by_distance.begin(), by_distance.end());
  for (size_t i = 0; i < std::min(n_paper_objects, by_distance.size()); ++i) {
    const int id = by_distance[i].second;
    bodies.push_back({fmt::format("object {} (id {})", i + 1, id), by_body.at(id)});
  }
  return bodies;
}

std::vector<Panel> panels_of(const std::vector<NoiseSweep>& sweeps, const std::string& parameter) {
  std::map<std::tuple<std::string, std::string, std::string>, std::map<int, Records>> by_panel;
  for (const NoiseSweep& sweep : sweeps) {
    if (sweep.parameter != parameter) continue;
    for (const Record& r : sweep.records) {
      if (r.status != Status::ok || !has_truth(r) || !r.errors.contains("Et_m")) continue;
      by_panel[{r.dataset, r.sequence, r.estimator}][body_order(r)].push_back(&r);
    }
  }
  std::vector<Panel> panels;
  for (const auto& [key, by_body] : by_panel) {
    panels.push_back({std::get<0>(key), std::get<1>(key), std::get<2>(key), paper_bodies(by_body)});
  }
  return panels;
}

ClaimResult result_for(const Panel& panel, const std::string& subject, const std::string& quantity,
                       const std::string& stated) {
  ClaimResult result;
  result.dataset = panel.dataset;
  result.sequence = panel.sequence;
  result.estimator = panel.estimator;
  result.subject = subject;
  result.quantity = quantity;
  result.stated = stated;
  return result;
}

/// Sums of one error by cluster and level, so that statistics of resampled seeds are cheap.
class LevelMeans {
 public:
  LevelMeans(const Records& records, const std::string& key, double max_level) {
    const Clusters clusters(records);
    for (const Record* record : records) {
      const auto value = find_number(record->errors, key);
      if (!value || record->level > max_level) continue;
      Cellsum& cell = cells_[clusters.of(*record)][record->level];
      cell.sum += *value;
      cell.n += 1;
    }
    for (const auto& [label, levels] : cells_) by_cluster_.push_back(&levels);
  }
  bool empty() const { return by_cluster_.empty(); }
  size_t n_clusters() const { return by_cluster_.size(); }

  /// Mean by level over the clusters with these indices.
  std::map<double, double> means(std::span<const size_t> clusters) const {
    std::map<double, Cellsum> sums;
    for (const size_t c : clusters) {
      for (const auto& [level, cell] : *by_cluster_[c]) {
        sums[level].sum += cell.sum;
        sums[level].n += cell.n;
      }
    }
    std::map<double, double> means;
    for (const auto& [level, cell] : sums) means[level] = cell.sum / cell.n;
    return means;
  }
  double largest(std::span<const size_t> clusters) const {
    double max = 0;
    for (const auto& [level, mean] : means(clusters)) max = std::max(max, mean);
    return max;
  }
  double at_highest_level(std::span<const size_t> clusters) const { return means(clusters).rbegin()->second; }
  /// Least squares line through the means.
  double slope(std::span<const size_t> clusters) const {
    const std::map<double, double> points = means(clusters);
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const auto& [level, mean] : points) {
      n += 1;
      x += level;
      y += mean;
      xx += level * level;
      xy += level * mean;
    }
    return points.size() < 2 ? 0 : (xy - x * y / n) / (xx - x * x / n);
  }

 private:
  std::map<uint64_t, std::map<double, Cellsum>> cells_;
  std::vector<const std::map<double, Cellsum>*> by_cluster_;
};

constexpr double all_levels = std::numeric_limits<double>::infinity();

void measure(size_t n_clusters, const ClusterStatistic& statistic, ClaimResult& result) {
  std::vector<size_t> all(n_clusters);
  for (size_t i = 0; i < all.size(); ++i) all[i] = i;
  result.value = statistic(all);
  result.interval = cluster_bootstrap(n_clusters, statistic);
}

bool has_two_levels(const Records& records) {
  return std::ranges::any_of(records, [&](const Record* r) { return r->level != records.front()->level; });
}

/// LevelMeans of the paper's four bodies, where the panel has them all with the same seeds.
std::vector<LevelMeans> four_bodies(const Panel& panel, const char* key) {
  std::vector<LevelMeans> means;
  if (panel.bodies.size() != 1 + n_paper_objects) return means;
  for (const Body& body : panel.bodies) {
    if (!has_two_levels(body.records)) return {};
    means.emplace_back(body.records, key, all_levels);
    if (means.back().n_clusters() != means.front().n_clusters()) return {};
  }
  return means;
}

}  // namespace

std::vector<ClaimResult> check_depth_noise_low(const std::vector<NoiseSweep>& sweeps) {
  std::vector<ClaimResult> results;
  for (const Panel& panel : panels_of(sweeps, "depth.delta_d_px")) {
    for (const Body& body : panel.bodies) {
      for (const ErrorKind& kind : error_kinds) {
        for (const double max_level : {stereo_camera_px, all_levels}) {
          const LevelMeans means(body.records, kind.key, max_level);
          if (means.empty()) continue;
          const std::string range =
              max_level == all_levels ? "all levels" : fmt::format("\u0394d \u2264 {}", max_level);
          ClaimResult result =
              result_for(panel, body.title, fmt::format("largest mean {}, {}", kind.title, range),
                         fmt::format("< {}", kind.low_limit));
          measure(
              means.n_clusters(), [&](std::span<const size_t> c) { return means.largest(c); }, result);
          result.verdict = is_below(kind.low_limit, result.value, result.interval);
          results.push_back(std::move(result));
        }
      }
    }
  }
  return results;
}

std::vector<ClaimResult> check_depth_noise_gradual(const std::vector<NoiseSweep>& sweeps) {
  std::vector<ClaimResult> results;
  for (const Panel& panel : panels_of(sweeps, "depth.delta_d_px")) {
    for (const Body& body : panel.bodies) {
      if (!has_two_levels(body.records)) continue;
      const LevelMeans means(body.records, "Et_m", all_levels);
      ClaimResult result = result_for(panel, body.title, "slope of E_t [m/px]", "> 0");
      measure(
          means.n_clusters(), [&](std::span<const size_t> c) { return means.slope(c); }, result);
      result.verdict = is_above(0, result.value, result.interval);
      results.push_back(std::move(result));
    }
  }
  return results;
}

std::vector<ClaimResult> check_flow_noise_far_objects(const std::vector<NoiseSweep>& sweeps) {
  std::vector<ClaimResult> results;
  for (const Panel& panel : panels_of(sweeps, "flow.scale")) {
    for (const ErrorKind& kind : error_kinds) {
      const std::vector<LevelMeans> means = four_bodies(panel, kind.key);
      if (means.empty()) continue;
      ClaimResult result = result_for(panel, "objects 2, 3 - camera, object 1",
                                      fmt::format("smallest difference of slopes, {}", kind.title), "> 0");
      const auto difference = [&](std::span<const size_t> c) {
        return std::min(means[2].slope(c), means[3].slope(c)) -
               std::max(means[0].slope(c), means[1].slope(c));
      };
      measure(means[0].n_clusters(), difference, result);
      result.verdict = is_above(0, result.value, result.interval);
      results.push_back(std::move(result));
    }
  }
  return results;
}

std::vector<ClaimResult> check_flow_noise_highest(const std::vector<NoiseSweep>& sweeps) {
  std::vector<ClaimResult> results;
  for (const Panel& panel : panels_of(sweeps, "flow.scale")) {
    for (const ErrorKind& kind : error_kinds) {
      const std::vector<LevelMeans> means = four_bodies(panel, kind.key);
      if (means.empty()) continue;
      ClaimResult result =
          result_for(panel, "objects 2, 3", fmt::format("mean {} at the highest level", kind.title),
                     fmt::format("nearly {}", kind.highest));
      const auto larger = [&](std::span<const size_t> c) {
        return std::max(means[2].at_highest_level(c), means[3].at_highest_level(c));
      };
      measure(means[0].n_clusters(), larger, result);
      result.verdict =
          is_between((1 - nearly) * kind.highest, (1 + nearly) * kind.highest, result.value, result.interval);
      results.push_back(std::move(result));
    }
  }
  return results;
}

}  // namespace sextant
