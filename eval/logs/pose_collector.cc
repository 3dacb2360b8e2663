#include "sextant/eval/logs/pose_collector.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sextant/base/error.h"

namespace sextant {

namespace {

constexpr double farthest_m = 1e7;
constexpr double norm_silent = 1e-3, norm_limit = 0.02;
constexpr double matrix_silent = 1e-5, matrix_limit = 1e-2;

template <typename T>
void sort_by(const std::vector<T>& keys, PoseSeries& series, PoseSeries* truth, const char* what,
             RepairLog& log) {
  const auto not_after = std::adjacent_find(keys.begin(), keys.end(), [](T a, T b) { return !(a < b); });
  if (not_after == keys.end()) return;
  const auto record = static_cast<int64_t>(not_after - keys.begin()) + 2;
  std::vector<int> order(keys.size());
  std::iota(order.begin(), order.end(), 0);
  const auto before = [&](int a, int b) {
    return keys[static_cast<size_t>(a)] < keys[static_cast<size_t>(b)];
  };
  if (!std::is_sorted(keys.begin(), keys.end())) {
    log.note(fmt::format("{}s are out of order, from pose {} on: sorted", what, record), 0);
    std::stable_sort(order.begin(), order.end(), before);
  }
  const auto last = std::unique(order.begin(), order.end(), [&](int a, int b) {
    return keys[static_cast<size_t>(a)] == keys[static_cast<size_t>(b)];
  });
  if (last != order.end()) {
    log.note(
        fmt::format("{} poses have the {} of an earlier one, the first is pose {}: the first of each is kept",
                    order.end() - last, what, record),
        0);
    order.erase(last, order.end());
  }
  if (truth) truth->keep(order);
  series.keep(order);
}

/// Returns true if time stamps were rounded to the seven digits of "%.6e" and became equal: all have at most
/// seven digits, and the unit of the seventh digit is not much smaller than the steps between them.
bool collapsed_to_seven_digits(const std::vector<double>& stamps) {
  double largest = 0, least_step = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < stamps.size(); ++i) {
    if (std::stod(fmt::format("{:.6e}", stamps[i])) != stamps[i]) return false;
    largest = std::max(largest, std::abs(stamps[i]));
    if (i > 0 && stamps[i] > stamps[i - 1]) least_step = std::min(least_step, stamps[i] - stamps[i - 1]);
  }
  constexpr double usual_step_s = 0.01;  // used if no two stamps differ
  if (least_step == std::numeric_limits<double>::infinity()) least_step = usual_step_s;
  return largest > 0 && std::pow(10, std::floor(std::log10(largest)) - 5) > least_step * (1 - 1e-9);
}

template <typename T>
void check_rising(const std::vector<T>& keys, const std::vector<int>& lines, const char* what,
                  const std::string& path) {
  const auto at = std::adjacent_find(keys.begin(), keys.end(), [](T a, T b) { return !(a < b); });
  if (at == keys.end()) return;
  const auto i = static_cast<size_t>(at - keys.begin());
  if (keys[i] != keys[i + 1]) {
    fail("{}:{}: {} {} comes after {} of line {}: expected ascending {}s; sort the lines", path, lines[i + 1],
         what, keys[i + 1], keys[i], lines[i], what);
  }
  if constexpr (std::is_same_v<T, double>) {
    if (collapsed_to_seven_digits(keys)) {
      fail(
          "{}:{}: time stamp {} stands in line {} too: all stamps have seven digits, as \"%.6e\" prints "
          "them, and collapse; print them with all digits, as \"%.9f\" does",
          path, lines[i + 1], keys[i + 1], lines[i]);
    }
  }
  fail("{}:{}: {} {} stands in line {} too: expected one pose each; remove one of the lines", path,
       lines[i + 1], what, keys[i + 1], lines[i]);
}

constexpr double largest_asymmetry = 1e-6;  // relative to the square root of the product of the variances
constexpr double least_eigenvalue = -1e-9;  // of the correlation matrix
constexpr double singular = 1e-12;          // eigenvalue of the correlation matrix

/// Copies the upper triangle of an n x n matrix, given row by row, to both triangles from (at, at) on.
void put_triangle(PoseCovariance& P, std::span<const double> numbers, int at, int n) {
  size_t k = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = i; j < n; ++j) P(at + i, at + j) = P(at + j, at + i) = numbers[k++];
  }
}

PoseCovariance matrix_of(std::span<const double> numbers) {
  PoseCovariance P = PoseCovariance::Zero();
  if (numbers.size() == 12) {
    put_triangle(P, numbers.first(6), 0, 3);
    put_triangle(P, numbers.last(6), 3, 3);
  } else if (numbers.size() == 21) {
    put_triangle(P, numbers, 0, 6);
  } else {
    SEXTANT_CHECK(numbers.size() == 36);
    for (int i = 0; i < 36; ++i) P(i / 6, i % 6) = numbers[static_cast<size_t>(i)];
  }
  return P;
}

/// Scales to a unit diagonal, so that metres and radians are comparable; 0 for a variance of 0.
PoseCovariance correlation_of(const PoseCovariance& P) {
  PoseCovariance C = P;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double scale = std::sqrt(std::abs(P(i, i)) * std::abs(P(j, j)));
      C(i, j) = scale > 0 ? P(i, j) / scale : (P(i, j) == 0 ? 0 : P(i, j) / std::abs(P(i, j)));
    }
  }
  return C;
}

double smallest_eigenvalue(const PoseCovariance& C) {
  return Eigen::SelfAdjointEigenSolver<PoseCovariance>(C, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

void check(const PoseCovariance& P, const std::string& path, int64_t number) {
  if (!P.allFinite()) fail("{}:{}: the covariance of the pose is not finite", path, number);
  const PoseCovariance C = correlation_of(P);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) {
      if (std::abs(C(i, j) - C(j, i)) <= largest_asymmetry) continue;
      fail(
          "{}:{}: the covariance of the pose is not symmetric: ({},{}) is {:.6g}, ({},{}) is {:.6g}; "
          "expected a covariance row by row: are blocks transposed, or columns missing?",
          path, number, i + 1, j + 1, P(i, j), j + 1, i + 1, P(j, i));
    }
  }
  const double least = smallest_eigenvalue(C);
  if (least < least_eigenvalue) {
    fail(
        "{}:{}: the covariance of the pose is not positive definite (the correlation matrix has the "
        "eigenvalue {:.3g}): expected the upper triangle or the whole matrix row by row",
        path, number, least);
  }
}

/// Converts a covariance to the axes of the world; see number_file.h.
PoseCovariance in_world(const PoseCovariance& P, const Eigen::Matrix3d& R, CovarianceConvention convention) {
  if (convention == CovarianceConvention::ros) return P;
  PoseCovariance J = PoseCovariance::Zero();
  J.topRightCorner<3, 3>() =
      convention == CovarianceConvention::gtsam ? R : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  J.bottomLeftCorner<3, 3>() = R;
  return J * P * J.transpose();
}

}  // namespace

void RepairLog::note(const std::string& what, int64_t line) {
  Seen& seen = seen_[what];
  if (seen.n++ == 0) seen.line = line;
}

void RepairLog::add(const RepairLog& other) {
  for (const auto& [what, theirs] : other.seen_) {
    Seen& seen = seen_[what];
    if (seen.n == 0 || theirs.line < seen.line) seen.line = theirs.line;
    seen.n += theirs.n;
  }
}

std::vector<std::string> RepairLog::warnings(const std::string& path) const {
  std::vector<std::string> lines;
  for (const auto& [what, seen] : seen_) {
    lines.push_back(seen.line > 0 ? fmt::format("{}:{}: {} ({} {})", path, seen.line, what, seen.n,
                                                seen.n == 1 ? "pose" : "poses")
                                  : fmt::format("{}: {}", path, what));
  }
  return lines;
}

void check_position(const Eigen::Vector3d& p, const std::string& path, int64_t number) {
  if (!(p.cwiseAbs().maxCoeff() <= farthest_m) || !p.allFinite())
    fail("{}:{}: position {} {} {} is not finite or beyond {} m: expected metres", path, number, p[0], p[1],
         p[2], farthest_m);
}

Eigen::Matrix3d checked_rotation(const Eigen::Quaterniond& q, const std::string& path, int64_t number,
                                 RepairLog& log) {
  const double off = std::abs(q.norm() - 1);
  if (!(off <= norm_limit)) {
    fail(
        "{}:{}: quaternion x {} y {} z {} w {} has norm {:.4g}, "
        "expected 1 within {}: are the values in the right order?",
        path, number, q.x(), q.y(), q.z(), q.w(), q.norm(), norm_limit);
  }
  if (off > norm_silent)
    log.note(fmt::format("quaternions whose norm differs from 1 by more than {}: normalised", norm_silent),
             number);
  return q.normalized().toRotationMatrix();
}

Eigen::Vector3d position_at(const NumberFile& file, size_t first) {
  const std::span<const double> v = file.values();
  const Eigen::Vector3d p(v[first], v[first + 1], v[first + 2]);
  check_position(p, file.path(), file.line());
  return p;
}

Eigen::Matrix3d quaternion_at(const NumberFile& file, size_t first, RepairLog& log) {
  const double* v = file.values().data() + first;
  return checked_rotation({v[3], v[0], v[1], v[2]}, file.path(), file.line(), log);
}

void check_rotation(const Eigen::Matrix3d& rotation, const std::string& path, int64_t line, RepairLog& log) {
  const double off = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= matrix_limit)) {
    fail("{}:{}: expected a rotation matrix, but R R' is off the identity by {:.3g} (limit {})", path, line,
         off, matrix_limit);
  }
  if (rotation.determinant() < 0)
    fail("{}:{}: expected a rotation matrix, got a reflection (det R = -1)", path, line);
  if (off > matrix_silent)
    log.note(fmt::format("rotation matrices that are not orthonormal by more than {}: used unchanged",
                         matrix_silent),
             line);
}

void add_matrix(PoseSeries& series, const NumberFile& file, size_t first, RepairLog& log) {
  const double* v = file.values().data() + first;
  Eigen::Matrix3d r;
  r << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
  check_rotation(r, file.path(), file.line(), log);
  const Eigen::Vector3d p(v[3], v[7], v[11]);
  check_position(p, file.path(), file.line());
  series.add(r, p);
}

void sort_and_unite(PoseSeries& series, PoseSeries* truth, RepairLog& log) {
  if (!series.stamps_s.empty()) {
    sort_by(std::vector<double>(series.stamps_s), series, truth, "time stamp", log);
  } else if (!series.frames.empty()) {
    sort_by(std::vector<int>(series.frames), series, truth, "frame number", log);
  }
}

void check_order(const PoseSeries& series, const std::string& path) {
  if (!series.stamps_s.empty())
    check_rising(series.stamps_s, series.lines, "time stamp", path);
  else if (!series.frames.empty())
    check_rising(series.frames, series.lines, "frame number", path);
}

void note_cut(const NumberFile& file, RepairLog& log) {
  if (file.is_cut()) log.note("its last line is incomplete and was left out", 0);
}

bool is_covariance_size(size_t n) { return n == 12 || n == 21 || n == 36; }

void add_covariance(PoseSeries& series, std::span<const double> numbers,
                    std::optional<CovarianceConvention> convention, const std::string& path, int64_t number) {
  const PoseCovariance P = matrix_of(numbers);
  check(P, path, number);
  const CovarianceConvention by_size =
      numbers.size() == 12 ? CovarianceConvention::openvins : CovarianceConvention::ros;
  const PoseCovariance S = 0.5 * (P + P.transpose());
  series.covariances.push_back(in_world(S, series.rotations.back(), convention.value_or(by_size)));
}

void finish_covariances(PoseSeries& series, const std::string& path, RepairLog& log) {
  std::vector<PoseCovariance>& all = series.covariances;
  if (all.empty()) return;
  if (all.size() != series.size())
    fail("{}: {} of {} poses have covariances: expected one with each", path, all.size(), series.size());
  const auto number = [&](size_t i) {
    return series.lines.empty() ? static_cast<int>(i) + 1 : series.lines[i];
  };
  std::optional<size_t> unknown;
  size_t n_unknown = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    if (!all[i].isZero(0)) continue;
    if (n_unknown++ == 0) unknown = i;
  }
  if (unknown && n_unknown < all.size())
    fail("{}:{}: the covariance of the pose is all zeros, but others are not: expected one with each pose",
         path, number(*unknown));
  if (unknown) return all.clear();
  for (size_t i = 0; i < all.size(); ++i) {
    if (smallest_eigenvalue(correlation_of(all[i])) > singular) continue;
    log.note(
        "covariances that are singular (a direction of the pose is exactly known): none is used, so there is "
        "no NEES",
        number(i));
    return all.clear();
  }
}

}  // namespace sextant
