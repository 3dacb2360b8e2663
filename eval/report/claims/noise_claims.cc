#include "sextant/eval/report/claims/noise_claims.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_sets.h"

namespace sextant {
namespace {

constexpr size_t n_paper_objects = 3;
constexpr double stereo_camera_px = 0.2;  // "normally 0.1 to 0.2 for a standard industrial stereo camera"
constexpr double nearly = 0.25;

struct ErrorKind {
  const char* key;
  double low_limit;  ///< fig. 4 left
  double highest;    ///< fig. 4 right

  std::string title() const { return metric(NumberMap::errors, key).heading(); }
};
constexpr std::array<ErrorKind, 2> error_kinds = {{{"Et_m", 0.02, 0.09}, {"ER_deg", 0.04, 0.2}}};

/// Sum and count of one error at one level of one seed.
struct Cellsum {
  double sum = 0;
  double n = 0;
};

/// One body of the paper's figure under one estimator.
struct Body {
  std::string title;
  RecordRefs records;  ///< estimated, with truth
};

/// One figure of the paper: a sequence under one estimator.
struct Panel {
  std::string dataset, sequence, estimator;
  std::vector<Body> bodies;  ///< camera, then objects by distance
};

/// The camera and the nearest objects, as the paper counts them.
std::vector<Body> figure_bodies(const RecordRefs& records) {
  std::vector<Body> bodies;
  for (PaperBody& body : bodies_by_distance(records)) {
    if (body.number > n_paper_objects) break;
    const std::string object = fmt::format("object {} (id {})", body.number, body.id);
    bodies.push_back({body.number == 0 ? "camera" : object, std::move(body.records)});
  }
  return bodies;
}

std::vector<Panel> panels_of(const std::vector<NoiseSweep>& sweeps, const std::string& parameter) {
  std::map<std::tuple<std::string, std::string, std::string>, RecordRefs> by_panel;
  for (const NoiseSweep& sweep : sweeps) {
    if (sweep.parameter != parameter) continue;
    for (const Record& r : sweep.records) {
      if (r.status != Status::ok || !has_truth(r) || !r.errors.contains("Et_m")) continue;
      by_panel[{r.dataset, r.sequence, r.estimator}].push_back(&r);
    }
  }
  std::vector<Panel> panels;
  for (const auto& [key, records] : by_panel)
    panels.push_back({std::get<0>(key), std::get<1>(key), std::get<2>(key), figure_bodies(records)});
  return panels;
}

ClaimResult result_for(const Panel& panel, const std::string& subject, const std::string& quantity,
                       const std::string& stated) {
  return {panel.dataset, panel.sequence, panel.estimator, subject, quantity, stated};
}

/// Sums of one error by cluster and level, so that statistics of resampled seeds are cheap.
class LevelMeans {
 public:
  LevelMeans(const RecordRefs& records, const std::string& key, double max_level) {
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

bool has_two_levels(const RecordRefs& records) {
  return std::ranges::any_of(records, [&](const Record* r) { return r->level != records.front()->level; });
}

/// Camera and objects 1, 2, 3.
using FourBodies = std::vector<LevelMeans>;

/// A result for each sequence, estimator and error in which the paper's four bodies are there with the same
/// seeds.
template <typename Check>
std::vector<ClaimResult> of_four_bodies(const std::vector<NoiseSweep>& sweeps, const Check& check) {
  std::vector<ClaimResult> results;
  for (const Panel& panel : panels_of(sweeps, "flow.scale")) {
    if (panel.bodies.size() != 1 + n_paper_objects) continue;
    if (!std::ranges::all_of(panel.bodies, [](const Body& b) { return has_two_levels(b.records); })) continue;
    for (const ErrorKind& kind : error_kinds) {
      FourBodies means;
      for (const Body& body : panel.bodies) means.emplace_back(body.records, kind.key, all_levels);
      const auto same = [&](const LevelMeans& m) { return m.n_clusters() == means.front().n_clusters(); };
      if (std::ranges::all_of(means, same)) results.push_back(check(panel, kind, means));
    }
  }
  return results;
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
              result_for(panel, body.title, fmt::format("largest mean {}, {}", kind.title(), range),
                         fmt::format("< {}", kind.low_limit));
          result.set(cluster_estimate(means.n_clusters(),
                                      [&](std::span<const size_t> c) { return means.largest(c); }));
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
      result.set(
          cluster_estimate(means.n_clusters(), [&](std::span<const size_t> c) { return means.slope(c); }));
      result.verdict = is_above(0, result.value, result.interval);
      results.push_back(std::move(result));
    }
  }
  return results;
}

std::vector<ClaimResult> check_flow_noise_far_objects(const std::vector<NoiseSweep>& sweeps) {
  return of_four_bodies(sweeps, [](const Panel& panel, const ErrorKind& kind, const FourBodies& means) {
    ClaimResult result = result_for(panel, "objects 2, 3 - camera, object 1",
                                    fmt::format("smallest difference of slopes, {}", kind.title()), "> 0");
    result.set(cluster_estimate(means[0].n_clusters(), [&](std::span<const size_t> c) {
      return std::min(means[2].slope(c), means[3].slope(c)) - std::max(means[0].slope(c), means[1].slope(c));
    }));
    result.verdict = is_above(0, result.value, result.interval);
    return result;
  });
}

std::vector<ClaimResult> check_flow_noise_highest(const std::vector<NoiseSweep>& sweeps) {
  return of_four_bodies(sweeps, [](const Panel& panel, const ErrorKind& kind, const FourBodies& means) {
    ClaimResult result =
        result_for(panel, "objects 2, 3", fmt::format("mean {} at the highest level", kind.title()),
                   fmt::format("nearly {}", kind.highest));
    result.set(cluster_estimate(means[0].n_clusters(), [&](std::span<const size_t> c) {
      return std::max(means[2].at_highest_level(c), means[3].at_highest_level(c));
    }));
    result.verdict =
        is_between((1 - nearly) * kind.highest, (1 + nearly) * kind.highest, result.value, result.interval);
    return result;
  });
}

}  // namespace sextant
