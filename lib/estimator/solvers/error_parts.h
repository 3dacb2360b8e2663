#pragma once

// How the errors of a body correlate, from its own residuals.
//
// Where nothing is declared, the variances of the parts are estimated from the residuals: minimum norm quadratic
// unbiased estimation (Rao 1971) on a sample, in which the residuals' expectation counts what the fit has taken out
// of them. Parts that do not differ from nothing by three standard deviations are left out.

#include <vector>

#include "sextant/estimator/solvers/correlated_errors.h"

namespace sextant {

/// Variances of independent and of correlated parts of the errors, in units of the variance they were taken for.
struct ErrorParts {
  double independent = 1;
  std::vector<SpatialCorrelation::Part> correlated;  ///< share: the variance
};

/// From the residuals of at least twelve points; else, and where they tell nothing, independent ones.
ErrorParts estimate_error_parts(const std::vector<ErrorScore>& points);

}  // namespace sextant
