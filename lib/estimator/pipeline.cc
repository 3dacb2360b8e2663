#include "sextant/estimator/pipeline.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"

namespace sextant {
namespace {

/// Returns the minimum over |e| <= radius of (d - e)^T S^-1 (d - e). `variances`: eigenvalues of S; `d`: in
/// the basis of the eigenvectors of S.
double distance2_from_ball(const Eigen::Vector3d& d, const Eigen::Vector3d& variances, double radius) {
  if (d.norm() <= radius) return 0;
  // e_i = d_i / (1 + m s_i) with the Lagrange multiplier m >= 0 for which |e| = radius; |e| decreases with m.
  const auto nearest = [&](double m) -> Eigen::Vector3d { return d.array() / (1 + m * variances.array()); };
  double low = 0, high = 1 / variances.minCoeff();
  while (nearest(high).norm() > radius && high < 1e300) high *= 4;
  for (int k = 0; k < 100; ++k) {
    const double middle = 0.5 * (low + high);
    (nearest(middle).norm() > radius ? low : high) = middle;
  }
  const Eigen::Vector3d rest = d - nearest(high);
  return (rest.array().square() / variances.array()).sum();
}

}  // namespace

void ClassificationOptions::check() const {
  check_option(min_speed_mps > 0, "min_speed_mps", min_speed_mps, "> 0");
  check_option(min_moving_share >= 0 && min_moving_share < 1, "min_moving_share", min_moving_share,
               "in [0, 1)");
  check_option(smallest_speed_mps > 0, "smallest_speed_mps", smallest_speed_mps, "> 0");
  check_option(false_alarm_rate > 0 && false_alarm_rate < 1, "false_alarm_rate", false_alarm_rate,
               "in (0, 1)");
}

MotionClass classify_motion(const Problem& object, const SE3& T_curr_prev_background, double dt_s,
                            const ClassificationOptions& options) {
  const SE3 T_prev_curr = T_curr_prev_background.inverse();
  const PinholeCamera& camera = object.camera.left;
  const Correspondences& points = object.points;
  const double threshold_m = options.min_speed_mps * dt_s;
  int n_moving = 0;
  MotionClass result;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points.depth_curr[i])) continue;
    const Eigen::Vector3d m_prev = camera.backproject(points.u[i], points.v[i], points.depth[i]);
    const Eigen::Vector3d m_curr = camera.backproject(points.u[i] + points.flow_u[i],
                                                      points.v[i] + points.flow_v[i], points.depth_curr[i]);
    const Eigen::Vector3d f = m_prev - T_prev_curr * m_curr;
    const double length_m = options.use_vertical ? f.norm() : std::sqrt(f.x() * f.x() + f.z() * f.z());
    ++result.n_points;
    n_moving += length_m > threshold_m ? 1 : 0;
  }
  result.moving_share = result.n_points > 0 ? static_cast<double>(n_moving) / result.n_points : NAN;
  result.is_dynamic = result.n_points == 0 || result.moving_share > options.min_moving_share;
  return result;
}

std::optional<MotionLikelihood> test_motion(const MotionEstimate& body, const MotionEstimate& background,
                                            const Eigen::Vector3d& centre_m, double dt_s,
                                            const ClassificationOptions& options) {
  const SE3 relative = body.T_curr_prev * background.T_curr_prev.inverse();
  const Eigen::Vector3d at = background.T_curr_prev * centre_m;
  const Matrix6d adjoint = relative.adjoint();
  // Maps the twist to the displacement of the centre and the rotation.
  Matrix6d to_centre = Matrix6d::Identity();
  to_centre.topRightCorner<3, 3>() = -skew(at);
  const Matrix6d covariance = to_centre *
                              (body.covariance + adjoint * background.covariance * adjoint.transpose()) *
                              to_centre.transpose();
  if (!covariance.allFinite()) return std::nullopt;
  const Eigen::LLT<Matrix6d> factor(covariance);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Matrix6d information = factor.solve(Matrix6d::Identity());
  const Eigen::Vector3d turn = relative.log().tail<3>();
  const Eigen::LLT<Eigen::Matrix3d> of_centre(information.topLeftCorner<3, 3>());
  if (of_centre.info() != Eigen::Success) return std::nullopt;
  const Eigen::Vector3d d = relative * at - at + of_centre.solve(information.topRightCorner<3, 3>() * turn);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(of_centre.solve(Eigen::Matrix3d::Identity()));
  if (!(eigen.eigenvalues().minCoeff() > 0) || !d.allFinite()) return std::nullopt;
  const double radius = options.smallest_speed_mps * dt_s;
  const double threshold2 = approximate_chi_square_quantile(1 - options.false_alarm_rate, 3);
  MotionLikelihood out;
  const double distance2 =
      distance2_from_ball(eigen.eigenvectors().transpose() * d, eigen.eigenvalues(), radius);
  out.statistic = std::sqrt(distance2);
  out.detectable_mps = (radius + std::sqrt(threshold2 * eigen.eigenvalues().maxCoeff())) / dt_s;
  out.is_dynamic = distance2 > threshold2;
  return out;
}

namespace {

class Stopwatch {
 public:
  /// Returns the milliseconds since construction or the last call.
  double lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Returns the centroid of the points marked in `used`, in previous camera coordinates.
Eigen::Vector3d centroid_of_used(const Problem& problem, const std::vector<unsigned char>& used) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int n = 0;
  for (size_t i = 0; i < used.size(); ++i) {
    if (used[i] == 0) continue;
    sum += problem.camera.left.backproject(problem.points.u[i], problem.points.v[i], problem.points.depth[i]);
    ++n;
  }
  return sum / n;
}

/// Changes the status of an estimate that is not finite from ok to diverged. Throws Error if its arrays do
/// not fit the number of points.
void check_estimate(MotionEstimate& estimate, size_t n_points) {
  if (estimate.status != Status::ok) return;
  if (!estimate.T_curr_prev.is_finite()) {
    estimate.status = Status::diverged;
    return;
  }
  const auto check_size = [&](const char* array, size_t n, bool may_be_empty) {
    if (n != n_points && !(may_be_empty && n == 0))
      fail("the estimator returned {} with {} values for {} points: expected one for each point{}", array, n,
           n_points, may_be_empty ? ", or none" : "");
  };
  check_size("MotionEstimate::inliers", estimate.inliers.size(), false);
  check_size("MotionEstimate::refined_flow_u", estimate.refined_flow_u.size(), true);
  check_size("MotionEstimate::refined_flow_v", estimate.refined_flow_v.size(), true);
}

/// Robust start and refinement of one body: fills points, estimate, status, counts and times.
void estimate_body(const Problem& problem, const std::optional<SE3>& propagated, int min_inliers,
                   const RobustStartOptions& options, RefineOn refine_on, const Estimator& estimator,
                   BodyResult& body) {
  Stopwatch watch;
  body.points = problem.points;
  body.noise = problem.noise;
  body.n_points = static_cast<int>(problem.points.size());
  // robust_start() and choose_points(): start/robust_start.cc; estimate(): estimators/joint_flow.cc for
  // joint_flow.
  const RobustStart start = robust_start(problem, propagated, options);
  body.times.start_ms = watch.lap_ms();
  body.n_inliers = start.n_inliers;
  body.start_propagated = start.propagated;
  body.status = start.status;
  if (start.status != Status::ok) return;
  if (start.n_inliers < min_inliers) {
    body.status = Status::too_few_points;
    return;
  }
  body.estimate = estimator.estimate(
      problem, estimator.chooses_points() ? start.point : choose_points(problem, start.point, refine_on));
  check_estimate(body.estimate, problem.points.size());
  body.status = body.estimate.status;
  body.times.refine_ms = watch.lap_ms();
}

/// Returns the instance of the previous mask to which most of the points belong; without points, the object's
/// instance in the current mask.
int main_instance(const ObjectObservation& object) {
  std::map<uint16_t, int> votes;
  for (const uint16_t instance : object.instance_prev) ++votes[instance];
  if (votes.empty()) return object.instance;
  return std::max_element(votes.begin(), votes.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

}  // namespace

Correspondences points_of_instance(const ObjectObservation& object, int instance, double max_depth_m) {
  std::vector<unsigned char> keep(object.points.size());
  for (size_t i = 0; i < keep.size(); ++i)
    keep[i] = object.instance_prev[i] == instance && object.points.depth[i] <= max_depth_m ? 1 : 0;
  return object.points.subset(keep);
}

void PipelineOptions::check() const {
  start.check();
  classification.check();
  check_option(max_object_distance_m > 0, "max_object_distance_m", max_object_distance_m, "> 0");
  check_option(min_object_area >= 0 && min_object_area < 1, "min_object_area", min_object_area, "in [0, 1)");
  check_option(min_object_points >= 4, "min_object_points", min_object_points, ">= 4");
}

FrameEstimator::FrameEstimator(const PipelineOptions& options, std::shared_ptr<const Estimator> estimator)
    : options_(options), estimator_(std::move(estimator)) {
  options_.check();
}

FrameResult FrameEstimator::process(const FramePair& pair) {
  if (pair.prev != last_curr_) {  // a new sequence, or a gap: nothing to propagate
    background_motion_.reset();
    track_of_instance_.clear();
    motion_of_track_.clear();
  }
  FrameResult result{.prev = pair.prev, .curr = pair.curr, .dt_s = pair.dt_s, .ego = estimate_ego(pair)};

  for (const ObjectObservation& object : pair.objects) {
    result.objects.push_back(gate_and_classify(pair, object, result.ego));
  }
  const std::map<int, int> tracks = associate(pair, result.objects);
  std::map<int, SE3> motions;
  for (BodyResult& body : result.objects) {
    body.track = tracks.at(body.instance);
    if (body.status == Status::ok) estimate_object(pair, result.ego, body);
    if (body.status == Status::ok && body.track != 0 && result.ego.status == Status::ok) {
      const SE3& X = result.ego.estimate.T_curr_prev;
      const SE3 H = object_motion_prev(X, body.estimate.T_curr_prev);
      motions[body.track] = X * H * X.inverse();  // in coordinates of the current camera
    }
  }
  for (const int id : pair.lost_instances) {
    BodyResult body;
    body.instance = id;
    body.status = Status::lost;
    body.distance_m = body.moving_share = body.speed_mps = nan;
    result.objects.push_back(std::move(body));
  }
  std::sort(result.objects.begin(), result.objects.end(),
            [](const BodyResult& a, const BodyResult& b) { return a.instance < b.instance; });

  if (options_.consistency) {
    check_consistency(pair, result.ego);
    for (BodyResult& body : result.objects) check_consistency(pair, body);
  }

  last_curr_ = pair.curr;
  background_motion_.reset();
  if (result.ego.status == Status::ok) background_motion_ = result.ego.estimate.T_curr_prev;
  track_of_instance_ = tracks;
  motion_of_track_ = std::move(motions);
  return result;
}

void FrameEstimator::check_consistency(const FramePair& pair, BodyResult& body) const {
  if (body.status != Status::ok) return;
  const Problem problem{pair.camera, body.points, body.noise};
  body.split = split_nees(problem, body.estimate, *estimator_);
  if (body.instance != 0) body.expansion = expansion_gap(problem, body.estimate, *estimator_);
}

BodyResult FrameEstimator::estimate_ego(const FramePair& pair) const {
  constexpr int min_ego_inliers = 10;
  BodyResult ego;
  ego.area_fraction = ego.distance_m = ego.moving_share = ego.speed_mps = nan;
  estimate_body({pair.camera, pair.background, pair.noise_of(0)}, background_motion_, min_ego_inliers,
                options_.start, options_.refine_on, *estimator_, ego);
  return ego;
}

BodyResult FrameEstimator::gate_and_classify(const FramePair& pair, const ObjectObservation& object,
                                             const BodyResult& ego) const {
  Stopwatch watch;
  BodyResult body{.instance = object.instance, .area_fraction = object.area_fraction};
  std::vector<double> depths = object.points.depth;
  body.distance_m = depths.empty() ? nan : upper_median(depths);
  body.moving_share = body.speed_mps = nan;
  body.is_dynamic = true;
  const int instance_prev = main_instance(object);
  Problem near{pair.camera, points_of_instance(object, instance_prev, options_.max_object_distance_m),
               pair.noise_of(instance_prev)};
  body.n_points = static_cast<int>(near.points.size());
  const auto gate = [&](Gate reason) {
    body.status = Status::gated;
    body.gate = reason;
  };
  const bool by_likelihood = options_.classification.test == MotionTest::likelihood;
  if (ego.status == Status::ok) {
    const MotionClass motion =
        classify_motion(near, ego.estimate.T_curr_prev, pair.dt_s, options_.classification);
    body.moving_share = motion.moving_share;
    body.is_dynamic = motion.is_dynamic;
  }
  if (object.points.empty()) {
    body.status = Status::lost;
  } else if (object.area_fraction < options_.min_object_area) {
    gate(Gate::area);
  } else if (body.distance_m > options_.max_object_distance_m) {
    gate(Gate::distance);
  } else if (body.n_points < options_.min_object_points) {
    body.status = Status::too_few_points;
  } else if (!by_likelihood && !body.is_dynamic && !options_.estimate_static_objects) {
    gate(Gate::is_static);
  }
  body.points = std::move(near.points);
  body.noise = std::move(near.noise);
  body.times.other_ms = watch.lap_ms();
  if (by_likelihood && body.status == Status::ok && ego.status == Status::ok) {
    refine_object(pair, ego.estimate.T_curr_prev, ego, body);
    decide_by_likelihood(pair, ego, body);
  }
  return body;
}

/// Applies the likelihood test to the body's estimate; without an estimate the decision of the threshold
/// stays.
void FrameEstimator::decide_by_likelihood(const FramePair& pair, const BodyResult& ego,
                                          BodyResult& body) const {
  if (body.status != Status::ok) return;
  const auto motion =
      test_motion(body.estimate, ego.estimate, body.centroid_m, pair.dt_s, options_.classification);
  if (!motion) return;
  body.likelihood = motion;
  body.is_dynamic = motion->is_dynamic;
  if (body.is_dynamic || options_.estimate_static_objects) return;
  body.status = Status::gated;
  body.gate = Gate::is_static;
}

/// Returns the track labels of the current frame (paper sec. IV-C2): 0 for a static object. A dynamic object
/// takes the label that most of its points had, or a new one if that is 0. If several objects claim a label,
/// the one with most votes gets it, and all others get new ones.
std::map<int, int> FrameEstimator::associate(const FramePair& pair, const std::vector<BodyResult>& objects) {
  struct Claim {
    int instance;
    int votes;
  };
  std::map<int, int> tracks;
  std::map<int, Claim> claims;  // by label
  std::vector<int> unlabelled;
  for (size_t i = 0; i < objects.size(); ++i) {
    const int instance = objects[i].instance;
    tracks[instance] = 0;
    if (!objects[i].is_dynamic || objects[i].status == Status::lost) continue;
    std::map<int, int> votes{{0, pair.objects[i].n_background}};
    for (const uint16_t before : pair.objects[i].instance_prev) {
      const auto known = track_of_instance_.find(before);
      ++votes[known == track_of_instance_.end() ? 0 : known->second];
    }
    const auto winner = std::max_element(votes.begin(), votes.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
    const auto claimed = claims.find(winner->first);
    if (winner->first == 0) {
      unlabelled.push_back(instance);
    } else if (claimed == claims.end()) {
      claims[winner->first] = {instance, winner->second};
    } else if (winner->second > claimed->second.votes) {
      unlabelled.push_back(claimed->second.instance);
      claimed->second = {instance, winner->second};
    } else {
      unlabelled.push_back(instance);
    }
  }
  for (const auto& [label, claim] : claims) tracks[claim.instance] = label;
  std::sort(unlabelled.begin(), unlabelled.end());
  for (const int instance : unlabelled) tracks[instance] = next_track_++;
  return tracks;
}

void FrameEstimator::estimate_object(const FramePair& pair, const BodyResult& ego, BodyResult& body) const {
  // The likelihood test has already estimated the object.
  if (options_.classification.test == MotionTest::likelihood && ego.status == Status::ok) return;
  std::optional<SE3> propagated;
  const auto known = motion_of_track_.find(body.track);
  if (ego.status == Status::ok && known != motion_of_track_.end()) {
    propagated = ego.estimate.T_curr_prev * known->second;
  }
  refine_object(pair, propagated, ego, body);
}

void FrameEstimator::refine_object(const FramePair& pair, const std::optional<SE3>& propagated,
                                   const BodyResult& ego, BodyResult& body) const {
  const Problem problem{pair.camera, std::move(body.points), body.noise};
  const RefineOn refine_on = options_.refine_objects_on == RefineObjectsOn::same
                                 ? options_.refine_on
                                 : static_cast<RefineOn>(options_.refine_objects_on);
  estimate_body(problem, propagated, options_.min_object_points, options_.start, refine_on, *estimator_,
                body);
  if (body.status != Status::ok) return;
  body.centroid_m = centroid_of_used(problem, body.estimate.inliers);
  if (ego.status == Status::ok) {
    const SE3 H = object_motion_prev(ego.estimate.T_curr_prev, body.estimate.T_curr_prev);
    body.speed_mps = speed_mps(H, body.centroid_m, pair.dt_s);
  }
}

}  // namespace sextant
