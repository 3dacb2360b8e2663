#pragma once

// Figures of records. Each is a function of records or of rows computed from them.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/noise_tables.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/run_summary.h"

namespace sextant {

/// Errors up to this value are only rounding, as with exact data. On a logarithmic axis they are drawn at its
/// lower end, which rounding_note() says in the caption.
inline constexpr double largest_rounding = 1e-9;
std::string rounding_note();

/// Returns ", seed 0 of 5" for captions of figures that show one seed of several; "" if there is only one.
std::string seed_text(uint64_t seed, size_t n_seeds);

// ---- Errors of sets of frames by body and estimator.
//
//   EPE            fig. 5: mean end-point error of the flow before and after the optimisation, as bars with
//                  95 % intervals (bootstrap over seeds), one diagram per set. Uses records with known true
//                  flow
//   distribution   (ours) box plots of the compared errors (metrics/definitions.h): quartiles and median,
//                  whiskers at 5 and 95 %; one figure per set

std::vector<Figure> epe_figures(const std::vector<RecordSet>& sets);
/// Fig. 5 in the paper's form: two bars per body, for the paper's method only, all sets in one diagram.
std::vector<Figure> paper_epe_figures(const std::vector<RecordSet>& sets);
std::vector<Figure> distribution_figures(const std::vector<RecordSet>& sets);

// ---- The figures of a noise sweep.
//
//   error against level   one per dataset, sequence and estimator, as fig. 4 of the paper: curves are E_t on
//                         the left axis, bars E_R on the right one; camera and objects in one frame; bands
//                         and whiskers are 95 % intervals of the mean
//   estimators            one per dataset, sequence and body with two or more estimators: E_t of each
//   achieved noise        one per source: achieved over requested, by level and channel

/// Makes the first two kinds for the rows of one sweep. A figure with fewer than two levels, or with more
/// than 100 lines, is left out.
std::vector<Figure> noise_level_figures(const std::vector<NoiseLevelRow>& rows);

/// Fig. 4 in the paper's form, one diagram for each noise that the paper swept: E_t of the paper's method as
/// curves on the left axis, E_R as bars on the right axis; dashed lines show the largest errors that the
/// paper states.
struct PaperSweep {
  std::vector<NoiseLevelRow> levels;
  std::map<std::string, std::string> paper_names;  ///< by body: {"ego", "Ego"}, {"object:4", "Obj3"}
};
std::vector<Figure> paper_noise_figures(const std::vector<PaperSweep>& sweeps);

std::vector<Figure> achieved_noise_figures(const std::vector<AchievedNoiseRow>& rows);

// ---- (ours) Errors relative to the Cramer-Rao bound: RMS of E_t and E_R over the RMS of their bounds, by
// level, body and estimator, with 95 % intervals. 1 means that the bound is reached; for values below 1 see
// docs/metrics.md, "The Cramér-Rao bound". One figure per parameter, data set and sequence with bounds; it
// shows the first four bodies.

std::vector<Figure> efficiency_figures(const std::vector<NoiseLevelRow>& rows);

// ---- (ours) Dynamic or static: accuracy of each test on the detections within the gates, as in Table I,
// against the truth. The decision variable is values.motion_sigmas if the records of an estimator have it
// (classification.test = likelihood), otherwise values.moving_share (threshold).

/// Table with a row for each data set, sequence, noise level and estimator: detections, wrong decisions, and
/// area under the receiver operating characteristic. For `likelihood` it also counts the missed dynamic
/// objects that were faster than values.detectable_kmh.
Table classification_test_table(const std::vector<Record>& records);

/// Receiver operating characteristics: one figure per data set and level with a panel per sequence; sequences
/// without both static and dynamic objects are left out.
std::vector<Figure> classification_figures(const std::vector<Record>& records);

// ---- Errors over the frames of a source: one panel per error and one line per body, for at most six bodies:
// the camera, and the objects with the most estimates. The caption says so if there are more. The axis of the
// errors is logarithmic, with errors that are only rounding at its lower end; a line is interrupted where a
// body has no estimate with truth. If the records state the floor of the truth
// (step_floor_m), below which E_t of the camera is not meaningful, it is a dashed line. One figure per data
// set, sequence and estimator, from the records of its lowest seed, which the caption names if there are
// several.

/// E_t, E_R and E_v as the preset defines them, and the EPE after the optimisation; panels without a number
/// are left out.
std::vector<Figure> timeline_figures(const std::vector<Record>& records, const MetricPreset& preset);

// ---- (ours) Speed of objects over the frames of a source: estimates, truth, and a band around the truth of
// +- the error of the truth itself (the ground-truth floor). One figure per data set and sequence, from the
// records of its lowest seed, with the six objects that have the most estimates; the caption names the seed
// if there are several, and how many objects there are if not all are drawn. Objects with estimates in fewer
// than five frames are left out. Lines are interrupted over frames without an estimate.

/// `floor_kmh`: RMS error of the true speed by sequence; other sequences have no band.
std::vector<Figure> speed_figures(const std::vector<Record>& records,
                                  const std::map<std::string, double>& floor_kmh);

/// Returns the speed floors, km/h by sequence, of records with values.step_floor_m (recorded trajectories):
/// 3.6 floor / dt, with dt the time between frames of the recorded data.
std::map<std::string, double> recorded_speed_floor_kmh(const std::vector<Record>& records);

// ---- Tracks from above: x to the right, z ahead, in metres, both axes in the same scale.
//
//   showcase    fig. 1: camera and objects of one source, estimated over true, with each object's mean speed
//   top views   fig. 6: camera paths of several systems and the truth, one diagram a sequence

/// Returns the records of the system and seed that the tracks of a run show: of the records of this source,
/// those of the lowest seed and of the first estimator that it has. A run writes the tracks of no other.
RecordRefs records_of_tracks(const std::vector<Record>& records, const std::string& dataset,
                             const std::string& sequence);

/// Makes the figure of a showcase. `records`, those of the tracks (records_of_tracks()), provide the speeds;
/// `title` names the source. Returns no figure if there is no estimate.
std::vector<Figure> showcase_figures(const std::string& title, const std::vector<BodyTrack>& tracks,
                                     const RecordRefs& records);

struct CameraPath {
  std::string system;  ///< "ground truth", "ORB-SLAM3", ..; the truth is drawn first, as a broad grey line
  std::vector<Eigen::Vector3d> positions_m;
};
inline constexpr const char* truth_path = "ground truth";

struct TopView {
  std::string title;  ///< title of the diagram: "0003"
  std::vector<CameraPath> paths;
};

/// Makes one figure of all views, up to three side by side; none without views.
std::vector<Figure> top_view_figures(const std::vector<TopView>& views);

}  // namespace sextant
