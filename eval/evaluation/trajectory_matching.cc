#include "sextant/eval/evaluation/trajectory_matching.h"

#include <algorithm>
#include <numeric>

#include "sextant/base/error.h"
#include "sextant/eval/evaluation/trajectory_offset.h"

namespace sextant {
namespace {

std::vector<int> counted(size_t n) {
  std::vector<int> rows(n);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

/// Returns true if a time on the reference's clock lies in the range of --t-start and --t-end.
bool in_range(double t, const AssociationOptions& options) {
  return !(options.start_s && t < *options.start_s) && !(options.end_s && t > *options.end_s);
}

Association restricted(Association all, const PoseSeries& reference, const AssociationOptions& options) {
  if (!options.start_s && !options.end_s) return all;
  Association kept;
  for (size_t i = 0; i < all.reference.size(); ++i) {
    const double t = reference.stamps_s[static_cast<size_t>(all.reference[i])];
    if (!in_range(t, options)) continue;
    kept.reference.push_back(all.reference[i]);
    kept.estimate.push_back(all.estimate[i]);
  }
  return kept;
}

/// Associates by time. Only the part of the reference within the range can be matched, as if the rest had not
/// been recorded.
Association by_time(const PoseSeries& reference, const PoseSeries& estimate,
                    const AssociationOptions& options) {
  if (!options.start_s && !options.end_s)
    return associate_by_time(reference.stamps_s, estimate.stamps_s, options);
  std::vector<double> stamps;
  std::vector<int> rows;
  for (size_t i = 0; i < reference.size(); ++i) {
    const double t = reference.stamps_s[i];
    if (!in_range(t, options)) continue;
    stamps.push_back(t);
    rows.push_back(static_cast<int>(i));
  }
  Association found = associate_by_time(stamps, estimate.stamps_s, options);
  for (int& row : found.reference) row = rows[static_cast<size_t>(row)];
  return found;
}

/// If one side has frame numbers and the other one time stamps, the rows of the other side are taken as frame
/// numbers. Throws Error if they are none: if its stamps show that frames are missing between its rows, or if
/// it has fewer rows than the largest frame number requires.
void check_rows_are_frames(const PoseSeries& reference, const PoseSeries& estimate, const std::string& name) {
  constexpr double largest_share = 1.5;  // of the median step; a step of two is a missing frame
  const bool of_reference = reference.frames.empty();
  const PoseSeries& rows = of_reference ? reference : estimate;
  const PoseSeries& numbered = of_reference ? estimate : reference;
  if (!rows.frames.empty() || numbered.frames.empty() || rows.stamps_s.size() < 2) return;
  const double step_s = median_step(rows.stamps_s);
  const auto gap = std::ranges::adjacent_find(
      rows.stamps_s, [&](double a, double b) { return b - a > largest_share * step_s; });
  const auto [first, last] = std::ranges::minmax(numbered.frames);
  const bool is_short = static_cast<size_t>(std::max(last, 0)) >= rows.size();
  if (gap == rows.stamps_s.end() && !is_short) return;
  const std::string why =
      gap != rows.stamps_s.end()
          ? fmt::format(
                "between rows {} and {} its stamps differ by {:.4g} s, more than the median of {:.4g} s",
                gap - rows.stamps_s.begin() + 1, gap - rows.stamps_s.begin() + 2, gap[1] - gap[0], step_s)
          : fmt::format("it has {} rows, but the frame numbers are {} to {}", rows.size(), first, last);
  fail(
      "{}: the {} has time stamps and the {} frame numbers, and the rows of the {} are not these frames: {}; "
      "give --rate, the frames per second (the median rate of the stamps is {:.4g} Hz, over {:.4g} s)",
      name, of_reference ? "reference" : "estimate", of_reference ? "estimate" : "reference",
      of_reference ? "reference" : "estimate", why, 1 / step_s, rows.stamps_s.back() - rows.stamps_s.front());
}

Association associate(const PoseSeries& reference, const PoseSeries& estimate,
                      const AssociationOptions& options, const std::string& name) {
  const bool range = options.start_s || options.end_s;
  if (!reference.stamps_s.empty() && !estimate.stamps_s.empty()) return by_time(reference, estimate, options);
  const char* of_times = options.offset_s != 0 ? "--offset"
                         : options.max_difference_s != AssociationOptions{}.max_difference_s
                             ? "--max-difference"
                             : nullptr;
  if (of_times) {
    fail("{}: {} needs time stamps in both reference and estimate: give --rate, or leave the flag out", name,
         of_times);
  }
  if (!estimate.frames.empty() || !reference.frames.empty()) {
    if (range && reference.stamps_s.empty()) {
      fail(
          "--t-start and --t-end need a reference with time stamps, and this one has none: give --rate, or "
          "leave the flags out");
    }
    check_rows_are_frames(reference, estimate, name);
    return restricted(associate_by_frame(frames_of(reference), frames_of(estimate)), reference, options);
  }
  if (reference.stamps_s.empty() != estimate.stamps_s.empty()) {
    fail(
        "{}: only one of reference and estimate has time stamps, and neither has frame numbers: there is no "
        "way to match them; give --rate where rows are frames, or convert one of them",
        name);
  }
  if (range) {
    fail(
        "--t-start and --t-end need time stamps, which these files do not have: give --rate, or leave the "
        "flags out");
  }
  if (reference.size() != estimate.size()) {
    const bool steps = estimate.size() + 1 == reference.size();
    fail(
        "{}: has {} poses, the reference {}: without time stamps or frame numbers both must have the same "
        "number; put the frame number before the 12 values of each line{}",
        name, estimate.size(), reference.size(),
        steps ? "; a file of steps has one line less than poses: chain the steps from the identity on" : "");
  }
  return {counted(reference.size()), counted(estimate.size())};
}

MatchedPoses matched_by_association(const PoseSeries& reference, PoseSeries estimate,
                                    const AssociationOptions& options, const std::string& name) {
  Association found = associate(reference, estimate, options, name);
  MatchedPoses matched{{reference, std::move(estimate)}, std::move(found.reference), {}};
  matched.reference.keep(matched.reference_rows);
  matched.estimate.keep(found.estimate);
  return matched;
}

MatchedPoses matched_by_interpolation(const PoseSeries& reference, PoseSeries estimate,
                                      const AssociationOptions& options, double max_gap_s,
                                      const std::string& name) {
  if (reference.stamps_s.empty() || estimate.stamps_s.empty())
    fail("{}: --interpolate needs time stamps in both reference and estimate", name);
  std::vector<double> times;
  std::vector<int> kept;
  for (size_t i = 0; i < estimate.size(); ++i) {
    const double t = estimate.stamps_s[i] + options.offset_s;
    if (!in_range(t, options)) continue;
    times.push_back(t);
    kept.push_back(static_cast<int>(i));
  }
  InterpolatedPoses found = interpolate_poses(reference, times, max_gap_s);
  for (int& i : found.asked) i = kept[static_cast<size_t>(i)];
  estimate.keep(found.asked);
  return {{std::move(found.poses), std::move(estimate)},
          std::move(found.rows),
          Interpolation{found.largest_gap_s, found.n_outside, found.n_in_longer_gaps}};
}

}  // namespace

std::vector<int> frames_of(const PoseSeries& series) {
  return series.frames.empty() ? counted(series.size()) : series.frames;
}

std::vector<double> times_of(const PoseSeries& series) {
  if (!series.stamps_s.empty()) return series.stamps_s;
  const std::vector<int> frames = frames_of(series);
  return {frames.begin(), frames.end()};
}

MatchedPoses match_poses(const PoseSeries& reference, PoseSeries estimate, const AssociationOptions& options,
                         std::optional<double> interpolate_max_gap_s, const std::string& name) {
  if (interpolate_max_gap_s)
    return matched_by_interpolation(reference, std::move(estimate), options, *interpolate_max_gap_s, name);
  return matched_by_association(reference, std::move(estimate), options, name);
}

EvaluatedRange evaluated_range(const PoseSeries& reference, const PoseSeries& estimate,
                               const AssociationOptions& options) {
  if (reference.empty()) return {};
  const std::vector<double> times = times_of(reference);
  EvaluatedRange out{reference.size(), estimate.size(), times.back() - times.front()};
  if ((!options.start_s && !options.end_s) || reference.stamps_s.empty()) return out;
  const auto is_evaluated = [&](double t) { return in_range(t, options); };
  const auto first = std::ranges::find_if(times, is_evaluated);
  const auto last = std::find_if_not(first, times.end(), is_evaluated);
  out.n_reference = static_cast<size_t>(last - first);
  out.duration = first == last ? 0 : last[-1] - *first;
  if (!estimate.stamps_s.empty()) {
    out.n_estimate = static_cast<size_t>(std::ranges::count_if(
        estimate.stamps_s, [&](double t) { return is_evaluated(t + options.offset_s); }));
  } else if (first == last) {
    out.n_estimate = 0;
  } else {
    const std::vector<int> all = frames_of(reference);
    const int first_frame = all[static_cast<size_t>(first - times.begin())];
    const int last_frame = all[static_cast<size_t>(last - times.begin()) - 1];
    out.n_estimate = static_cast<size_t>(std::ranges::count_if(
        frames_of(estimate), [&](int frame) { return frame >= first_frame && frame <= last_frame; }));
  }
  return out;
}

}  // namespace sextant
