#pragma once

// Figures of logged object motions: paths from above, statuses and tracklets over time. Of each system its
// first run.

#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/explorer.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Positions of the camera and of all objects of one log, estimated and true, in one world.
struct ObjectTracks {
  std::string system;
  uint64_t run = 0;
  std::vector<BodyTrack> bodies;  ///< the camera first, where the log has it
};
/// Logged poses; of a log with motions alone the paths that chained_poses() makes of them.
ObjectTracks object_tracks(const ObjectLog& log, uint64_t run);

/// State of a step of an object.
enum class StepState { estimated, without_truth, gap, missed, gated };
constexpr Names<5> names_of(StepState) {
  return {"estimated", "estimated, no truth", "gap", "missed", "outside the gates"};
}

/// Successive frames of one object in one state.
struct StateSpan {
  int object = 0, first = 0, last = 0;
  StepState state = StepState::estimated;
};
/// States of the steps of one run, by object and frame. A step without an estimate is a gap between estimates of
/// its object, and missed before the first or behind the last one.
std::vector<StateSpan> state_spans(const std::vector<const Record*>& records);

std::vector<Figure> object_path_figures(const std::vector<ObjectTracks>& tracks);
std::vector<Figure> object_state_figures(const std::vector<Record>& records);
/// Number of tracklets, stretches of successive estimated steps, that are at least as long as x.
Figure tracklet_figure(const std::vector<Record>& records);

/// The paths with errors and speeds along them to walk through, of the first run of each system.
Explorer object_explorer(const std::vector<ObjectTracks>& tracks, const std::vector<Record>& records,
                         const std::string& Et_key, const std::string& ER_key);

}  // namespace sextant
