#pragma once

// A small plan for tests: 12 cases on a VDO folder with three pairs.

#include <string>

#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/experiment/sweep.h"

namespace sextant {

class SmallPlan : public testing::Test {
 protected:
  std::string plan_text(const std::string& noise = R"({"parameter":"depth.delta_d_px","levels":[0.1,0.2]})",
                        const std::string& seeds = "3") const {
    return "{\"sources\":[\"" + source_ +
           "\"],\n\"estimators\":[\"motion_only\",\"joint_flow\"],\n\"noise\":" + noise +
           ",\n\"seeds\":" + seeds + "}";
  }

  fs::path file(const std::string& name) const { return folder_.path() / name; }
  SweepConfig config(const std::string& out, KeepOfCases keep = KeepOfCases::records) const {
    SweepConfig config;
    config.plan = parse_plan(plan_text(), "plan.json", "");
    config.plan.keep = keep;
    config.out = file(out);
    config.cache = PackCache(file("cache"));
    config.quiet = true;
    return config;
  }
  static SweepConfig shard_of(SweepConfig whole, uint64_t shard, uint64_t n) {
    whole.shard = shard;
    whole.n_shards = n;
    return whole;
  }
  Json noise_of(const std::string& out) const { return read_json(file(out) / "run.json")["noise"]; }

  TempFolder folder_;
  std::string source_ =
      make_vdo_fixture(folder_.path() / "vdo", {.n_frames = 4, .width = 160, .height = 48}).source();
};

}  // namespace sextant
