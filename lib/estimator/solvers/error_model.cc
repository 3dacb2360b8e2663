#include "sextant/estimator/solvers/error_model.h"

namespace sextant {
namespace {

/// Derivatives by the motion times `to`.
void append(const ErrorModel& from, const Matrix6d& to, std::vector<ErrorScore>& out) {
  for (const ErrorScore& score : from.scores) {
    ErrorScore& changed = out.emplace_back();
    changed.u = score.u;
    changed.v = score.v;
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 6; ++b) changed.derivative[a] += to(a, b) * score.derivative[b];
    }
  }
}

}  // namespace

Matrix6d common_errors(const ErrorModel& first, const ErrorModel& second, const Matrix6d& to) {
  Matrix6d out = Matrix6d::Zero();
  if (first.parts.correlate() && second.parts.correlate()) {
    const Lanes& variances = first.parts.correlated;
    const auto sum_of = [&](const std::vector<ErrorScore>& scores) -> Matrix6d {
      return correlated_scores(scores, first.parts.shape).times(variances).topLeftCorner<6, 6>();
    };
    std::vector<ErrorScore> one, other, both;
    append(first, to * first.to_twist, one);
    append(second, to * second.to_twist, other);
    both = one;
    both.insert(both.end(), other.begin(), other.end());
    out = sum_of(both) - sum_of(one) - sum_of(other);
  }
  const Vector6d a = to * first.to_twist * first.by_offset, b = to * second.to_twist * second.by_offset;
  return out + first.squared_offset_px2 * (a * b.transpose() + b * a.transpose());
}

}  // namespace sextant
