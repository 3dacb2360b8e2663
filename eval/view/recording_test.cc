#include "sextant/eval/view/recording.h"

#include "sextant/base/testing.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {
namespace {

/// Four frames of an embedded scene with noise, as `sextant view` sees them.
ViewedRun small_run(const TempFolder& temp) {
  RunConfig config;
  config.sources = {SourceSpec::parse("synthetic:s18@0-3")};
  config.estimator = "joint_flow";
  config.noise = Noise::parse(R"({"flow": {"epe_px": 0.5}, "depth": {"delta_d_px": 0.2}})");
  config.quiet = true;
  write_output_folder(temp / "run", run_files(run(config)));
  return view_run(temp.path() / "run", {}, "", 1, true);
}

TEST(Recording, PosesReadBackToTheLastDigit) {
  const TempFolder temp;
  const ViewedRun run = small_run(temp);
  const std::string file = temp / "run.mcap";
  EXPECT_GT(write_recording(run, file, {.quiet = true}), 40U);
  int n_topics = 0;
  for (const BodyTrack& track : run.tracks) {
    for (const char* side : {"estimate", "truth"}) {
      std::vector<std::pair<Eigen::Vector3d, Eigen::Quaterniond>> expected;
      for (const TrackPoint& point : track.points) {
        const bool estimate = side == std::string_view("estimate");
        const auto& p = estimate ? point.estimate_m : point.truth_m;
        if (p) expected.emplace_back(*p, *(estimate ? point.estimate_rotation : point.truth_rotation));
      }
      const std::string body =
          track.body == "ego" ? "/camera" : "/object/" + track.body.substr(track.body.find(':') + 1);
      const TrajectoryFile read = read_trajectory(file + ":" + body + "/" + side, "mcap");
      ASSERT_EQ(read.poses.size(), expected.size());
      ++n_topics;
      for (size_t i = 0; i < expected.size(); ++i) {
        EXPECT_LE((read.poses.positions_m[i] - expected[i].first).norm(), 1e-12);
        EXPECT_LE((read.poses.rotations[i] - expected[i].second.toRotationMatrix()).norm(), 1e-12);
      }
    }
  }
  EXPECT_GE(n_topics, 4) << "the camera and at least one object";
}

TEST(Recording, IsTheSameBytesEachTime) {
  const TempFolder temp;
  const ViewedRun run = small_run(temp);
  write_recording(run, temp / "a.mcap", {.quiet = true});
  write_recording(run, temp / "b.mcap", {.quiet = true});
  EXPECT_EQ(read_file(temp / "a.mcap"), read_file(temp / "b.mcap"));
}

TEST(Recording, ImagesMayBeLeftOut) {
  const TempFolder temp;
  const ViewedRun run = small_run(temp);
  const uint64_t with = write_recording(run, temp / "a.mcap", {.quiet = true});
  const uint64_t without = write_recording(run, temp / "b.mcap", {.images = false, .quiet = true});
  EXPECT_EQ(with, without + 8) << "an image and a calibration for each of four frames";
  EXPECT_EQ(read_file(temp / "b.mcap").find("\"jpeg\""), std::string::npos);
}

}  // namespace
}  // namespace sextant
