#include "sextant/eval/evaluation/recorded_files.h"

#include <minizip/unzip.h>

#include <cstring>

#include "sextant/base/error.h"
#include "sextant/base/options.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/object_drive_testing.h"

namespace sextant {
namespace {

std::string member(const std::filesystem::path& zip, const char* name) {
  unzFile file = unzOpen64(zip.c_str());
  if (file == nullptr || unzLocateFile(file, name, 1) != UNZ_OK) return "";
  unz_file_info64 info{};
  unzGetCurrentFileInfo64(file, &info, nullptr, 0, nullptr, 0, nullptr, 0);
  std::string bytes(info.uncompressed_size, '\0');
  unzOpenCurrentFile(file);
  const int n = unzReadCurrentFile(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  unzClose(file);
  return n == static_cast<int>(bytes.size()) ? bytes : "";
}

TEST(EvoResult, NpyHasNumpysLayout) {
  const std::vector<double> values = {1, 2, 3, 4};
  const std::string npy = encode_npy(values, 2);
  EXPECT_EQ(npy.substr(1, 5), "NUMPY");
  EXPECT_EQ((npy.size() - 32) % 64, 0);
  EXPECT_NE(npy.find("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }"), std::string::npos);
  double last = 0;
  std::memcpy(&last, npy.data() + npy.size() - 8, 8);
  EXPECT_EQ(last, 4);
  EXPECT_NE(encode_npy(values).find("'shape': (4,)"), std::string::npos);
}

TEST(EvoResult, HoldsWhatEvoReads) {
  const TempFolder folder;
  TrajectoryFile estimate;
  EgoReference reference;
  for (int i = 0; i < 5; ++i) {
    estimate.poses.add(Eigen::Matrix3d::Identity(), {1.0 * i, 0.1 * i * i, 0.5});
    estimate.poses.stamps_s.push_back(10 + i);
  }
  reference.poses = estimate.poses;
  reference.poses.positions_m[3][0] += 0.5;
  const EgoOptions options{.alignment = Alignment::se3};
  const EgoResult result = evaluate_ego(reference, estimate, "est.txt", options);
  const auto path = folder.path() / "result.zip";
  write_evo_result(path, result, options, "ref.txt");

  EXPECT_EQ(Json::parse(member(path, "info.json"))["est_name"], "est.txt");
  EXPECT_EQ(Json::parse(member(path, "stats.json"))["rmse"], result.statistics.rmse);
  EXPECT_EQ(member(path, "error_array.npy"), encode_npy(result.errors));
  EXPECT_EQ(member(path, "timestamps.npy"), encode_npy(estimate.poses.stamps_s));
  EXPECT_EQ(member(path, "seconds_from_start.npy"), encode_npy(std::vector<double>{0, 1, 2, 3, 4}));
  EXPECT_EQ(member(path, "alignment_transformation_sim3.npy").size(), 128 + 16 * 8);
  EXPECT_FALSE(std::filesystem::is_empty(folder.path()));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1)
      << "a temporary is left";
  EXPECT_THROW(write_evo_result("/nowhere/at/all.zip", result, options, "ref.txt"), Error);
}

TEST(EvoResult, EveryObjectWithTruePosesHasOne) {
  const Drive drive;
  const TempFolder logs, saved;
  std::map<ObjectFrame, SE3> poses;
  for (const auto& [key, L] : drive.L) poses[key] = about_y(0, {0.01 * (key.second % 3), 0, 0}) * L;
  ObjectFiles files = write_dynosam(drive, poses, logs);
  files.zip = saved.path();
  const std::vector<ObjectPathErrors> paths = evaluate_object_files(files).paths;
  ASSERT_EQ(paths.size(), 2U);
  for (const ObjectPathErrors& errors : paths) {
    const auto zip = saved.path() / "m" / fmt::format("obj_{}.zip", errors.object);
    EXPECT_GT(errors.ape->Et_m, 1e-4);
    EXPECT_EQ(Json::parse(member(zip, "stats.json"))["rmse"], errors.ape->Et_m);
    EXPECT_FALSE(member(zip, "timestamps.npy").empty());
  }
}

}  // namespace
}  // namespace sextant
