#pragma once

// A small suite for tests, and a folder in which it is run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/eval/benchmark/benchmark_run.h"
#include "sextant/eval/benchmark/benchmark_verification.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {

inline constexpr const char* small_suite = R"({
  "name": "small-1", "title": "A small suite for tests", "metric": "Et_m",
  "breakdown": {"error_ratio": 2, "min_coverage": 0.9},
  "tracks": [{"name": "depth", "title": "Depth noise", "level": "delta_d [px]", "nominal": 0.2,
              "quick": [0.2],
    "objects": {"s18": [1]},
    "plans": {"depth": {"sources": ["synthetic:s18@0-3"], "seeds": 2,
      "noise": {"parameter": "depth.delta_d_px", "levels": [0.2, 0.8], "base": {"flow": {"epe_px": 0.5}}}}}}]
})";

class Benchmark : public ::testing::Test {
 protected:
  void SetUp() override {
    write_file(suite_file(), small_suite);
    options_.suite = suite_file();
    options_.sweep.cache = PackCache(folder_.path() / "cache");
    options_.sweep.quiet = true;
  }
  std::string suite_file() const { return (folder_.path() / "small-1.json").string(); }

  BenchmarkRequest request(const std::string& estimator, const std::string& out) {
    BenchmarkRequest request{.suite = suite_file(), .estimators = {estimator}, .out = folder_.path() / out};
    request.sweep = options_.sweep;
    return request;
  }
  /// The folder of the estimator, with its card.
  fs::path run(const std::string& estimator, const std::string& out = "out", int jobs = 1,
               bool quick = false) {
    BenchmarkRequest of = request(estimator, out);
    of.sweep.jobs = jobs;
    of.quick = quick;
    fs::create_directories(of.out);
    const Suite suite = find_suite(of.suite);
    const BenchmarkPlan plan = plan_benchmark(of, suite).front();
    run_benchmark(of, suite, plan);
    write_card(suite, of.out / plan.folder, 1);
    return of.out / plan.folder;
  }
  std::string refusal(const fs::path& folder) {
    try {
      verify_benchmark(folder, options_);
    } catch (const Error& error) {
      return error.what();
    }
    return "verified";
  }
  static void edit(const fs::path& file, const std::function<void(std::vector<Record>&)>& change) {
    std::vector<Record> records = read_records(file);
    change(records);
    write_file(file, write_records(records));
  }
  static Json without_costs(const fs::path& folder) {
    Json card = read_json(folder / "card.json");
    card.erase("costs");
    return card;
  }

  TempFolder folder_;
  VerifyOptions options_;
};

}  // namespace sextant
