#pragma once

// One case of a finished run or sweep, with what its records do not hold: the points of every pair, the
// covariances and the paths. These come from the source again, through the same deterministic pipeline: a run
// needs no extra files to be looked at. Records are those of the folder. Programs of others are not run
// again: of their cases there are records alone.

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

// ---- What an estimate's own covariance says about its errors: the bands of a timeline and the ellipses of a
// top view. To first order, for an unbiased Gaussian estimate X = exp(e) Xhat with covariance C of e (left
// twist):
//
//   E_t, E_R   length of the two halves of the error's twist: e for the camera, -Ad(X^-1) e for an object
//              (metrics/crlb.h). The length of a Gaussian vector is taken as a scaled chi variable of the
//              same mean square and variance (Satterthwaite 1946)
//   E_v        n^T (H c - c) / dt along n, the direction of H c - c, from the covariances of both motions
//   position   steps are independent: covariances in the world add up

/// 19 of 20 errors are smaller. NaN where there is no covariance.
struct ErrorBand {
  double Et_m;
  double ER_deg;
  double Ev_kmh;  ///< objects only
};

inline constexpr double band_probability = 0.95;

/// The q with P(|x| <= q) = p for x ~ N(0, covariance).
double length_quantile(const Eigen::Matrix3d& covariance, double p);

/// Of a body whose status is ok.
ErrorBand error_band(const BodyResult& body, const FrameResult& frame);

/// Covariance of a position in the world seen from above (m^2): x to the right, z ahead in the first camera.
struct TopViewCovariance {
  double xx = 0, xz = 0, zz = 0;
};

/// Adds up along a run. The camera's begins at its first pose; an object's where a stretch of estimates
/// begins.
class PositionCovariances {
 public:
  /// T_world_camera and the objects' positions after the pair, as estimated; frames in order. What has no
  /// covariance in the result is left out.
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

/// Which case. What is not said: the first that the folder has.
struct CaseChoice {
  std::string source;     ///< as the folder's configuration has it
  std::string estimator;  ///< label in records
  std::optional<double> level;
  std::optional<uint64_t> seed;
};

/// Points of a body in a pair, for drawing: at most max_drawn_points, evenly out of all.
struct DrawnPoints {
  int n_all = 0;
  struct Point {
    double u, v;                      ///< px, previous image
    double flow_u, flow_v;            ///< measured
    double predicted_u, predicted_v;  ///< that the estimated motion gives at the measured depth; NaN: none
    double refined_u, refined_v;      ///< the estimator's
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
  std::string version;  ///< of the program that ran it, with commit
  uint64_t n_cases = 1;
  std::vector<std::string> notes;  ///< what a reader must know
  std::vector<Record> records;     ///< of the case, as in the folder
  std::vector<BodyTrack> tracks;
  std::map<int, std::map<std::string, ViewedBody>> pairs;  ///< by current frame and body
  std::shared_ptr<const Sequence> sequence;
};

/// Returns T_camera_object of the estimates of a frame, for each object with an estimated pose: relative to the
/// estimated camera or, if there is none, to the true one. Empty if the tracks have no orientations.
std::map<std::string, SE3> estimated_poses(const std::vector<BodyTrack>& tracks, int frame);

/// Throws Error when the folder is none of `sextant run`, `sextant sweep` or `sextant merge`, has no such
/// case (names those it has), or its source is not where it was.
ViewedRun view_run(const std::filesystem::path& folder, const CaseChoice& choice,
                   const std::string& data_root, int jobs, bool quiet);

/// Returns true for a folder of `sextant evaluate objects --out`: records without a configuration to run again.
bool is_of_logs(const std::filesystem::path& folder);

/// Records and paths of other programs (`sextant evaluate objects --out`), with the sequence that they are about
/// for images and truth; without it (null) records and paths alone. `source` is its SOURCE. The first system and
/// run of the folder unless `choice` names another.
ViewedRun view_records(const std::filesystem::path& folder, const CaseChoice& choice,
                       const std::string& source, std::shared_ptr<const Sequence> sequence);

/// view_records() of a folder of logs with the SOURCE `images`, which may be empty, otherwise view_run().
ViewedRun view_folder(const std::filesystem::path& folder, const CaseChoice& choice, const std::string& images,
                      const std::string& data_root, int jobs, bool quiet);

}  // namespace sextant
