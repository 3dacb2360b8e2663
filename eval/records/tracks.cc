#include "sextant/eval/records/tracks.h"

#include <charconv>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

constexpr const char* header = "body,frame,x_m,y_m,z_m,x_gt_m,y_gt_m,z_gt_m";

std::string fields(const std::optional<Eigen::Vector3d>& p) {
  return p ? fmt::format(",{},{},{}", p->x(), p->y(), p->z()) : ",,,";
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

}  // namespace

std::string write_tracks(const std::vector<BodyTrack>& tracks) {
  std::string text = std::string(header) + "\n";
  for (const BodyTrack& track : tracks) {
    for (const TrackPoint& p : track.points)
      text += fmt::format("{},{}{}{}\n", track.body, p.frame, fields(p.estimate_m), fields(p.truth_m));
  }
  return text;
}

std::vector<BodyTrack> parse_tracks(const std::string& text, const std::string& name) {
  std::vector<std::string> lines = split(text, '\n');
  if (lines.back().empty()) lines.pop_back();
  if (lines.empty() || lines.front() != header) fail("{}:1: expected '{}'", name, header);
  std::vector<BodyTrack> tracks;
  for (size_t i = 1; i < lines.size(); ++i) {
    const std::string where = fmt::format("{}:{}", name, i + 1);
    const std::vector<std::string> parts = split(lines[i], ',');
    if (parts.size() != 8) fail("{}: expected 8 fields, got {}", where, parts.size());
    if (tracks.empty() || tracks.back().body != parts[0]) tracks.push_back({parts[0], {}});
    tracks.back().points.push_back(
        {number<int>(parts[1], "frame number", where), position(parts, 2, where), position(parts, 5, where)});
  }
  return tracks;
}

}  // namespace sextant
