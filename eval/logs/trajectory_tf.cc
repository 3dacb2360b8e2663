#include "sextant/eval/logs/trajectory_message.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <set>

#include "sextant/base/error.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {
namespace {

constexpr size_t most_listed = 20;

std::string without_slash(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

std::string shown_frame(const std::string& frame) { return frame.substr(0, 80); }

}  // namespace

void TransformTree::add(const std::string& given_parent, const std::string& given_child, double stamp_s,
                        const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position_m, bool is_static,
                        const std::string& path, int64_t number) {
  const std::string parent = without_slash(given_parent), child = without_slash(given_child);
  if (parent.empty() || child.empty() || parent == child)
    fail("{}:{}: a transform from '{}' to '{}': expected two different names of frames", path, number,
         shown_frame(child), shown_frame(parent));
  check_position(position_m, path, number);
  const Eigen::Matrix3d R = checked_rotation(rotation, path, number, log_);
  const auto [found, is_new] = edges_.try_emplace(child, Edge{parent, is_static, {}});
  Edge& edge = found->second;
  ++n_messages_;
  if (edge.parent != parent) {
    fail(
        "{}:{}: the frame '{}' has the parent '{}' here and '{}' before: in a tree every frame has "
        "one parent",
        path, number, shown_frame(child), shown_frame(parent), shown_frame(edge.parent));
  }
  if (edge.is_static != is_static) {
    fail("{}:{}: the transform of '{}' in '{}' is both on the static topic and on the dynamic one: keep one",
         path, number, shown_frame(child), shown_frame(parent));
  }
  if (is_static && !is_new) {
    // Static transforms are repeated for late listeners; the last one is valid.
    const bool same = edge.poses.rotations.back() == R && edge.poses.positions_m.back() == position_m;
    if (!same) log_.note("static transforms change: the last one is used", number);
    edge.poses = {};
  }
  edge.poses.stamps_s.push_back(stamp_s);
  edge.poses.add(R, position_m);
}

std::string TransformTree::list() const {
  std::string out;
  size_t n = 0;
  for (const auto& [child, edge] : edges_) {
    if (n++ == most_listed) return out + ", ...";
    out += fmt::format("{}{}.{} ({})", n > 1 ? ", " : "", shown_frame(edge.parent), shown_frame(child),
                       edge.is_static ? "static" : fmt::format("{} transforms", edge.poses.size()));
  }
  return n > 0 ? out : "none";
}

/// Returns the frame, its parent, and so on up to a root.
std::vector<std::string> TransformTree::way_up(const std::string& frame, const std::string& where) const {
  std::vector<std::string> way = {frame};
  std::set<std::string> seen = {frame};
  for (auto at = edges_.find(frame); at != edges_.end(); at = edges_.find(way.back())) {
    way.push_back(at->second.parent);
    if (!seen.insert(way.back()).second)
      fail("{}: the transforms form a cycle: {}", where, fmt::join(way, " in "));
  }
  return way;
}

/// Splits "parent.child". Names may contain dots: finds the only split with frames on both sides.
TransformTree::Pair TransformTree::pair_of(const std::string& frames, const std::string& where) const {
  std::set<std::string> known;
  for (const auto& [child, edge] : edges_) known.insert({child, edge.parent});
  std::vector<Pair> splits, fitting;
  for (size_t dot = frames.find('.'); dot != std::string::npos; dot = frames.find('.', dot + 1)) {
    splits.push_back({without_slash(frames.substr(0, dot)), without_slash(frames.substr(dot + 1))});
    if (known.contains(splits.back().parent) && known.contains(splits.back().child))
      fitting.push_back(splits.back());
  }
  if (splits.empty()) {
    fail(
        "{}: give the transform as PARENT.CHILD, the path of the frame CHILD in the frame PARENT; there are: "
        "{}",
        where, list());
  }
  if (fitting.size() > 1)
    fail("{}: the dots in the names can be read in several ways; the transforms are: {}", where, list());
  if (fitting.empty() && splits.size() > 1)
    fail("{}: there are no two frames of these names; the transforms are: {}", where, list());
  if (fitting.empty()) {
    const bool has_parent = known.contains(splits[0].parent);
    fail("{}: there is no frame '{}'; the transforms are: {}", where,
         shown_frame(has_parent ? splits[0].child : splits[0].parent), list());
  }
  return fitting.front();
}

PoseSeries TransformTree::path(const std::string& frames, const std::string& where, RepairLog& log) const {
  const auto [parent, child] = pair_of(frames, where);
  std::vector<std::string> down = way_up(parent, where), up = way_up(child, where);
  const auto meeting = std::ranges::find_first_of(up, down);
  if (meeting == up.end()) {
    fail(
        "{}: the frames '{}' and '{}' are not connected: the first is below '{}', the second below '{}'; the "
        "transforms are: {}",
        where, shown_frame(parent), shown_frame(child), shown_frame(down.back()), shown_frame(up.back()),
        list());
  }
  const std::string ancestor = *meeting;
  up.erase(meeting, up.end());
  down.erase(std::ranges::find(down, ancestor), down.end());

  // From the parent up to the ancestor, and from there down to the child.
  struct Step {
    bool inverse, is_static;
    PoseSeries poses;
  };
  std::vector<Step> steps;
  log.add(log_);
  const auto add = [&](const std::string& frame, bool inverse) {
    const Edge& edge = edges_.at(frame);
    steps.push_back({inverse, edge.is_static, edge.poses});
    sort_and_unite(steps.back().poses, nullptr, log);
  };
  for (const std::string& frame : down) add(frame, true);
  for (auto frame = up.rbegin(); frame != up.rend(); ++frame) add(*frame, false);
  const auto nearest = std::find_if(steps.rbegin(), steps.rend(), [](const Step& s) { return !s.is_static; });
  if (nearest == steps.rend())
    fail("{}: all transforms between '{}' and '{}' are static: there is no path; the transforms are: {}",
         where, shown_frame(parent), shown_frame(child), list());

  std::vector<double> times = nearest->poses.stamps_s;
  const size_t n_times = times.size();
  double gap_s = 0;
  constexpr double any_gap_s = std::numeric_limits<double>::infinity();
  for (const Step& step : steps) {
    if (step.is_static) continue;
    const InterpolatedPoses found = interpolate_poses(step.poses, times, any_gap_s);
    times = found.poses.stamps_s;
    gap_s = std::max(gap_s, found.largest_gap_s);
  }
  if (times.empty())
    fail("{}: the moving transforms between '{}' and '{}' have no time in common", where, shown_frame(parent),
         shown_frame(child));
  std::vector<SE3> product(times.size());
  for (const Step& step : steps) {
    const PoseSeries moving =
        step.is_static ? PoseSeries() : interpolate_poses(step.poses, times, any_gap_s).poses;
    for (size_t i = 0; i < times.size(); ++i) {
      const SE3 one = step.is_static ? step.poses.pose(0) : moving.pose(i);
      product[i] = product[i] * (step.inverse ? one.inverse() : one);
    }
  }
  PoseSeries series;
  series.stamps_s = times;
  for (const SE3& pose : product) series.add(pose);
  if (times.size() < n_times) {
    log.note(
        fmt::format("{} of {} stamps lie outside the time range of the other moving transforms: left out",
                    n_times - times.size(), n_times),
        0);
  }
  if (gap_s > 0)
    log.note(fmt::format("moving transforms between the frames are interpolated over up to {:.3g} s", gap_s),
             0);
  return series;
}

}  // namespace sextant
