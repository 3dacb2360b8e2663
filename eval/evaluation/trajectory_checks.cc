#include "sextant/eval/evaluation/trajectory_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/evaluation/trajectory_offset.h"

namespace sextant {
namespace {

/// Counts the poses that find a partner; several poses with the same partner count once.
size_t count_partners(const std::vector<double>& reference, std::vector<double> estimate, double factor,
                      double offset_s, double max_difference_s) {
  for (double& t : estimate) t = t * factor + offset_s;
  const Association found = associate_by_time(reference, estimate, {.max_difference_s = max_difference_s});
  const std::set<int> rows(found.reference.begin(), found.reference.end());
  const std::set<int> own(found.estimate.begin(), found.estimate.end());
  return std::min(rows.size(), own.size());
}

struct Unit {
  double factor;  ///< factor from the stated to this unit, on the estimate's stamps
  const char* side;
  const char* unit;
};
constexpr std::array<Unit, 6> units = {{{1e-3, "estimate", "ms"},
                                        {1e-6, "estimate", "us"},
                                        {1e-9, "estimate", "ns"},
                                        {1e3, "reference", "ms"},
                                        {1e6, "reference", "us"},
                                        {1e9, "reference", "ns"}}};

std::string remedy_of(const Unit& unit) {
  const std::string header =
      fmt::format("write '# t [{}] tx ty tz qx qy qz qw' above its first line", unit.unit);
  if (std::string_view(unit.unit) != "ns") return header;
  return fmt::format("give --{}-format tum_ns, or {}",
                     std::string_view(unit.side) == "estimate" ? "est" : "ref", header);
}

}  // namespace

void check_physical(const PoseSeries& poses, const std::string& name, double max_speed_m_s) {
  constexpr double shortest_m = 0.3, longest_m = 50;
  const bool stamped = !poses.stamps_s.empty();
  for (size_t i = 1; i < poses.size(); ++i) {
    const double step_m = (poses.positions_m[i] - poses.positions_m[i - 1]).norm();
    const int frames = poses.frames.empty() ? 1 : poses.frames[i] - poses.frames[i - 1];
    const double duration_s = stamped ? poses.stamps_s[i] - poses.stamps_s[i - 1] : 0;
    const bool absurd = stamped ? step_m > max_speed_m_s * duration_s : step_m > longest_m * frames;
    if (step_m <= shortest_m || !absurd) continue;
    std::string place = poses.lines.empty() ? "" : fmt::format(":{}", poses.lines[i]);
    if (place.empty())
      place =
          poses.frames.empty() ? fmt::format(": pose {}", i + 1) : fmt::format(": frame {}", poses.frames[i]);
    const std::string what = stamped ? fmt::format("{:.4g} m in {:.4g} s, {:.4g} m/s, is above {:.4g} m/s",
                                                   step_m, duration_s, step_m / duration_s, max_speed_m_s)
                                     : fmt::format("{:.4g} m in {} frame{} is above {:.4g} m a frame", step_m,
                                                   frames, frames == 1 ? "" : "s", longest_m);
    fail(
        "{}{}: the true step is implausible: {}; expected metres and {}: is a pose an outlier, or the unit wrong? "
        "--max-speed sets the limit",
        name, place, what, stamped ? "seconds" : "one pose a frame");
  }
}

size_t fewest_matched(size_t n_shorter) {
  constexpr size_t fewest = 3, tenth = 10;
  return std::max(fewest, (n_shorter + tenth - 1) / tenth);
}

std::string explain_unmatched(const PoseSeries& reference, const PoseSeries& estimate,
                              const AssociationOptions& options) {
  const std::vector<double>&a = reference.stamps_s, &b = estimate.stamps_s;
  const size_t shorter = std::min(a.size(), b.size());
  const size_t enough = std::max<size_t>(2, shorter / 2);
  std::string text =
      fmt::format("the reference's time stamps are {:.10g} .. {:.10g} s, the estimate's {:.10g} .. {:.10g} s",
                  a.front(), a.back(), b.front(), b.back());
  const auto tolerance = [&](double factor) {
    const double step = a.size() > 1 && b.size() > 1 ? std::min(median_step(a), factor * median_step(b)) : 0;
    return std::max(options.max_difference_s, 0.25 * step);
  };
  for (const bool with_offset : {false, true}) {
    const Unit* best = nullptr;
    size_t most = 0;
    for (const Unit& unit : units) {
      const double offset_s = with_offset ? a.front() - unit.factor * b.front() : options.offset_s;
      const size_t n = count_partners(a, b, unit.factor, offset_s, tolerance(unit.factor));
      if (n > most) {
        most = n;
        best = &unit;
      }
    }
    const double offset_s = a.front() - b.front();
    const size_t by_offset = with_offset ? count_partners(a, b, 1, offset_s, tolerance(1)) : 0;
    if (by_offset >= enough && by_offset >= most) {
      return text + fmt::format(
                        "; with an offset of {:.6f} s {} poses match: give --offset {:.6f}, which "
                        "--estimate-offset refines",
                        offset_s, by_offset, offset_s);
    }
    if (!best || most < enough) continue;
    text += fmt::format("; read as {} {} of the {}'s time stamps match: {}", best->unit, most, best->side,
                        remedy_of(*best));
    if (with_offset) {
      const double seconds = std::string_view(best->side) == "estimate" ? 1 : 1 / best->factor;
      text += fmt::format(", and --offset {:.6f}", (a.front() - best->factor * b.front()) * seconds);
    }
    return text;
  }
  const double nearest = [&] {
    std::vector<double> distances;
    for (const double t : b) {
      const auto at = std::ranges::lower_bound(a, t + options.offset_s);
      double d = at == a.end() ? std::abs(t + options.offset_s - a.back()) : *at - t - options.offset_s;
      if (at != a.begin() && at != a.end()) d = std::min(d, t + options.offset_s - at[-1]);
      distances.push_back(d);
    }
    std::ranges::sort(distances);
    return distances[distances.size() / 2];
  }();
  if (nearest <= 1 && a.size() > 1 && nearest <= 2 * median_step(a)) {
    return text + fmt::format(
                      "; the nearest stamps are {:.3g} s apart in the median: give --max-difference, or "
                      "--interpolate {:.3g}",
                      nearest, 1.5 * median_step(a));
  }
  return text +
         ": check the clocks, the unit of time (a header 't [ms]' names it), --offset and --max-difference";
}

}  // namespace sextant
