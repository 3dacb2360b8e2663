#pragma once

// A small plan for tests: 12 cases over a VDO folder of three pairs.

#include <string>

#include "sextant/datasets/vdo_folder_testing.h"

namespace sextant {

class SmallPlan {
 protected:
  std::string plan_text(const std::string& noise = R"({"parameter":"depth.delta_d_px","levels":[0.1,0.2]})",
                        const std::string& seeds = "3") const {
    return "{\"sources\":[\"" + source_ +
           "\"],\n\"estimators\":[\"motion_only\",\"joint_flow\"],\n\"noise\":" + noise +
           ",\n\"seeds\":" + seeds + "}";
  }

  TempFolder folder_;
  std::string source_ =
      make_vdo_fixture(folder_.path() / "vdo", {.n_frames = 4, .width = 160, .height = 48}).source();
};

}  // namespace sextant
