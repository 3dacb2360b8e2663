#include "sextant/eval/records/tracks.h"

#include "sextant/base/testing.h"

namespace sextant {
namespace {

TEST(Tracks, FileReadsBackToTheSame) {
  const std::vector<BodyTrack> tracks = {
      {"ego",
       {{3, Eigen::Vector3d(0.1, -2, 1e-7), std::nullopt}, {4, std::nullopt, Eigen::Vector3d(1, 2, 3)}}},
      {"object:2", {{3, Eigen::Vector3d(5, 6, 7), Eigen::Vector3d(5, 6, 7.5)}}}};
  const std::string text = write_tracks(tracks);
  const std::vector<BodyTrack> read = parse_tracks(text, "tracks.csv");
  EXPECT_EQ(write_tracks(read), text);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_FALSE(read[0].points[0].truth_m);
  EXPECT_EQ(*read[0].points[1].truth_m, Eigen::Vector3d(1, 2, 3));
}

TEST(Tracks, OrientationsAreReadBackToTheSame) {
  const Eigen::Quaterniond q(0.5, 0.5, -0.5, 0.5);
  const std::vector<BodyTrack> tracks = {
      {"object:2", {{3, Eigen::Vector3d(5, 6, 7), std::nullopt, q, std::nullopt}}}};
  const std::string text = write_tracks(tracks, true);
  const std::vector<BodyTrack> read = parse_tracks(text, "tracks.csv");
  EXPECT_EQ(write_tracks(read, true), text);
  EXPECT_EQ(read[0].points[0].estimate_rotation->coeffs(), q.coeffs());
  EXPECT_FALSE(read[0].points[0].truth_rotation);
  const std::string header = write_tracks({}, true);
  expect_error([&] { parse_tracks(header + "ego,1,1,2,3,,,,0,0,0,2,,,,\n", "t.csv"); },
               "t.csv:2: expected a unit quaternion");
  expect_error([&] { parse_tracks(header + "ego,1,1,2,3,,,\n", "t.csv"); }, "t.csv:2: expected 16 fields");
}

TEST(Tracks, DifferentSystemsHaveDifferentFiles) {
  EXPECT_EQ(tracks_file("frontend", 1), "tracks/frontend_1.csv");
  EXPECT_NE(tracks_file("a b", 0), tracks_file("a-b", 0));
  EXPECT_THAT(tracks_file("../../x", 0), testing::Not(testing::HasSubstr("..")));
}

TEST(Tracks, DamagedFilesNameTheirLine) {
  expect_error([] { parse_tracks("frame,x\n", "t.csv"); }, "t.csv:1");
  const std::string header = write_tracks({});
  expect_error([&] { parse_tracks(header + "ego,1,2,3\n", "t.csv"); }, "t.csv:2: expected 8 fields, got 4");
  for (const char* frame : {"1.5", "1417361967514044.7", "3000000000"})
    expect_error([&] { parse_tracks(header + "ego," + frame + ",1,2,3,,,\n", "t.csv"); },
                 "t.csv:2: expected a frame");
  expect_error([&] { parse_tracks(header + "ego,1,nan,3,4,,,\n", "t.csv"); }, "'nan'");
  expect_error([&] { parse_tracks(header + "ego,1,2,3,,,,\n", "t.csv"); }, "expected a number, got ''");
}

}  // namespace
}  // namespace sextant
