#include "sextant/eval/diagnosis/trajectory_hypotheses.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "sextant/eval/diagnosis/number_readings.h"
#include "sextant/geometry/axes.h"

namespace sextant {
namespace {

/// The 24 rotations that map axes to axes, the identity first.
std::vector<Eigen::Matrix3d> axis_rotations() {
  std::vector<Eigen::Matrix3d> out = {Eigen::Matrix3d::Identity()};
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) R(i, order[static_cast<size_t>(i)]) = (signs >> i) & 1 ? -1 : 1;
      if (R.determinant() > 0 && !R.isIdentity()) out.push_back(R);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return out;
}

void reorder_quaternions(PoseSeries& series, bool w_is_first) {
  for (Eigen::Matrix3d& R : series.rotations) {
    const Eigen::Quaterniond q(R);
    R = (w_is_first ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w())   // read as x y z w, is w x y z
                    : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()))  // read as w x y z, is x y z w
            .toRotationMatrix();
  }
}

void transpose_rotations(PoseSeries& series) {
  for (Eigen::Matrix3d& R : series.rotations) R.transposeInPlace();
}

/// Multiplies the angle of each rotation by 2, or by 1/2. Of the two rotations whose square is R, the one
/// nearer to the rotation before is taken.
void double_angles(PoseSeries& series) {
  for (Eigen::Matrix3d& R : series.rotations) R = Eigen::Quaterniond(R * R).normalized().toRotationMatrix();
}
void halve_angles(PoseSeries& series) {
  Eigen::Quaterniond last = Eigen::Quaterniond::Identity();
  for (Eigen::Matrix3d& R : series.rotations) {
    const Eigen::AngleAxisd turn(R);
    const Eigen::Quaterniond half(Eigen::AngleAxisd(turn.angle() / 2, turn.axis())),
        other(Eigen::AngleAxisd(turn.angle() / 2 + std::numbers::pi, turn.axis()));
    last = rotation_angle_rad(last.inverse() * half) <= rotation_angle_rad(last.inverse() * other) ? half
                                                                                                   : other;
    R = last.toRotationMatrix();
  }
}

/// Reads the coordinates `latitude` and `longitude` as degrees, and converts them to metres east and north of
/// the first position. Returns false if they are no degrees, or span more than one.
bool read_degrees(PoseSeries& series, int latitude, int longitude) {
  constexpr double m_per_degree = 6'371'000 * std::numbers::pi / 180, widest_deg = 1;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : series.positions_m) box.extend(p);
  const Eigen::Vector3d largest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()), extent = box.sizes();
  if (!(largest[latitude] <= 90 && largest[longitude] <= 180) ||
      std::max(extent[latitude], extent[longitude]) > widest_deg)
    return false;
  const Eigen::Vector3d origin = series.positions_m[0];
  const double shrink = std::cos(origin[latitude] * std::numbers::pi / 180);
  for (Eigen::Vector3d& p : series.positions_m) {
    const Eigen::Vector3d d = p - origin;
    p = {m_per_degree * shrink * d[longitude], m_per_degree * d[latitude], d.z()};
  }
  return true;
}

/// Returns true if the extents of both paths agree within a factor of 3. If they do not, a smaller unit
/// merely scales noise down.
bool has_same_extent(const TrajectoryPair& pair) {
  constexpr double factor = 3;
  const double a = rms_extent_m(pair.reference), b = rms_extent_m(pair.estimate);
  return a > 0 && b > 0 && a < factor * b && b < factor * a;
}

/// The side of a pair that a hypothesis is about.
struct Side {
  PoseSeries TrajectoryPair::*poses;
  std::string name;    ///< "estimate"
  std::string prefix;  ///< of its flags: "" or "ref-"
  double price;  ///< the estimate is cheaper, so that it is reported if both sides would explain the data
};

/// Adds hypotheses about one side to a list; `change` returns false if the hypothesis does not apply.
struct Table {
  const Side& side;
  std::vector<Hypothesis<TrajectoryPair>>& list;

  /// `cause` follows the name of the side: "is mirrored", or "'s positions are mirrored".
  template <typename Change>
  void add_of_pair(const std::string& code, const std::string& cause, const std::string& remedy, double price,
                   const Change& change) {
    const char* blank = cause.starts_with('\'') ? "" : " ";
    list.push_back({code, "the " + side.name + blank + cause, remedy,
                    [change](TrajectoryPair& pair, double&) { return change(pair); }, price + side.price});
  }
  template <typename Change>
  void add(const std::string& code, const std::string& cause, const std::string& remedy, double price,
           const Change& change) {
    add_of_pair(code, cause, remedy, price,
                [poses = side.poses, change](TrajectoryPair& pair) { return change(pair.*poses); });
  }
};

/// Wraps `change` so that it applies only to poses that have rotations.
template <typename Change>
auto of_rotations(const Change& change) {
  return [change](PoseSeries& poses) {
    if (!poses.has_rotations()) return false;
    change(poses);
    return true;
  };
}

void turn_body(PoseSeries& poses, const Eigen::Matrix3d& B) {
  for (Eigen::Matrix3d& R : poses.rotations) R = R * B;
}
void turn_world(PoseSeries& poses, const Eigen::Matrix3d& W) {
  for (Eigen::Matrix3d& R : poses.rotations) R = W * R;
  for (Eigen::Vector3d& p : poses.positions_m) p = W * p;
}

/// Formats the directions of the axes in opencv's axes, e.g. "x right, y down, z forward".
std::string directions(const Eigen::Matrix3d& opencv_from_named) {
  constexpr std::array<const char*, 6> names = {"right", "down", "forward", "left", "up", "backward"};
  std::string text;
  for (int i = 0; i < 3; ++i) {
    Eigen::Index k = 0;
    opencv_from_named.col(i).cwiseAbs().maxCoeff(&k);
    const auto name = static_cast<size_t>(opencv_from_named(k, i) > 0 ? k : k + 3);
    text += fmt::format("{}{} {}", i == 0 ? "" : ", ", "xyz"[i], names[name]);
  }
  return text;
}

void add_of_side(const Side& side, bool converted, const TrajectoryHypothesisOptions& options,
                 std::vector<Hypothesis<TrajectoryPair>>& out) {
  constexpr double mirrored_price = 0.15;
  Table table{side, out};
  table.add("inverse", "holds inverse poses, T_camera_world instead of T_world_camera",
            "give --" + side.prefix + "inverse", 0, of_rotations([](PoseSeries& poses) { invert(poses); }));
  for (const bool w_first : {true, false}) {
    table.add(
        "columns", fmt::format("'s quaternions seem to have w {}", w_first ? "first" : "last"),
        "check the order of its columns; give --format, or a header that names every column (--format table)",
        0.1, of_rotations([w_first](PoseSeries& poses) { reorder_quaternions(poses, w_first); }));
  }
  table.add("transposed", "'s rotation matrices are transposed, or its quaternions conjugate",
            "transpose the rotation of each line and keep the position", 0.2,
            of_rotations(transpose_rotations));
  constexpr double price_of_angles = 0.4;
  table.add("angles", "'s rotations turn by twice the angle",
            "write the quaternion (cos(a / 2), n sin(a / 2)) of a rotation by a about n", price_of_angles,
            of_rotations(halve_angles));
  table.add("angles", "'s rotations turn by half of the angle",
            "write the quaternion (cos(a / 2), n sin(a / 2)) of a rotation by a about n", price_of_angles,
            of_rotations(double_angles));
  for (const bool latitude_first : {true, false}) {
    const char* order = latitude_first ? "latitude and longitude" : "longitude and latitude";
    table.add_of_pair(
        "degrees", fmt::format("'s x and y look like {} in degrees", order),
        "convert them to metres east and north", 0.1, [side, latitude_first](TrajectoryPair& pair) {
          return read_degrees(pair.*side.poses, latitude_first ? 0 : 1, latitude_first ? 1 : 0) &&
                 has_same_extent(pair);
        });
  }
  for (const int axis : {0, 1, 2}) {
    const Eigen::Matrix3d M = Eigen::Vector3d::Unit(axis).asDiagonal();
    const Eigen::Matrix3d mirror = Eigen::Matrix3d::Identity() - 2 * M;
    const std::string_view xyz = "xyz";
    table.add("mirrored", fmt::format("is mirrored, its world and body have the opposite {} axis", xyz[axis]),
              mirror_remedy(axis), mirrored_price, of_rotations([mirror](PoseSeries& poses) {
                turn_world(poses, mirror);
                turn_body(poses, mirror);
              }));
    table.add("mirrored", fmt::format("'s positions are mirrored, {} has the opposite sign", xyz[axis]),
              fmt::format("negate {} in each line", xyz[axis]), mirrored_price, [mirror](PoseSeries& poses) {
                for (Eigen::Vector3d& p : poses.positions_m) p = mirror * p;
                return true;
              });
  }
  for (const bool inverse : {false, true}) {
    table.add("steps",
              fmt::format("holds the step of each frame ({}) instead of poses in one world",
                          inverse ? "T_k,k-1" : "T_k-1,k"),
              inverse ? "write T_0,k = T_0,k-1 inverse(T_k,k-1)" : "write T_0,k = T_0,k-1 T_k-1,k", 0.3,
              of_rotations([inverse](PoseSeries& poses) { poses = chained(poses, inverse); }));
  }
  if (!options.scales) {
    std::vector<std::pair<double, const char*>> units = {{0.01, "centimetres"}, {0.001, "millimetres"}};
    // A reference in kilometres differs from its estimate as an estimate in millimetres from its reference.
    if (side.name == "estimate") units.emplace_back(1000, "kilometres");
    for (const auto& [factor, text] : units) {
      // An alignment with scale would keep the unit of the reference.
      const char* or_scaled = side.name == "estimate" ? ", or give --align sim3" : "";
      table.add_of_pair("unit", fmt::format("'s positions are in {}", text),
                        fmt::format("multiply them by {}{}", factor, or_scaled), 0.1,
                        [factor = factor, side](TrajectoryPair& pair) {
                          for (Eigen::Vector3d& p : (pair.*side.poses).positions_m) p *= factor;
                          return has_same_extent(pair);
                        });
    }
  }
  if (!converted) {
    for (const Axes axes : {Axes::opengl, Axes::ned, Axes::flu}) {
      const std::string name(to_string(axes));
      table.add("axes", "seems to be in the axes " + name, "give --" + side.prefix + "axes " + name, 0,
                of_rotations([axes](PoseSeries& poses) {
                  const Eigen::Matrix3d C = opencv_from_axes(axes);
                  turn_world(poses, C);
                  turn_body(poses, C.transpose());
                }));
    }
    for (const Eigen::Matrix3d& B : axis_rotations()) {
      if (B.isIdentity()) continue;
      table.add(
          "body",
          fmt::format("is of a body whose axes point {} in the camera frame", directions(B.transpose())),
          "give --" + side.prefix + "body-from-camera " + body_from_camera_numbers(B), 0.5,
          of_rotations([B](PoseSeries& poses) { turn_body(poses, B); }));
    }
  }
  if (!options.turns_world) {
    for (const Eigen::Matrix3d& W : axis_rotations()) {
      if (W.isIdentity()) continue;
      table.add("world", fmt::format("'s world has axes that point {} in the other world", directions(W)),
                "give --align se3", 0.5, [W](PoseSeries& poses) {
                  turn_world(poses, W);
                  return true;
                });
    }
  }
}

// ---- the test of "each alone"

/// Divides the path into pieces of about a hundredth of its length: first, middle and last index of each.
std::vector<std::array<size_t, 3>> pieces_of(const PoseSeries& poses) {
  double path_m = 0;
  std::vector<double> at = {0};
  for (size_t i = 1; i < poses.size(); ++i)
    at.push_back(path_m += (poses.positions_m[i] - poses.positions_m[i - 1]).norm());
  std::vector<std::array<size_t, 3>> pieces;
  constexpr double n_pieces = 100;
  if (!(path_m > 0)) return pieces;
  for (size_t first = 0, i = 1; i < poses.size(); ++i) {
    if (at[i] - at[first] < path_m / n_pieces) continue;
    size_t middle = first;
    while (at[middle + 1] - at[first] < at[i] - at[middle + 1]) ++middle;
    pieces.push_back({first, middle, i});
    first = i;
  }
  return pieces;
}

double length_m(const PoseSeries& poses, const std::vector<std::array<size_t, 3>>& pieces) {
  double sum = 0;
  for (const auto& [first, middle, last] : pieces)
    sum += (poses.positions_m[last] - poses.positions_m[first]).norm();
  return sum;
}

std::optional<double> scatter_deg(const PoseSeries& poses, const std::vector<std::array<size_t, 3>>& pieces) {
  constexpr size_t fewest = 20;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> directions;
  for (const auto& [first, middle, last] : pieces) {
    const Eigen::Vector3d d = poses.positions_m[last] - poses.positions_m[first];
    if (!(d.norm() > 0)) continue;
    directions.push_back(poses.rotations[middle].transpose() * d.normalized());
    sum += directions.back() * directions.back().transpose();
  }
  if (directions.size() < fewest) return std::nullopt;
  const Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(2);
  double squares = 0;
  for (const Eigen::Vector3d& u : directions) {
    const double angle = std::acos(std::min(1.0, std::abs(u.dot(axis))));
    squares += angle * angle / static_cast<double>(directions.size());
  }
  return degrees(std::sqrt(squares));
}

}  // namespace

Eigen::Vector3d mean_position(const PoseSeries& series) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : series.positions_m) mean += p / static_cast<double>(series.size());
  return mean;
}

double rms_extent_m(const PoseSeries& series) {
  const Eigen::Vector3d mean = mean_position(series);
  double squares = 0;
  for (const Eigen::Vector3d& p : series.positions_m) squares += (p - mean).squaredNorm();
  return std::sqrt(squares / static_cast<double>(series.size()));
}

std::vector<Hypothesis<TrajectoryPair>> trajectory_hypotheses(const TrajectoryHypothesisOptions& options) {
  std::vector<Hypothesis<TrajectoryPair>> out;
  constexpr double of_reference = 0.3;
  add_of_side({&TrajectoryPair::estimate, "estimate", "", 0}, options.converted_estimate, options, out);
  add_of_side({&TrajectoryPair::reference, "reference", "ref-", of_reference}, options.converted_reference,
              options, out);
  return out;
}

PoseSeries chained(const PoseSeries& steps, bool inverse) {
  PoseSeries out = steps;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < steps.size(); ++i) {
    const Eigen::Matrix3d& E = steps.rotations[i];
    const Eigen::Matrix3d S = inverse ? Eigen::Matrix3d(E.transpose()) : E;
    const Eigen::Vector3d s =
        inverse ? Eigen::Vector3d(-S * steps.positions_m[i]) : Eigen::Vector3d(steps.positions_m[i]);
    p += R * s;
    R = Eigen::Quaterniond(R * S).normalized().toRotationMatrix();
    out.rotations[i] = R;
    out.positions_m[i] = p;
  }
  return out;
}

void invert(PoseSeries& poses) {
  for (size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Matrix3d R = poses.rotations[i].transpose();
    if (!poses.covariances.empty()) {
      PoseCovariance J = PoseCovariance::Zero();
      J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = -R;
      J.topRightCorner<3, 3>() = -R * skew(poses.positions_m[i]);
      poses.covariances[i] = J * poses.covariances[i] * J.transpose();
    }
    poses.positions_m[i] = -R * poses.positions_m[i];
    poses.rotations[i] = R;
  }
}

double path_in_pieces_m(const PoseSeries& poses) { return length_m(poses, pieces_of(poses)); }

std::optional<Explanation> explain_alone(const PoseSeries& poses) {
  constexpr double least_deg = 20, most_deg = 10;
  if (!poses.has_rotations() || poses.size() < 20) return std::nullopt;
  const auto declared_pieces = pieces_of(poses);
  const auto declared = scatter_deg(poses, declared_pieces);
  if (!declared || *declared < least_deg) return std::nullopt;
  const double path_m = length_m(poses, declared_pieces);
  std::vector<Reading> readings;
  for (const Hypothesis<TrajectoryPair>& hypothesis : trajectory_hypotheses({})) {
    if (hypothesis.code != "inverse" && hypothesis.code != "columns" && hypothesis.code != "transposed")
      continue;
    TrajectoryPair pair{{}, poses};
    double ignored = 0;
    if (hypothesis.cause.starts_with("the reference") || !hypothesis.undo(pair, ignored)) continue;
    const auto pieces = pieces_of(pair.estimate);
    const auto left = scatter_deg(pair.estimate, pieces);
    if (!left || *left > most_deg || length_m(pair.estimate, pieces) > 1.01 * path_m) continue;
    readings.push_back(
        {hypothesis.code, hypothesis.cause, hypothesis.remedy, *left * *left, hypothesis.price});
  }
  return explain(*declared * *declared, readings);
}

bool is_near_axes(const Eigen::Matrix3d& R, double angle_rad) {
  return std::ranges::any_of(axis_rotations(), [&](const Eigen::Matrix3d& A) {
    return rotation_angle_rad(A.transpose() * R) < angle_rad;
  });
}

std::string body_from_camera_numbers(const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  Eigen::Matrix<double, 3, 4> T;
  T << R, t;
  std::vector<double> numbers;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) numbers.push_back(std::abs(T(i, j)) < 5e-7 ? 0 : T(i, j));
  }
  return fmt::format("\"{:.6g}\"", fmt::join(numbers, " "));
}

}  // namespace sextant
