#include <gtest/gtest.h>

#include <cstring>
#include <thread>

#include "sextant/base/testing.h"
#include "sextant/datasets/dataset.h"
#include "sextant/datasets/rendered_sequence.h"

namespace sextant::synthetic {
namespace {

class Cache : public testing::Test {
 protected:
  std::unique_ptr<Sequence> open(const std::string& folder) const {
    SourceSpec spec = SourceSpec::parse("synthetic:s01-crossing");
    spec.options["cache"] = folder;
    return open_source(spec);
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> found;
    for (const auto& [name, bytes] : files_below(folder_)) found.push_back(folder_ / name);
    return found;
  }

  TempFolder temp_;
  fs::path folder_ = temp_.path() / "cache";
  static constexpr Channels all_channels = Channels::all();
};

template <typename T>
void expect_same(const Image<T>& a, const Image<T>& b) {
  ASSERT_FALSE(a.empty());
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0);
}

void expect_same(const Frame& a, const Frame& b) {
  expect_same(a.gray, b.gray);
  expect_same(a.rgb, b.rgb);
  expect_same(a.rgb_right, b.rgb_right);
  expect_same(a.depth_m, b.depth_m);
  expect_same(a.flow, b.flow);
  expect_same(a.backward_flow, b.backward_flow);
  expect_same(a.mask, b.mask);
}

TEST_F(Cache, ReturnsTheRenderedImages) {
  const Frame rendered = open("")->read(3, all_channels);
  expect_same(open(folder_.string())->read(3, all_channels), rendered);
  EXPECT_EQ(files().size(), 6U);  // gray is derived from rgb
  expect_same(open(folder_.string())->read(3, all_channels), rendered);
}

TEST_F(Cache, CachedImagesAreNotRendered) {
  open(folder_.string())->read(3, {.mask = true});
  const std::vector<fs::path> found = files();
  ASSERT_EQ(found.size(), 1U);
  // Other pixels with a valid checksum, as left by a program with another renderer.
  std::string bytes = read_file(found[0]);
  const size_t start = bytes.find('\n') + 1;
  bytes[start] = 77;
  bytes.replace(start - 65, 64, sha256(std::string_view(bytes).substr(start)));
  write_file(found[0], bytes);
  EXPECT_EQ(open(folder_.string())->read(3, {.mask = true}).mask(0, 0), 77);
}

TEST_F(Cache, DamagedFilesAreRenderedAgain) {
  const Frame rendered = open("")->read(3, all_channels);
  open(folder_.string())->read(3, all_channels);
  for (const fs::path& path : files()) {
    std::string bytes = read_file(path);
    const std::string name = path.filename().string();
    if (name.find("rgb.") != std::string::npos) bytes.resize(bytes.size() / 2);
    if (name.find("depth") != std::string::npos) bytes[bytes.size() - 5] ^= 1;
    if (name.find("-flow") != std::string::npos) bytes.clear();
    if (name.find("mask") != std::string::npos) bytes[16] = '9';
    if (name.find("backward_flow") != std::string::npos) bytes += "x";
    write_file(path, bytes);
  }
  expect_same(open(folder_.string())->read(3, all_channels), rendered);
  // The files are replaced.
  for (const fs::path& path : files()) EXPECT_GT(fs::file_size(path), 400000U) << path;
}

TEST_F(Cache, SupportsConcurrentUse) {
  const Frame rendered = open("")->read(3, all_channels);
  Frame one, two;
  std::thread first([&] { one = open(folder_.string())->read(3, all_channels); });
  std::thread second([&] { two = open(folder_.string())->read(3, all_channels); });
  first.join();
  second.join();
  expect_same(one, rendered);
  expect_same(two, rendered);
}

TEST_F(Cache, StopsWhenFullAndWithoutAFolder) {
  SourceSpec spec = SourceSpec::parse("synthetic:s01-crossing");
  spec.options["cache"] = folder_.string();
  spec.options["cache_max_mb"] = 1;
  open_source(spec)->read(3, {.depth = true, .mask = true});
  EXPECT_EQ(files().size(), 1U);  // the mask alone has less than a megabyte
  EXPECT_FALSE(open("/proc/no/such/folder")->read(3, {.mask = true}).mask.empty());
}

TEST_F(Cache, CachesOfOtherUsersAreRefused) {
  open(folder_.string())->read(3, {.mask = true});
  fs::permissions(folder_, fs::perms::all);
  expect_error([&] { open(folder_.string()); }, "others may write into this cache");
}

TEST_F(Cache, KeyFollowsTheContent) {
  const Scenario s = make_scenario("s01-crossing");
  const std::string key = content_key(s, "1");
  EXPECT_EQ(content_key(make_scenario("s01-crossing"), "1"), key);
  EXPECT_NE(content_key(s, "2"), key);
  Scenario moved = s;
  moved.T_world_camera[4] = SE3::exp(Vector6d::Constant(1e-9)) * moved.T_world_camera[4];
  EXPECT_NE(content_key(moved, "1"), key);
  Scenario painted = s;
  painted.actors[0].shape.colour.x() += 0.01F;
  EXPECT_NE(content_key(painted, "1"), key);
  Scenario gone = s;
  gone.actors[0].T_world_object[2].reset();
  EXPECT_NE(content_key(gone, "1"), key);
  Scenario other = s;
  other.camera.bf += 1;
  EXPECT_NE(content_key(other, "1"), key);
}

}  // namespace
}  // namespace sextant::synthetic
