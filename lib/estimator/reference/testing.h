#pragma once

// Test helper that compares an estimator with its reference in Ceres.

#include <gtest/gtest.h>

#include "sextant/estimator/solvers/testing.h"

namespace sextant {

/// Expects equal poses to 1e-8, flows to 1e-6 px and cost to `relative_cost` on random problems.
template <typename Ours, typename Reference, typename Options>
void expect_same_optimum(const RandomProblemOptions& problem, const Options& options, unsigned n_problems,
                         double relative_cost) {
  for (unsigned seed = 1; seed <= n_problems; ++seed) {
    const RandomProblem random = make_random_problem(seed, problem);
    const MotionEstimate ours = Ours(options).estimate(random.problem, random.start);
    const MotionEstimate reference = Reference(options).estimate(random.problem, random.start);
    ASSERT_EQ(ours.status, Status::ok) << seed;
    ASSERT_EQ(reference.status, Status::ok) << seed;
    EXPECT_LT(pose_difference(ours.T_curr_prev, reference.T_curr_prev), 1e-8) << seed;
    EXPECT_LT(flow_difference(ours, reference), 1e-6) << seed;
    EXPECT_NEAR(ours.cost, reference.cost, relative_cost * (1 + reference.cost)) << seed;
  }
}

}  // namespace sextant
