#pragma once

// The figures of records, each a function of records or of the rows made of them.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/errors_by_level.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/run_summary.h"

namespace sextant {

// ---- Errors of sets of frames by body and estimator.
//
//   EPE            fig. 5: mean end-point error of the flow before and after the optimisation, bars with 95 %
//                  intervals (bootstrap over seeds), one diagram a set. Records whose true flow is given
//   distribution   (ours) boxes of the compared errors (metrics/definitions.h): quartiles and median,
//   whiskers
//                  at 5 and 95 %; one figure a set

std::vector<Figure> epe_figures(const std::vector<RecordSet>& sets);
std::vector<Figure> distribution_figures(const std::vector<RecordSet>& sets);

// ---- The figures of a noise sweep.
//
//   error against level   one per dataset, sequence and estimator, as fig. 4 of the paper: curves are E_t on
//                         the left axis, bars E_R on the right one; camera and objects in one frame; bands
//                         and whiskers are 95 % intervals of the mean
//   estimators            one per dataset, sequence and body with two or more estimators: E_t of each
//   achieved noise        one per source: achieved over requested, by level and channel

/// Rows of one sweep. Nothing where there are fewer than two levels.
std::vector<Figure> noise_level_figures(const std::vector<NoiseLevelRow>& rows);

std::vector<Figure> achieved_noise_figures(const std::vector<AchievedNoiseRow>& rows);

// ---- (ours) How near the errors come to the limit: RMS of E_t and E_R over the RMS of their Cramer-Rao
// bounds, by level, body and estimator, with 95 % intervals. 1: at the bound; below 1 see docs/metrics.md,
// "The Cramér-Rao bound". One figure per parameter, dataset and sequence with bounds.

std::vector<Figure> efficiency_figures(const std::vector<NoiseLevelRow>& rows);

// ---- (ours) Dynamic or static: how well each test tells them apart. Detections within the gates, as in
// Table I; dynamic by truth. The number that a test decides by is values.motion_sigmas where an estimator's
// records have it (classification.test = likelihood), else values.moving_share (threshold).

/// A row for each data set, sequence, level of noise and estimator: detections, wrong decisions, area under
/// the receiver operating characteristic; of likelihood also the dynamic ones that it missed although
/// faster than values.detectable_kmh.
Table classification_test_table(const std::vector<Record>& records);

/// Receiver operating characteristics: one figure per data set and level, a panel per sequence; none
/// without both kinds.
std::vector<Figure> classification_figures(const std::vector<Record>& records);

// ---- Errors over the frames of a source, one panel an error, one line a body: the camera and up to five
// objects, those with the most estimates. Logarithmic; a line breaks where a body has no estimate with
// truth. Dashed: the floor of the truth itself, below which E_t of the camera says nothing (step_floor_m),
// where the data set tells. One figure per dataset, sequence and estimator, of the records of its lowest
// seed.

/// E_t, E_R and E_v as the preset has them, and the EPE after the optimisation; panels without a number are
/// left out.
std::vector<Figure> timeline_figures(const std::vector<Record>& records, const MetricPreset& preset);

// ---- (ours) Speed of every object over the frames of a source: estimates, truth, and around the truth a
// band as wide as its own error (the ground-truth floor). One figure per dataset and sequence, of the
// records of its lowest seed; up to six objects, those with the most estimates, of at least five.

/// `floor_kmh`: by sequence, how far the true speed is off (RMS); sequences that are not in it have no band.
std::vector<Figure> speed_figures(const std::vector<Record>& records,
                                  const std::map<std::string, double>& floor_kmh);

/// Of records that say values.step_floor_m (recorded trajectories): 3.6 floor / dt, at the rate of recorded
/// data.
std::map<std::string, double> recorded_speed_floor_kmh(const std::vector<Record>& records);

// ---- Tracks from above: x to the right, z ahead, metres, both axes in one scale.
//
//   showcase    fig. 1: camera and objects of one source, estimated over true, with each object's mean speed
//   top views   fig. 6: camera paths of several systems and the truth, one diagram a sequence

/// `records` of the same run give the speeds. `title`: the source, for people. No figure without an estimate.
std::vector<Figure> showcase_figures(const std::string& title, const std::vector<BodyTrack>& tracks,
                                     const std::vector<Record>& records);

struct CameraPath {
  std::string system;  ///< "ground truth", "ORB-SLAM3", ..; the truth is drawn first, broad and grey
  std::vector<Eigen::Vector3d> positions_m;
};
inline constexpr const char* truth_path = "ground truth";

struct TopView {
  std::string title;  ///< of the diagram: "0003"
  std::vector<CameraPath> paths;
};

/// All views in one figure, up to three beside each other.
std::vector<Figure> top_view_figures(const std::vector<TopView>& views);

}  // namespace sextant
