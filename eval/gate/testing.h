#pragma once

// Results to compare, for tests: records as a sweep writes them, with errors that vary by a few per cent
// between seeds, and files of Google Benchmark. The fixture of tests that compare them.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "sextant/base/files.h"
#include "sextant/base/philox.h"
#include "sextant/base/testing.h"
#include "sextant/eval/gate/comparison.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"

namespace sextant {

/// Records of 2 sequences x `seeds` x 6 frames x ego and two objects.
inline std::vector<Record> sweep_records(int seeds = 10, uint64_t draw = 1) {
  std::vector<Record> records;
  PhiloxStream random(draw, 0);
  for (const char* sequence : {"s18", "city"}) {
    for (int seed = 0; seed < seeds; ++seed) {
      for (int frame = 1; frame <= 6; ++frame) {
        for (const char* body : {"ego", "object:1", "object:2"}) {
          Record r = RecordOf{
              "synthetic", sequence, "joint_flow", body, "depth 0.1 px", 0.1, static_cast<uint64_t>(seed),
              frame};
          r.n_points = 500;
          r.n_inliers = 450;
          const double scale = std::exp(0.3 * standard_normal(random));
          r.errors = {{"Et_m", 0.01 * scale}, {"ER_deg", 0.02 * scale}};
          if (r.is_ego()) {
            r.values = {{"step_gt_m", 0.6}};
          } else {
            r.values = {{"distance_gt_m", 9.0}, {"dynamic_gt", 1.0}};
            r.errors["Ev_kmh"] = 0.3 * scale;
          }
          r.time_ms = {{"refine", 0.3 * std::exp(0.1 * standard_normal(random))}, {"total", 1.5}};
          records.push_back(std::move(r));
        }
      }
    }
  }
  return records;
}

/// Provenance that a run of this program on this machine would record.
inline Json sweep_provenance() {
  Json run = build_provenance();
  run["configuration"] = {{"sources", {"synthetic:s18"}}, {"seeds", 10}, {"options", {{"sigma_px", 1.0}}}};
  run["sources"] = {{{"source", "synthetic:s18"},
                     {"packs", {"ab"}},
                     {"inputs", {{"/data/s18/a.png", {{"bytes", 3}, {"sha256", "aa"}}}}}}};
  return run;
}

inline void write_run(const std::filesystem::path& folder, const std::vector<Record>& records,
                      const Json& run = sweep_provenance()) {
  std::filesystem::create_directories(folder);
  write_file(folder / "records.jsonl", write_records(records));
  write_file(folder / "run.json", run.dump());
}

/// A file of Google Benchmark with `repetitions` of two benchmarks; `slower` multiplies the times of the
/// first benchmark.
inline Json benchmark_json(int repetitions, uint64_t draw, double slower = 1, double sigma = 0.02) {
  PhiloxStream random(draw, 1);
  Json json = {{"context", {{"host_name", "here"}, {"num_cpus", 2}, {"executable", "./solver_bench"}}},
               {"benchmarks", Json::array()}};
  for (const char* name : {"estimate/joint_flow/3000", "ransac/3000/30"}) {
    for (int i = 0; i < repetitions; ++i) {
      const double factor = (name[0] == 'e' ? slower : 1.0) * std::exp(sigma * standard_normal(random));
      json["benchmarks"].push_back({{"name", name},
                                    {"run_name", name},
                                    {"run_type", "iteration"},
                                    {"repetition_index", i},
                                    {"real_time", 310 * factor},
                                    {"cpu_time", 300 * factor},
                                    {"time_unit", "us"}});
    }
  }
  return json;
}

inline const Policy& defaults() {
  static const Policy policy;
  return policy;
}

/// Compares the folders "base" and "new" of a temporary folder; BASE has the records of sweep_records().
class ComparedRuns : public ::testing::Test {
 protected:
  ComparedRuns() { write_run(base(), sweep_records()); }

  fs::path base() const { return temp_.path() / "base"; }
  fs::path fresh() const { return temp_.path() / "new"; }
  Comparison compare(const Policy& policy = defaults()) const {
    return compare_paths(base(), fresh(), policy, 2);
  }

  /// Compares BASE with a copy of its records in which `change` has modified each record.
  template <typename Change>
  Comparison compare_changed(Change change, const Policy& policy = defaults()) const {
    std::vector<Record> records = sweep_records();
    for (Record& record : records) change(record);
    write_run(fresh(), records);
    return compare(policy);
  }

  /// Compares BASE with a copy whose run.json `change` has modified.
  Comparison compare_provenance(const std::function<void(Json&)>& change,
                                const Policy& policy = defaults()) const {
    Json run = sweep_provenance();
    change(run);
    write_run(fresh(), sweep_records(), run);
    return compare(policy);
  }

  GateVerdict compare_benchmarks(const Json& a, const Json& b, const Policy& policy = defaults()) const {
    write_file(temp_.path() / "a.json", a.dump());
    write_file(temp_.path() / "b.json", b.dump());
    return compare_paths(temp_.path() / "a.json", temp_.path() / "b.json", policy, 1).verdict;
  }

  TempFolder temp_;
};

inline bool is_target(const Record& r) { return r.sequence == "s18" && r.body == "object:1"; }

}  // namespace sextant
