#include <gtest/gtest.h>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "sextant/base/machine.h"

namespace sextant {
namespace {

class ParallelFor : public ::testing::TestWithParam<int> {};

TEST_P(ParallelFor, CallsEveryIndexOnce) {
  for (const int n : {0, 1, 2, 7, 1000}) {
    std::vector<std::atomic<int>> calls(n);
    parallel_for(n, GetParam(), [&](int i) { ++calls[i]; });
    for (int i = 0; i < n; ++i) EXPECT_EQ(calls[i], 1) << "index " << i << " of " << n;
  }
}

TEST_P(ParallelFor, ThrowsTheErrorOfTheLowestIndex) {
  for (int repeat = 0; repeat < 20; ++repeat) {
    try {
      parallel_for(64, GetParam(), [&](int i) {
        if (i == 5) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // so that 6 fails first
        if (i >= 5) throw std::runtime_error(std::to_string(i));
      });
      FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "5");
    }
  }
}

TEST_P(ParallelFor, RunsEveryIndexBelowTheFailedOne) {
  std::vector<std::atomic<int>> calls(100);
  EXPECT_THROW(parallel_for(100, GetParam(),
                            [&](int i) {
                              ++calls[i];
                              if (i == 60) throw std::runtime_error("60");
                            }),
               std::runtime_error);
  for (int i = 0; i <= 60; ++i) EXPECT_EQ(calls[i], 1) << i;
}

// 0 and negative values mean no threads; 16 is more threads than some of the counts above.
INSTANTIATE_TEST_SUITE_P(Jobs, ParallelFor, ::testing::Values(-1, 0, 1, 2, 3, 16));

TEST(ParallelForThreads, UsesNoMoreThreadsThanJobs) {
  std::atomic<int> now = 0;
  std::atomic<int> most = 0;
  parallel_for(50, 3, [&](int) {
    const int running = ++now;
    int seen = most;
    while (running > seen && !most.compare_exchange_weak(seen, running)) {
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    --now;
  });
  EXPECT_LE(most, 3);
  EXPECT_GE(most, 1);
}

}  // namespace

}  // namespace sextant
