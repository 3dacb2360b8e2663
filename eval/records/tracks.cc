#include "sextant/eval/records/tracks.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

constexpr const char* header = "body,frame,x_m,y_m,z_m,x_gt_m,y_gt_m,z_gt_m";
constexpr const char* orientation_header = ",qx,qy,qz,qw,qx_gt,qy_gt,qz_gt,qw_gt";

std::string fields(const std::optional<Eigen::Vector3d>& p) {
  return p ? fmt::format(",{},{},{}", p->x(), p->y(), p->z()) : ",,,";
}

std::string fields(const std::optional<Eigen::Quaterniond>& q) {
  return q ? fmt::format(",{},{},{},{}", q->x(), q->y(), q->z(), q->w()) : ",,,,";
}

template <typename T>
T number(const std::string& text, const char* what, const std::string& where) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    fail("{}: expected a {}, got '{}'", where, what, text);
  return value;
}

std::optional<Eigen::Vector3d> position(const std::vector<std::string>& parts, size_t first,
                                        const std::string& where) {
  if (parts[first].empty() && parts[first + 1].empty() && parts[first + 2].empty()) return std::nullopt;
  const auto at = [&](size_t i) { return number<double>(parts[first + i], "number", where); };
  return Eigen::Vector3d{at(0), at(1), at(2)};
}

std::optional<Eigen::Quaterniond> orientation(const std::vector<std::string>& parts, size_t first,
                                              const std::string& where) {
  const auto last = parts.begin() + static_cast<std::ptrdiff_t>(first) + 4;
  if (std::all_of(last - 4, last, [](const std::string& part) { return part.empty(); })) return std::nullopt;
  const auto at = [&](size_t i) { return number<double>(parts[first + i], "number", where); };
  const Eigen::Quaterniond q(at(3), at(0), at(1), at(2));
  if (std::abs(q.norm() - 1) > 1e-6) fail("{}: expected a unit quaternion, its norm is {}", where, q.norm());
  return q;
}

std::optional<SE3> pose(const std::optional<Eigen::Quaterniond>& rotation,
                        const std::optional<Eigen::Vector3d>& position_m) {
  return rotation && position_m ? std::optional(SE3::from_parts(*rotation, *position_m)) : std::nullopt;
}

}  // namespace

void TrackPoint::set_estimate(const SE3& T_world_body) {
  estimate_m = T_world_body.translation();
  estimate_rotation = T_world_body.rotation();
}

void TrackPoint::set_truth(const SE3& T_world_body) {
  truth_m = T_world_body.translation();
  truth_rotation = T_world_body.rotation();
}

std::optional<SE3> TrackPoint::estimate() const { return pose(estimate_rotation, estimate_m); }
std::optional<SE3> TrackPoint::truth() const { return pose(truth_rotation, truth_m); }

const TrackPoint* BodyTrack::find(int frame) const {
  const auto point = std::ranges::lower_bound(points, frame, {}, &TrackPoint::frame);
  return point != points.end() && point->frame == frame ? &*point : nullptr;
}

std::string tracks_file(const std::string& system, uint64_t run) {
  const auto is_plain = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
  };
  constexpr size_t longest = 64, digits = 16;
  const bool plain = system.size() <= longest && std::ranges::all_of(system, is_plain);
  return fmt::format("tracks/{}_{}.csv", plain ? system : "system-" + sha256(system).substr(0, digits), run);
}

std::string write_tracks(const std::vector<BodyTrack>& tracks, bool with_orientations) {
  std::string text = std::string(header) + (with_orientations ? orientation_header : "") + "\n";
  for (const BodyTrack& track : tracks) {
    for (const TrackPoint& p : track.points) {
      text += fmt::format("{},{}{}{}", track.body, p.frame, fields(p.estimate_m), fields(p.truth_m));
      if (with_orientations) text += fields(p.estimate_rotation) + fields(p.truth_rotation);
      text += '\n';
    }
  }
  return text;
}

std::vector<BodyTrack> parse_tracks(const std::string& text, const std::string& name) {
  std::vector<std::string> lines = split(text, '\n');
  if (lines.back().empty()) lines.pop_back();
  const bool has_orientations = !lines.empty() && lines.front() == std::string(header) + orientation_header;
  if (lines.empty() || (lines.front() != header && !has_orientations))
    fail("{}:1: expected the header '{}'", name, header);
  const size_t n_fields = has_orientations ? 16 : 8;
  std::vector<BodyTrack> tracks;
  for (size_t i = 1; i < lines.size(); ++i) {
    const std::string where = fmt::format("{}:{}", name, i + 1);
    const std::vector<std::string> parts = split(lines[i], ',');
    if (parts.size() != n_fields) fail("{}: expected {} fields, got {}", where, n_fields, parts.size());
    if (tracks.empty() || tracks.back().body != parts[0]) tracks.push_back({parts[0], {}});
    tracks.back().points.push_back(
        {number<int>(parts[1], "frame number", where), position(parts, 2, where), position(parts, 5, where)});
    if (!has_orientations) continue;
    tracks.back().points.back().estimate_rotation = orientation(parts, 8, where);
    tracks.back().points.back().truth_rotation = orientation(parts, 12, where);
  }
  return tracks;
}

}  // namespace sextant
