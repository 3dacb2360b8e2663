#pragma once

// One case of a finished run or sweep, with data that its records do not contain: the points of every pair,
// the covariances and the paths. These are computed again from the source by the same deterministic pipeline,
// so a run needs no extra files to be viewed. Records are read from the folder. External programs and
// functions of Python are not run again: the paths of a program are read from the output that its run kept;
// without this output, and for functions, the case consists of records only. Only the selected estimator of
// a sweep is opened.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"

namespace sextant {

// ---- Uncertainty of the errors according to the estimate's own covariance: the bands of a timeline and the
// ellipses of a top view. To first order, for an unbiased Gaussian estimate X = exp(e) Xhat with covariance C
// of e (left twist):
//
//   E_t, E_R   norms of the translation and rotation part of the error twist: e for the camera, -Ad(X^-1) e
//              for an object (metrics/crlb.h). The norm of a Gaussian vector is approximated by a scaled chi
//              variable with the same mean square and variance (Satterthwaite 1946)
//   E_v        n^T (H c - c) / dt along n, the direction of H c - c, from the covariances of both motions
//   position   steps are independent, so their covariances in the world add up

/// Bounds below which 95 % of the errors lie. NaN if there is no covariance.
struct ErrorBand {
  double Et_m;
  double ER_deg;
  double Ev_kmh;  ///< objects only
};

inline constexpr double band_probability = 0.95;

/// Returns q with P(|x| <= q) = p for x ~ N(0, covariance).
double length_quantile(const Eigen::Matrix3d& covariance, double p);

/// Computes the bounds for a body with status ok.
ErrorBand error_band(const BodyResult& body, const FrameResult& frame);

/// Covariance of a position in the world seen from above (m^2): x to the right, z ahead in the first camera.
struct TopViewCovariance {
  double xx = 0, xz = 0, zz = 0;
};

/// Accumulates covariances of positions along a run. For the camera they begin at its first pose, for an
/// object at the beginning of each stretch of estimates.
class PositionCovariances {
 public:
  /// Adds one pair. T_world_curr and the positions of the objects are the estimates after the pair; call in
  /// order of frames. An object without a covariance is left out of the result; without one of the camera,
  /// the result is empty.
  std::map<std::string, TopViewCovariance> add(const FrameResult& frame, const SE3& T_world_curr,
                                               const std::map<int, Eigen::Vector3d>& objects_m);

 private:
  Matrix6d camera_ = Matrix6d::Zero();
  struct Object {
    int last = 0;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  std::map<int, Object> objects_;
};

/// Selects a case. An unset member selects the first one in the folder.
struct CaseChoice {
  std::string source;     ///< as in the folder's configuration
  std::string estimator;  ///< label in records
  std::optional<double> level;
  std::string noise{};  ///< name in records; needed where the level has several kinds of noise
  std::optional<uint64_t> seed;
};

/// Points of a body in a pair for drawing: at most max_drawn_points, evenly selected from all.
struct DrawnPoints {
  int n_all = 0;
  struct Point {
    double u, v;                      ///< px, previous image
    double flow_u, flow_v;            ///< measured
    double predicted_u, predicted_v;  ///< by the estimated motion at the measured depth; NaN: none
    double refined_u, refined_v;      ///< flow refined by the estimator
    bool inlier;
  };
  std::vector<Point> points;
};
inline constexpr int max_drawn_points = 700;

struct ViewedBody {
  DrawnPoints drawn;
  ErrorBand band;
  std::optional<TopViewCovariance> position;  ///< m^2
};

struct ViewedRun {
  std::string folder;
  std::string source;  ///< SOURCE
  std::string estimator, noise;
  double level = 0;
  uint64_t seed = 0;
  std::string version;  ///< version and commit of the program that ran it
  uint64_t n_cases = 1;
  std::vector<std::string> notes;  ///< notes for the reader
  std::vector<Record> records;     ///< records of the case, as in the folder
  std::vector<BodyTrack> tracks;
  std::map<int, std::map<std::string, ViewedBody>> pairs;  ///< by current frame and body
  std::shared_ptr<const Sequence> sequence;
};

/// Returns T_camera_object of each object with an estimated pose in a frame, relative to the estimated camera
/// or, if there is none, to the true one. Empty if the tracks have no orientations.
std::map<std::string, SE3> estimated_poses(const std::vector<BodyTrack>& tracks, int frame);

/// Returns the index of `wanted` in `names`; 0 if `wanted` is empty. Throws Error that lists the names if it
/// is none of them.
size_t place_of(const std::string& wanted, const std::vector<std::string>& names, const std::string& what,
                const std::filesystem::path& folder);

/// Reads a run. Throws Error if the folder is not one of `sextant run`, `sextant sweep` or `sextant merge`,
/// if it has no such case (the message lists the sources, estimators, levels or seeds that it has), or if its
/// source cannot be opened.
ViewedRun view_run(const std::filesystem::path& folder, const CaseChoice& choice,
                   const std::string& data_root, int jobs, bool quiet);

/// Returns true for a folder of `sextant evaluate objects --out`: it has records and no run.json.
bool is_of_logs(const std::filesystem::path& folder);

/// Reads records and paths of other programs (`sextant evaluate objects --out`). `sequence`, opened from
/// `source`, gives images and truth; null if it is not known. Takes the first system and run unless `choice`
/// selects another. Throws Error if the true camera of the logs is not that of the sequence.
ViewedRun view_records(const std::filesystem::path& folder, const CaseChoice& choice,
                       const std::string& source, std::shared_ptr<const Sequence> sequence);

/// Calls view_records() for a folder of logs, with the SOURCE `images` (may be empty), otherwise view_run().
ViewedRun view_folder(const std::filesystem::path& folder, const CaseChoice& choice,
                      const std::string& images, const std::string& data_root, int jobs, bool quiet);

}  // namespace sextant
