#include "sextant/eval/evaluation/trajectory_consistency.h"

#include <Eigen/Cholesky>

#include "sextant/base/error.h"
#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/trend.h"

namespace sextant {

namespace {

Vector6d error_of(const PoseSeries& estimate, const PoseSeries& reference, size_t i) {
  Vector6d e;
  e.head<3>() = reference.positions_m[i] - estimate.positions_m[i];
  e.tail<3>() =
      so3_log(Eigen::Quaterniond(Eigen::Matrix3d(reference.rotations[i] * estimate.rotations[i].transpose()))
                  .normalized());
  return e;
}

/// Exchanges the blocks of position and rotation, for files in which rotation comes first.
PoseCovariance exchanged(const PoseCovariance& P) {
  PoseCovariance Q;
  Q << P.bottomRightCorner<3, 3>(), P.bottomLeftCorner<3, 3>(), P.topRightCorner<3, 3>(),
      P.topLeftCorner<3, 3>();
  return Q;
}

PoseCovariance cross_transposed(const PoseCovariance& P) {
  PoseCovariance Q = P;
  Q.topRightCorner<3, 3>() = P.topRightCorner<3, 3>().transpose();
  Q.bottomLeftCorner<3, 3>() = P.bottomLeftCorner<3, 3>().transpose();
  return Q;
}

/// e' P^-1 e, and twice the negative log-likelihood, which adds log det P; empty if P is not positive
/// definite.
struct Score {
  double nees = 0, twice_neg_log = 0;
};
std::optional<Score> score(const Vector6d& e, const PoseCovariance& P) {
  const Eigen::LLT<PoseCovariance> llt(P);
  if (llt.info() != Eigen::Success) return std::nullopt;
  const Eigen::Matrix<double, 6, 6> L = llt.matrixL();
  const double nees = e.dot(llt.solve(e));
  return Score{nees, nees + 2 * L.diagonal().array().log().sum()};
}

std::string place(const PoseSeries& poses, size_t i, const std::string& name) {
  return poses.lines.empty() ? fmt::format("{}: pose {}", name, i + 1)
                             : fmt::format("{}:{}", name, poses.lines[i]);
}

/// Throws Error if another order of the numbers explains the errors; the message names the pose that shows it
/// most clearly.
void check_order_of_blocks(const PoseSeries& estimate, const PoseSeries& reference, const std::string& name) {
  const auto n = static_cast<double>(estimate.size());
  struct Other {
    PoseCovariance (*read)(const PoseCovariance&);
    const char* cause;
  };
  for (const auto& [read, cause] :
       {Other{exchanged,
              "rotation seems to stand before position: give --covariance openvins, or gtsam, or write "
              "position first"},
        Other{cross_transposed,
              "the blocks between position and rotation seem to be transposed: write the matrix row "
              "by row"}}) {
    double declared = 0, other = 0, gain = 0, largest = 0;
    size_t at = 0;
    bool possible = true;
    for (size_t i = 0; i < estimate.size() && possible; ++i) {
      const Vector6d e = error_of(estimate, reference, i);
      const auto a = score(e, estimate.covariances[i]), b = score(e, read(estimate.covariances[i]));
      possible = b.has_value();
      if (!a || !b) continue;
      declared += a->nees / n;
      other += b->nees / n;
      gain += a->twice_neg_log - b->twice_neg_log;
      if (a->twice_neg_log - b->twice_neg_log > largest) {
        largest = a->twice_neg_log - b->twice_neg_log;
        at = i;
      }
    }
    constexpr double sure = 25, a_pose = 1;
    constexpr double consistent = 6, at_most = 2 * consistent;
    const bool better = read == exchanged
                            ? declared >= explains_times * other && declared > consistent && other <= at_most
                            : gain > sure && gain > a_pose * n;
    if (!possible || !better) continue;
    fail(
        "{}: the covariances do not fit the errors: the NEES is {:.4g} instead of 6, and {:.4g} in another "
        "order: {}",
        place(estimate, at, name), declared, other, cause);
  }
}

/// Adds the NEES of every object.
void add(const LogCovariances& covariances, const std::map<ObjectFrame, SE3>& estimates,
         const std::map<ObjectFrame, SE3>& truths, const std::string& system, uint64_t run,
         std::vector<ObjectConsistency>& out) {
  for (const auto& [id, path] : covariances.paths) {
    PoseSeries estimate, reference;
    for (const auto& [key, covariance] : entries_of(covariances.entries, id)) {
      const auto own = find_pose(estimates, key), truth = find_pose(truths, key);
      if (!own || !truth) continue;
      estimate.add(*own);
      estimate.covariances.push_back(covariance.P);
      estimate.lines.push_back(covariance.line);
      reference.add(*truth);
    }
    if (const auto nees = trajectory_consistency(estimate, reference, path))
      out.push_back({system, run, id, *nees});
  }
}

}  // namespace

std::optional<TrajectoryConsistency> trajectory_consistency(const PoseSeries& estimate,
                                                            const PoseSeries& reference,
                                                            const std::string& name) {
  if (estimate.covariances.empty()) return std::nullopt;
  const bool rotations = reference.has_rotations();
  if (rotations) check_order_of_blocks(estimate, reference, name);
  TrajectoryConsistency out;
  out.n = estimate.size();
  out.dof = rotations ? 6 : 3;
  const auto n = static_cast<double>(out.n);
  double rotation = 0;
  for (size_t i = 0; i < estimate.size(); ++i) {
    const PoseCovariance& P = estimate.covariances[i];
    const Eigen::Vector3d e_p = reference.positions_m[i] - estimate.positions_m[i];
    const Eigen::Matrix3d P_p = P.topLeftCorner<3, 3>();
    out.position_nees += e_p.dot(P_p.llt().solve(e_p)) / n;
    if (!rotations) continue;
    const Vector6d e = error_of(estimate, reference, i);
    const auto found = score(e, P);
    if (!found)
      fail("{}: the covariance is not positive definite: are its numbers in the right order?",
           place(estimate, i, name));
    out.nees += found->nees / n;
    const Eigen::Vector3d e_R = e.tail<3>();
    const Eigen::Matrix3d P_R = P.bottomRightCorner<3, 3>();
    rotation += e_R.dot(P_R.llt().solve(e_R)) / n;
  }
  if (rotations)
    out.rotation_nees = rotation;
  else
    out.nees = out.position_nees;
  out.interval = nees_interval(static_cast<int>(out.n), out.dof);
  return out;
}

Fields<TrajectoryConsistency> consistency_fields() {
  using C = TrajectoryConsistency;
  Fields<C> fields = {{Column::number("nees", "mean", 3), &C::nees}};
  fields.add_range(range_columns("nees_low", "nees_high", 3, "95 % if consistent"),
                   [](const C& c) { return &c.interval; });
  fields.add(Column::number("position", "position (3)", 3), &C::position_nees);
  return fields.add(Column::number("rotation", "rotation (3)", 3), &C::rotation_nees);
}

std::vector<ObjectConsistency> object_consistency(const ObjectLog& log, uint64_t run) {
  std::vector<ObjectConsistency> out;
  std::map<ObjectFrame, SE3> motions, true_motions;
  for (const auto& [key, motion] : log.motions) {
    motions.emplace(key, motion.estimate);
    if (motion.truth) true_motions.emplace(key, *motion.truth);
  }
  add(log.pose_covariances, log.poses, log.true_poses, log.estimator, run, out);
  add(log.motion_covariances, motions, true_motions, log.estimator, run, out);
  return out;
}

Table object_consistency_table(const std::vector<ObjectConsistency>& found) {
  Fields<ObjectConsistency> fields = {
      {Column::text("estimator").folded(), &ObjectConsistency::system},
      {Column::count("run"), [](const ObjectConsistency& c) { return c.run + 1; }},
      {Column::text("object"), [](const ObjectConsistency& c) { return std::to_string(c.object); }},
      {Column::count("n"), [](const ObjectConsistency& c) { return c.nees.n; }}};
  fields.add(consistency_fields(), [](const ObjectConsistency& c) { return &c.nees; });
  return table_of(
      "Consistency of the covariances of objects",
      "Mean NEES, expected 6. The interval holds for independent errors. Errors of neighbouring frames "
      "depend on each other, so the actual interval is wider.",
      fields, found);
}

}  // namespace sextant
