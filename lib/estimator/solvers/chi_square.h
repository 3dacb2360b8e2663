#pragma once

// Quantiles of the chi-square distribution (Wilson & Hilferty 1931; two degrees of freedom: exact).

namespace sextant {

double chi_square_quantile(int degrees_of_freedom, double probability);

}  // namespace sextant
