// The configurations of published systems: arguments of the program, and location of its results.

#include <cstdlib>
#include <set>

#include "sextant/estimator/registry.h"
#include "sextant/eval/external/external_testing.h"

namespace sextant {
namespace {

class SystemConfigurations : public ExternalEstimatorTest {
 protected:
  static std::string configuration(const std::string& name) {
    return (fs::path(SEXTANT_SYSTEMS_FOLDER) / name).string();
  }

  /// Provides, in `variable`, a program that checks its arguments and copies correct results to $output.
  void offer_program(const char* variable, const std::string& script) const {
    write_camera();
    write_poses(
        "obj_1.txt", [&](int k) { return T_curr_prev(k); }, 4);
    write_results("times.txt", [](int k) { return fmt::format("{}", 10 * k); });
    const fs::path program = file("system");
    write_file(program, "#!/bin/sh\nset -e\nhere=$(dirname $0)\n" + script + "\n");
    fs::permissions(program, fs::perms::owner_all);
    setenv(variable, program.c_str(), 1);
  }
  SE3 T_curr_prev(int k) const {
    return own(T_world_camera(k)).inverse() * world(k) * own(T_world_camera(k - 1));
  }
  std::set<std::string> estimators() const {
    std::set<std::string> names;
    for (const Record& record : last_.records) names.insert(record.estimator);
    return names;
  }
};

constexpr const char* check_settings =
    "grep -q '^%YAML' $settings\n"
    "grep -Eq '^Camera.fx: [0-9.]+$' $settings\n"
    "grep -q '^ORBextractor.nFeatures: ' $settings\n";

TEST_F(SystemConfigurations, MultimotTrack) {
  setenv("MULTIMOT_TRACK_VOCABULARY", "/words", 1);
  offer_program("MULTIMOT_TRACK", "vocabulary=$1 settings=$2 input=$3 output=$4 first=$5\n" +
                                      std::string(check_settings) +
                                      "[ $vocabulary = /words ] && [ $first = 3 ]\n"
                                      "[ -f $input/flow/000007.flo ] && [ -f $input/object_pose.txt ]\n"
                                      "cp $here/camera.txt $here/obj_1.txt $here/times.txt $output");
  for (const char* name : {"multimot_track.json", "multimot_track_quiet.json"}) {
    last_ = run_with("external:" + configuration(name));
    EXPECT_THAT(last_.sources.front().problems, ElementsAre());
    EXPECT_EQ(statuses("object:1"), ok4);
    EXPECT_LT(worst("ego", "Et_m"), 1e-9);
    EXPECT_LT(worst("object:1", "Et_m"), 1e-8);
    EXPECT_EQ(last_.records.front().time_ms.at("program"), 40);
  }
}

TEST_F(SystemConfigurations, VdoSlamBeforeAndAfterTheFinalBatch) {
  offer_program("VDO_SLAM", "settings=$1 input=$2 output=$3 first=$4\n" + std::string(check_settings) +
                                "[ $first = 3 ] && [ -f $input/flow/000007.flo ]\n"
                                "mkdir $output/front $output/batch\n"
                                "cp $here/camera.txt $here/obj_1.txt $here/times.txt $output/front\n"
                                "cp $here/camera.txt $output/batch");
  last_ = run_with("external:" + configuration("vdo_slam.json"));
  EXPECT_THAT(estimators(), ElementsAre("VDO_SLAM 9d33024.batch", "VDO_SLAM 9d33024.front"));
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
  EXPECT_LT(worst("object:1", "Et_m"), 1e-8);
}

TEST_F(SystemConfigurations, OrbSlam2OfTheCameraAlone) {
  setenv("ORB_SLAM2_VOCABULARY", "/words", 1);
  offer_program("ORB_SLAM2", "mode=$1 vocabulary=$2 settings=$3 input=$4 output=$5\n" +
                                 std::string(check_settings) +
                                 "[ $mode = rgbd ] && [ $vocabulary = /words ]\n"
                                 "[ \"$6 $7 $8\" = '3 5 10' ] && [ -f $input/depth/000003.png ]\n"
                                 "cp $here/poses.tum $output/camera.tum; cp $here/times.txt $output");
  write_results("poses.tum",
                [&](int k) { return fmt::format("{:.1f} {}", 0.1 * k, tum_row(own(T_world_camera(k)))); });
  last_ = run_with("external:" + configuration("orb_slam2_rgbd.json"));
  EXPECT_THAT(last_.sources.front().problems, ElementsAre());
  EXPECT_EQ(statuses("ego"), ok4);
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
  EXPECT_EQ(statuses("object:1"), not_detected4);
}

}  // namespace
}  // namespace sextant
