// A run warns of mistakes in its input when its estimates contradict the truth, and only then.

#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/base/text.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/layout.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/diagnosis/number_readings.h"
#include "sextant/eval/workflow/workflow.h"

namespace sextant {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class InputWarnings : public testing::Test {
 protected:
  /// Returns the warnings of a run on a source.
  std::vector<std::string> warnings(const std::string& source) {
    const RunOutput output{.out = (temp_.path() / "out").string(), .force = true};
    const RunRequest request{.sources = {source}, .jobs = 2, .quiet = true};
    return run_into_folder(run_config(request, output), output).result.sources.at(0).problems;
  }

  /// Writes other camera poses into a folder of vdo.
  template <typename Change>
  static void change_poses(const std::filesystem::path& folder, const std::map<int, SE3>& given,
                           const Change& change) {
    std::map<int, SE3> changed;
    for (const auto& [frame, pose] : given) changed[frame] = change(pose);
    write_file(folder / "pose_gt.txt", encode_pose_text(changed));
  }

  TempFolder temp_;
};

TEST_F(InputWarnings, TheOnlyObjectInTheWorldFrameIsNamed) {
  const VdoFixture fixture = make_vdo_fixture(temp_.path() / "vdo", {.n_frames = 14});
  EXPECT_THAT(warnings(fixture.source()), IsEmpty());
  std::string rows;
  const std::string given = read_file(fixture.dir / "object_pose.txt");
  for (const std::string& line : split(given, '\n')) {
    std::vector<std::string> fields = split(line, '\t');
    if (fields.size() != 10) continue;
    const auto at = [&](size_t i) { return std::stod(fields[i]); };
    const Eigen::Vector3d p =
        fixture.T_world_camera.at(std::stoi(fields[0])) * Eigen::Vector3d(at(6), at(7), at(8));
    for (const int i : {0, 1, 2}) fields[static_cast<size_t>(6 + i)] = std::to_string(p[i]);
    rows += fmt::format("{}\n", fmt::join(fields, "\t"));
  }
  ASSERT_FALSE(rows.empty());
  write_file(fixture.dir / "object_pose.txt", rows);
  EXPECT_THAT(warnings(fixture.source()), Contains(HasSubstr("world frame")));
}

TEST_F(InputWarnings, MistakesOfASlowCameraAreNamed) {
  // Steps of about 0.045 m, as of a walker at 30 Hz.
  const VdoFixture fixture =
      make_vdo_fixture(temp_.path() / "vdo", {.n_frames = 8, .width = 960, .height = 288, .speed = 0.065});
  EXPECT_THAT(warnings(fixture.source()), IsEmpty());
  change_poses(fixture.dir, fixture.T_world_camera, [](const SE3& pose) { return pose.inverse(); });
  EXPECT_THAT(warnings(fixture.source()), Contains(HasSubstr("inverted")));
}

TEST_F(InputWarnings, InvertedPosesOfTwoFramesAreNamed) {
  const VdoFixture fixture = make_vdo_fixture(temp_.path() / "vdo");
  change_poses(fixture.dir, fixture.T_world_camera, [](const SE3& pose) { return pose.inverse(); });
  EXPECT_THAT(warnings(fixture.source() + "@0-1"), Contains(HasSubstr("inverted")));
}

// The steps have the right length; only the turns contradict the truth.
TEST_F(InputWarnings, ALeftHandedWorldIsNamed) {
  const auto sequence = open_source(SourceSpec::parse("synthetic:s01-turn@0-4"));
  const std::string source =
      find_layout("vdo").write(*sequence, {.out = temp_.path() / "turn", .jobs = 2, .quiet = true});
  const auto readings = number_readings("positions", 0);
  const auto mirror = std::ranges::find(readings, "mirrored_x", &NumberReading::code);
  change_poses(temp_.path() / "turn", sequence->truth().camera.poses(), mirror->read);
  EXPECT_THAT(warnings(source), Contains(HasSubstr("left-handed: the x axes")));
}

}  // namespace
}  // namespace sextant
