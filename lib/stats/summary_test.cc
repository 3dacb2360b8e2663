#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cmath>
#include <limits>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/base/philox.h"
#include "sextant/base/quantile.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

const std::vector<double> values_of_r = {1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30};
const std::vector<double> none;

// numpy 1.24.2, scipy 1.10.1: np.quantile(x, p), np.std(x, ddof=1), scipy.stats.median_abs_deviation(x),
// np.sqrt(np.mean(np.square(x))) of `values_of_r`.
TEST(Summary, AgreesWithNumpyAndScipy) {
  EXPECT_DOUBLE_EQ(quantile(values_of_r, 0), 0.5);
  EXPECT_DOUBLE_EQ(quantile(values_of_r, 0.1), 1.14);
  EXPECT_DOUBLE_EQ(quantile(values_of_r, 0.25), 1.55);
  EXPECT_DOUBLE_EQ(quantile(values_of_r, 0.9), 2.596);
  EXPECT_DOUBLE_EQ(quantile(values_of_r, 1), 3.06);
  EXPECT_DOUBLE_EQ(median(values_of_r), 1.68);
  EXPECT_DOUBLE_EQ(std_dev(values_of_r), 0.7155941587240634);
  EXPECT_NEAR(mad(values_of_r), 0.2, 1e-15);
  EXPECT_DOUBLE_EQ(rmse(values_of_r), 1.8911078469745952);
  EXPECT_NEAR(mean(values_of_r), 15.9 / 9, 1e-15);
}

TEST(Summary, AMedianOfAnEvenNumberIsTheMiddleOfTwo) {
  EXPECT_EQ(median(std::vector<double>{4, 1, 3, 2}), 2.5);
  EXPECT_EQ(median(std::vector<double>{7}), 7);
}

TEST(Summary, MidranksShareTies) {
  EXPECT_THAT(midranks(std::vector<double>{3, 1, 3, 2, 3}), ::testing::ElementsAre(4, 1, 4, 2, 4));
}

TEST(Summary, BadSamplesAreErrorsNeverNaN) {
  using Function = double (*)(std::span<const double>);
  for (const Function f :
       {Function(mean), Function(rmse), Function(std_dev), Function(median), Function(mad)}) {
    EXPECT_THROW(f(none), Error);
    EXPECT_THROW(f(std::vector<double>{1, NAN, 2}), Error);
    EXPECT_THROW(f(std::vector<double>{1, std::numeric_limits<double>::infinity()}), Error);
  }
  EXPECT_THROW(std_dev(std::vector<double>{1}), Error);
  EXPECT_THROW(quantile(values_of_r, -0.1), Error);
  EXPECT_THROW(quantile(values_of_r, 1.1), Error);
  EXPECT_THROW(quantile(values_of_r, NAN), Error);
}

// scipy 1.10.1: scipy.stats.norm.ppf, norm.cdf, chi2.ppf.
TEST(Distributions, AgreeWithScipy) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-12);
  EXPECT_NEAR(normal_quantile(0.8), 0.8416212335729143, 1e-12);
  EXPECT_NEAR(normal_quantile(1e-10), -6.361340902404056, 1e-10);
  EXPECT_NEAR(normal_quantile(0.3), -0.5244005127080409, 1e-12);
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-12);
  EXPECT_NEAR(normal_cdf(1.3), 0.9031995154143897, 1e-14);
  EXPECT_NEAR(chi_square_quantile(0.025, 1), 0.0009820691171752555, 1e-13);
  EXPECT_NEAR(chi_square_quantile(0.975, 1), 5.023886187314888, 1e-9);
  EXPECT_NEAR(chi_square_quantile(0.025, 600), 534.0185504659327, 1e-7);
  EXPECT_NEAR(chi_square_quantile(0.975, 600), 669.7691522164112, 1e-7);
  EXPECT_NEAR(chi_square_quantile(0.5, 3.5), 2.86058940306655, 1e-9);
}

TEST(Distributions, ApproximationOfTheChiSquareQuantileKeepsItsBounds) {
  const auto relative_error = [](double p, int dof) {
    return std::abs(approximate_chi_square_quantile(p, dof) / chi_square_quantile(p, dof) - 1);
  };
  for (const double p : {0.5, 0.9, 0.95, 0.99}) EXPECT_LT(relative_error(p, 3), 0.007) << p;
  EXPECT_LT(relative_error(0.999, 3), 0.018);
  for (const double p : {0.01, 0.5, 0.99, 0.9999}) EXPECT_LT(relative_error(p, 2), 1e-9) << p;
}

// scipy.stats.t.ppf, and the closed forms for one and two degrees of freedom.
TEST(Distributions, StudentsTAgreesWithScipy) {
  EXPECT_NEAR(student_t_quantile(0.975, 1), 12.706204736432095, 1e-9);
  EXPECT_NEAR(student_t_quantile(0.975, 9), 2.2621571627409915, 1e-10);
  EXPECT_NEAR(student_t_quantile(0.025, 19), -2.0930240544082634, 1e-10);
  EXPECT_NEAR(student_t_quantile(0.975, 500), 1.9647198374673438, 1e-10);
  for (const double p : {0.001, 0.2, 0.4, 0.7, 0.99}) {
    EXPECT_NEAR(student_t_quantile(p, 1), std::tan(std::numbers::pi * (p - 0.5)), 1e-10 / p);
    EXPECT_NEAR(student_t_quantile(p, 2), (2 * p - 1) / std::sqrt(2 * p * (1 - p)), 1e-11 / p);
  }
  EXPECT_THROW(student_t_quantile(0.5, 0), Error);
  EXPECT_THROW(student_t_quantile(0, 3), Error);
}

TEST(Distributions, RefuseArgumentsOutsideTheirRange) {
  for (const double p : {0.0, 1.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(normal_quantile(p), Error);
    EXPECT_THROW(chi_square_quantile(p, 3), Error);
  }
  EXPECT_THROW(chi_square_quantile(0.5, 0), Error);
  EXPECT_THROW(chi_square_quantile(0.5, NAN), Error);
}

}  // namespace

namespace {

TEST(LogHistogram, CentresAreWithinAQuarterOfAPercent) {
  PhiloxStream random(1, 0);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::exp2(-60 + 120 * random.uniform());
    EXPECT_NEAR(LogHistogram::centre(LogHistogram::bin_of(value)) / value, 1, 0.0025);
  }
}

TEST(LogHistogram, BinsAreHalfAPercentWideAndLeaveNothingOut) {
  for (int bin = -3000; bin < 3000; ++bin) {
    const double low = std::exp2(static_cast<double>(bin) / LogHistogram::bins_per_octave);
    const double inside = low * (1 + 1e-12);
    EXPECT_EQ(LogHistogram::bin_of(inside), bin);
    EXPECT_EQ(LogHistogram::bin_of(low * (1 - 1e-12)), bin - 1);
    EXPECT_EQ(LogHistogram::bin_of(inside * 1.00499), bin);
    EXPECT_EQ(LogHistogram::bin_of(inside * 1.00501), bin + 1);
  }
}

TEST(LogHistogram, TakesEveryNumberFromZeroToTheLargest) {
  EXPECT_EQ(LogHistogram::bin_of(0), LogHistogram::zero_bin);
  EXPECT_EQ(LogHistogram::centre(LogHistogram::zero_bin), 0);
  EXPECT_EQ(LogHistogram::bin_of(1), 0);
  EXPECT_GT(LogHistogram::bin_of(std::numeric_limits<double>::denorm_min()), LogHistogram::zero_bin);
  EXPECT_EQ(LogHistogram::bin_of(std::numeric_limits<double>::max()),
            1024 * LogHistogram::bins_per_octave - 1);
  EXPECT_THROW(LogHistogram::bin_of(-1e-300), Error);
  EXPECT_THROW(LogHistogram::bin_of(std::nan("")), Error);
  EXPECT_THROW(LogHistogram::bin_of(std::numeric_limits<double>::infinity()), Error);
}

TEST(LogHistogram, CountsInAnyOrderAreTheSame) {
  LogHistogram rising, falling;
  for (int i = 0; i < 1000; ++i) rising.add(0.001 * (i % 200));
  for (int i = 999; i >= 0; --i) falling.add(0.001 * (i % 200));
  EXPECT_EQ(rising, falling);
  EXPECT_EQ(rising.n(), 1000U);
  EXPECT_EQ(rising.bins().front(), (LogHistogram::Bin{LogHistogram::zero_bin, 5}));
}

}  // namespace

}  // namespace sextant
