#pragma once

// Figures of logged object motions: paths from above, states and tracklets over time. For each system they
// show its first run.

#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Positions of the camera and of all objects of one log, estimated and true, in one world.
struct ObjectTracks {
  std::string system;
  uint64_t run = 0;
  std::vector<BodyTrack> bodies;  ///< the camera first if the log has it
};
/// Returns the tracks of a log. For a log of motions only, the estimated paths are those of chained_poses().
ObjectTracks object_tracks(const ObjectLog& log, uint64_t run);

/// State of a step of an object.
enum class StepState { estimated, without_truth, gap, missed, gated };
constexpr Names<5> names_of(StepState) {
  return {"estimated", "estimated, no truth", "gap", "missed", "outside the gates"};
}

/// Successive frames of one object in the same state.
struct StateSpan {
  int object = 0, first = 0, last = 0;
  StepState state = StepState::estimated;
};
/// Returns the states of the steps of one run, by object and frame. A step without an estimate is a gap if it
/// lies between estimates of its object, and missed before the first or after the last one.
std::vector<StateSpan> state_spans(const std::vector<const Record*>& records);

/// Returns one figure per system: true and estimated paths from above.
std::vector<Figure> object_path_figures(const std::vector<ObjectTracks>& tracks);
/// Returns one figure per system: the state of every step of every object.
std::vector<Figure> object_state_figures(const std::vector<Record>& records);
/// Number of tracklets (stretches of successive estimated steps) that are at least x steps long, over x.
Figure tracklet_figure(const std::vector<Record>& records);

/// Interactive view of the paths with errors and speeds along them, for the first run of each system.
Explorer object_explorer(const std::vector<ObjectTracks>& tracks, const std::vector<Record>& records,
                         const std::string& Et_key, const std::string& ER_key);

}  // namespace sextant
